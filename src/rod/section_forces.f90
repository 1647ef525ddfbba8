!> Section forces at the ends of elements and inside, from the stored unknowns.
module section_forces
   use kinds, only: wp
   use problem, only: problem_t
   use rod_state, only: state_t, element_displacement, element_load
   use element_families, only: collocates
   use element_foundation, only: foundation_forces
   use inner_forces, only: inner_forces_t
   use gauss_tableau, only: max_stages
   use rod_load, only: ge_load_t, line_at_stage
   use rod_profile, only: home_angle
   use ge_data, only: ge_data_t
   use ge_in_state, only: ge_at
   use ge_stages, only: ge_directions
   use ge_fields, only: ge_end_forces, ge_between, ge_rotation
   use ul2_element, only: ul2_forces
   use conforming_span, only: conforming_state_t, conforming_forces, conforming_resultant
   implicit none
   private
   public :: end_forces, local_forces, inner_local_forces, rod_direction

contains

   !> Force and moment (n_x, n_y, m) at both ends of an element, global axes, exerted by the part after the section on the part
   !> before it.
   subroutine end_forces(problem, state, e, first, second)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: e
      real(wp), intent(out) :: first(3), second(3) !! (n_x, n_y, m) at the first and at the second end
      type(inner_forces_t) :: inner
      if (.not. collocates(problem%model%mesh%family(e))) then
         call ul2_end_forces(problem, state, e, first, second)
         return
      end if
      call foundation_forces(problem, state, e, inner)
      if (problem%conforms(e) > 0) then
         call conforming_end_forces(problem, state, e, inner, first, second)
      else
         call ge_end_forces(problem%tableau(problem%model%mesh%stages(e)), ge_at(problem, state, e), first, second, inner)
      end if
   end subroutine end_forces

   !> End forces of a conforming element. A separate procedure, because its work arrays take time to set up.
   pure subroutine conforming_end_forces(problem, state, e, inner, first, second)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: e
      type(inner_forces_t), intent(in) :: inner !! forces of foundations
      real(wp), intent(out) :: first(3), second(3)
      type(conforming_state_t) :: kept
      call conforming_resultant(problem, state, e, 0.0_wp, kept, first)
      call conforming_resultant(problem, state, e, 1.0_wp, kept, second, inner)
   end subroutine conforming_end_forces

   !> End forces of a UL2 element. Its loads are lumped: half of them acts between each end and its node.
   pure subroutine ul2_end_forces(problem, state, e, first, second)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: e
      real(wp), intent(out) :: first(3), second(3)
      real(wp) :: u(6), d(2), l, shear, half(2), force(3), line(2), rate(2)
      type(ge_load_t) :: load
      u = element_displacement(problem, state, e)
      d = state%geometry%element(e)%chord + u(4:5) - u(1:2)
      l = norm2(d)
      d = d / l
      load = element_load(problem, state, e)
      force = ul2_forces(1.0_wp / problem%compliance(e)%axial, 1.0_wp / problem%compliance(e)%bending, load, state%z(:3, e))
      shear = -(force(2) + force(3)) / l
      first = [force(1) * d(1) - shear * d(2), force(1) * d(2) + shear * d(1), -force(2)]
      second = [first(1:2), force(3)]
      call line_at_stage(load, 1, line, rate)
      half = 0.5_wp * (state%geometry%element(e)%length * line + load%pressure * l * [-d(2), d(1)])
      first(1:2) = first(1:2) + half
      second(1:2) = second(1:2) - half
   end subroutine ul2_end_forces

   !> Tangent angle of the deformed rod at end `side` of an element.
   pure real(wp) function rod_direction(problem, state, e, side) result(angle)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: e, side
      angle = state%geometry%element(e)%end_angle(side) + state%u(3, problem%model%mesh%node(side, e))
   end function rod_direction

   !> Section forces (N, Q, M) in the axes of the deformed section at both ends: N > 0 in tension, Q along the normal to the left.
   subroutine local_forces(problem, state, e, local)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: e
      real(wp), intent(out) :: local(3, 2) !! (N, Q, M) at each end
      real(wp) :: ends(3, 2)
      integer :: side
      call end_forces(problem, state, e, ends(:, 1), ends(:, 2))
      do side = 1, 2
         local(:, side) = in_section(ends(:, side), rod_direction(problem, state, e, side))
      end do
   end subroutine local_forces

   !> Section forces (N, Q, M) at places inside an element without a distributed foundation. Their error is O(h^(s+1)) in an element
   !> of s stages; in a UL2 element they vary linearly between the ends.
   function inner_local_forces(problem, state, e, tau) result(local)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: e
      real(wp), intent(in) :: tau(:)            !! places in the element, 0 to 1 of its stress-free length
      real(wp) :: local(3, size(tau)), ends(3, 2), rho(2, max_stages), span(2), resultant(3)
      type(ge_data_t) :: element
      integer :: i
      if (problem%conforms(e) > 0) then
         local = conforming_local_forces(problem, state, e, tau)
      else if (collocates(problem%model%mesh%family(e))) then
         element = ge_at(problem, state, e)
         associate (tab => problem%tableau(problem%model%mesh%stages(e)))
            rho = ge_directions(tab, element)
            do i = 1, size(tau)
               call ge_between(tab, element, rho, tau(i), span, resultant)
               local(:, i) = in_section(resultant, home_angle(problem, element%g, e, tau(i)) + ge_rotation(tab, element, tau(i)))
            end do
         end associate
      else
         call local_forces(problem, state, e, ends)
         do i = 1, size(tau)
            local(:, i) = ends(:, 1) + tau(i) * (ends(:, 2) - ends(:, 1))
         end do
      end if
   end function inner_local_forces

   !> Section forces at places inside a conforming element; a separate procedure like conforming_end_forces.
   pure function conforming_local_forces(problem, state, e, tau) result(local)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: e
      real(wp), intent(in) :: tau(:)
      real(wp) :: local(3, size(tau))
      type(conforming_state_t) :: kept
      integer :: i
      do i = 1, size(tau)
         call conforming_forces(problem, state, e, tau(i), local(:, i), kept=kept)
      end do
   end function conforming_local_forces

   !> Force and moment (N, Q, M) in the axes of a section, from those in global axes.
   pure function in_section(resultant, angle) result(local)
      real(wp), intent(in) :: resultant(3)      !! (n_x, n_y, m)
      real(wp), intent(in) :: angle             !! tangent angle of the section
      real(wp) :: local(3)
      local = [cos(angle) * resultant(1) + sin(angle) * resultant(2), cos(angle) * resultant(2) - sin(angle) * resultant(1), &
         & resultant(3)]
   end function in_section
end module section_forces

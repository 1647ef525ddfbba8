!> Resultants at the ends of the elements and inside, from the stored unknowns.
module section_forces
   use kinds, only: wp
   use model, only: family_ge
   use problem, only: problem_t
   use rod_state, only: state_t, element_displacement, element_load
   use rod_profile, only: new_profile, profile_angle
   use ge_element, only: ge_end_forces, ge_interior, ge_load_t
   use conforming_span, only: conforming_forces, conforming_resultant
   use ul2_element, only: ul2_forces
   use element_foundation, only: foundation_forces
   use inner_forces, only: inner_forces_t
   implicit none
   private
   public :: end_forces, local_forces, inner_local_forces, rod_direction

contains

   !> (n_x, n_y, m) in global axes at both ends of an element: the force and moment that the part behind the section
   !> exerts on the part before it.
   subroutine end_forces(problem, state, e, first, second)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: e
      real(wp), intent(out) :: first(3), second(3)
      real(wp) :: u(6), d(2), l, shear, half(2), force(3)
      type(ge_load_t) :: load
      type(inner_forces_t) :: inner
      if (problem%conforms(e) > 0) then
         first = conforming_resultant(problem, state, e, 0.0_wp)
         second = conforming_resultant(problem, state, e, 1.0_wp)
         return
      end if
      u = element_displacement(problem, state, e)
      if (problem%model%mesh%family(e) == family_ge) then
         call foundation_forces(problem, state, e, inner)
         call ge_end_forces(problem%tableau(problem%model%mesh%stages(e)), state%geometry%element(e)%length, &
            & state%geometry%element(e)%scale, state%geometry%element(e)%angle, problem%compliance(e), &
            & element_load(problem, state, e), u, state%z(:problem%z_size(e), e), first, second, inner)
      else
         d = state%geometry%element(e)%chord + u(4:5) - u(1:2)
         l = norm2(d)
         d = d / l
         load = element_load(problem, state, e)
         force = ul2_forces(1.0_wp / problem%compliance(e)%axial, 1.0_wp / problem%compliance(e)%bending, load, &
            & state%z(:3, e))
         shear = -(force(2) + force(3)) / l
         first = [force(1) * d(1) - shear * d(2), force(1) * d(2) + shear * d(1), -force(2)]
         second = [first(1:2), force(3)]
         ! Its loads are lumped: half of them acts between each end and the node.
         half = 0.5_wp * (state%geometry%element(e)%length * load%line + load%pressure * l * [-d(2), d(1)])
         first(1:2) = first(1:2) + half
         second(1:2) = second(1:2) - half
      end if
   end subroutine end_forces

   !> Tangent angle of the deformed rod at end `side` of an element.
   pure real(wp) function rod_direction(problem, state, e, side) result(angle)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: e, side
      angle = state%geometry%element(e)%end_angle(side) + state%u(3, problem%model%mesh%node(side, e))
   end function rod_direction

   !> (N, Q, M) in the axes of the deformed section at both ends: N positive in tension, Q along the left normal.
   subroutine local_forces(problem, state, e, local)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: e
      real(wp), intent(out) :: local(3, 2)
      real(wp) :: ends(3, 2), angle
      integer :: side
      call end_forces(problem, state, e, ends(:, 1), ends(:, 2))
      do side = 1, 2
         angle = rod_direction(problem, state, e, side)
         local(1, side) = cos(angle) * ends(1, side) + sin(angle) * ends(2, side)
         local(2, side) = cos(angle) * ends(2, side) - sin(angle) * ends(1, side)
         local(3, side) = ends(3, side)
      end do
   end subroutine local_forces

   !> The same inside an element on which no distributed foundation acts: O(h^(s+1)) with s stages.
   function inner_local_forces(problem, state, e, tau) result(local)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: e
      real(wp), intent(in) :: tau               !! 0 to 1 of the element
      real(wp) :: local(3), span(2), rotation, resultant(3), angle, ends(3, 2)
      integer :: s
      if (problem%conforms(e) > 0) then
         call conforming_forces(problem, state, e, tau, local, span, angle)
         return
      end if
      if (problem%model%mesh%family(e) /= family_ge) then
         call local_forces(problem, state, e, ends)
         local = ends(:, 1) + tau * (ends(:, 2) - ends(:, 1))
         return
      end if
      s = problem%model%mesh%stages(e)
      associate (g => state%geometry%element(e))
         call ge_interior(problem%tableau(s), g%length, g%scale, g%angle, problem%compliance(e), element_load(problem, state, e), &
            & element_displacement(problem, state, e), state%z(:problem%z_size(e), e), tau, span, rotation, resultant)
      end associate
      angle = profile_angle(problem, state, new_profile(problem, state, e), tau)
      local = [cos(angle) * resultant(1) + sin(angle) * resultant(2), cos(angle) * resultant(2) - sin(angle) * resultant(1), &
         & resultant(3)]
   end function inner_local_forces
end module section_forces

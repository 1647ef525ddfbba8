!> Section forces at the ends of elements and inside, from the stored unknowns.
module section_forces
   use kinds, only: wp
   use problem, only: problem_t
   use rod_state, only: state_t
   use rod_element, only: rod_element_t
   use rod_elements, only: rod_at
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
      class(rod_element_t), pointer :: rod
      rod => rod_at(problem, e)
      call rod%end_forces(problem, state, e, first, second)
   end subroutine end_forces

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

   !> Section forces (N, Q, M) at places inside an element without a distributed foundation.
   function inner_local_forces(problem, state, e, tau) result(local)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: e
      real(wp), intent(in) :: tau(:)            !! places in the element, 0 to 1 of its stress-free length
      real(wp) :: local(3, size(tau))
      class(rod_element_t), pointer :: rod
      rod => rod_at(problem, e)
      local = rod%local_forces(problem, state, e, tau)
   end function inner_local_forces
end module section_forces

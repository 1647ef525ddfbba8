!> Negligible uplift: couples and forces that lift a line contact's node at a segment boundary off the obstacle over less than the
!> part `line_share` of the rod segment, see lifted_node.
module lifted_little
   use kinds, only: wp
   use problem, only: problem_t
   use rod_state, only: state_t
   use conforming_span, only: conforming_forces
   use breakpoint_forces, only: breakpoint_couple, left_over
   use lifted_node, only: inside_line, lifted_beside, lifted_at_mirror, stays_down
   use contact_spans, only: line_share
   implicit none
   private
   public :: lifting_couple, lifts_little

contains

   !> Couple on a line contact's node at a segment boundary, divided by scale times size, >= 0. Zero if the couple is within the
   !> residual or lifts a negligible length.
   real(wp) function lifting_couple(problem, state, c, scale) result(couple)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: c              !! candidate
      real(wp), intent(in) :: scale         !! scale of forces
      integer :: side, e
      real(wp) :: length(2)
      couple = abs(breakpoint_couple(problem, state, c)) / (scale * problem%size)
      if (couple <= left_over(problem)) couple = 0.0_wp
      if (.not. couple > 0.0_wp) return
      if (.not. inside_line(problem, c)) then
         if (ends_down(problem, state, c)) couple = 0.0_wp
         return
      end if
      length = lifted_beside(problem, state, c)
      do side = 1, 2
         e = problem%beside(side, problem%candidates%node(c))
         if (length(side) <= line_share * problem%layout%rod_segment(problem%rod_segment(e))%length) couple = 0.0_wp
      end do
   end function lifting_couple

   !> True if the couple on the node at the end of a line contact, where the rod ends, lifts a negligible length or height.
   logical function ends_down(problem, state, c)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: c
      real(wp) :: density
      integer :: e
      call look_at_end(problem, state, c, e, density)
      ends_down = e > 0
      if (ends_down) ends_down = stays_down(problem, e, breakpoint_couple(problem, state, c), density)
   end function ends_down

   !> True if a force away from the obstacle, on a line contact's node with fixed rotation at the end of a rod (symmetry plane),
   !> lifts a negligible length.
   logical function lifts_little(problem, state, c, push, scale)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: c              !! candidate
      real(wp), intent(in) :: push          !! force over the scale, > 0: the obstacle presses
      real(wp), intent(in) :: scale         !! scale of forces
      real(wp) :: density
      integer :: e
      lifts_little = push < 0.0_wp .and. problem%model%fixed(3, problem%candidates%node(c))
      if (.not. lifts_little) return
      call look_at_end(problem, state, c, e, density)
      lifts_little = e > 0
      if (lifts_little) lifts_little = lifted_at_mirror(-push * scale, density) <= line_share * &
         & problem%layout%rod_segment(problem%rod_segment(e))%length
   end function lifts_little

   !> Finds the element of a line contact at a candidate where both the line contact and its rod end, and the density of the
   !> obstacle's force there.
   subroutine look_at_end(problem, state, c, e, density)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: c
      integer, intent(out) :: e             !! 0: the candidate is not the end of a line contact and a rod
      real(wp), intent(out) :: density
      real(wp) :: local(3), place(2), angle
      integer :: side
      density = 0.0_wp
      e = 0
      if (count(problem%candidates%element(:, c) > 0) /= 1) return
      side = findloc(problem%candidates%element(:, c) > 0, .true., 1)
      if (problem%conforms(problem%candidates%element(side, c)) == 0) return
      e = problem%candidates%element(side, c)
      call conforming_forces(problem, state, e, merge(1.0_wp, 0.0_wp, side == 1), local, place, angle, density)
   end subroutine look_at_end
end module lifted_little

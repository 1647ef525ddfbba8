!> Corners of the force laws of stops and of foundations at nodes: the penetration passes from one segment of the law to the next,
!> and the stiffness jumps.
module law_corners
   use kinds, only: wp
   use problem, only: problem_t
   use rod_state, only: state_t, candidate_opening
   use force_law, only: law_segment, first_corner
   implicit none
   private
   public :: law_corner_t, corner_between, beyond_corner

   !> A corner of the law of one candidate.
   type :: law_corner_t
      integer :: candidate = 0                   !! candidate whose law has the corner; 0: no corner
      real(wp) :: penetration = 0.0_wp           !! penetration at the corner [length], negative where the law acts in tension
   end type law_corner_t

contains

   !> Corner of the law between two states: of the first candidate whose penetrations at the two states lie on different segments,
   !> the corner nearest to the first state.
   type(law_corner_t) function corner_between(problem, from, to) result(corner)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: from, to
      integer :: c, first, last, k
      do c = 1, problem%candidates%n
         associate (obstacle => problem%model%obstacle(problem%candidates%obstacle(c)))
            if (obstacle%law == 0) cycle
            associate (law => problem%model%law(obstacle%law))
               first = law_segment(law, penetration(problem, from, c))
               last = law_segment(law, penetration(problem, to, c))
               if (first == last) cycle
               k = first_corner(first, last)
               corner%candidate = c
               corner%penetration = sign(law%penetration(abs(k)), real(k, wp))
            end associate
         end associate
         return
      end do
   end function corner_between

   !> Event function of a corner: the penetration at a state minus the penetration of the corner [length].
   real(wp) function beyond_corner(problem, state, corner) result(beyond)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(law_corner_t), intent(in) :: corner   !! corner with candidate > 0
      beyond = penetration(problem, state, corner%candidate) - corner%penetration
   end function beyond_corner

   !> Penetration of a node into its obstacle; 0 if the gap is open. If the law also acts in tension, the penetration is negative
   !> there.
   real(wp) function penetration(problem, state, candidate) result(depth)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: candidate
      depth = -candidate_opening(problem, state, candidate)
      if (.not. problem%candidates%bilateral(candidate)) depth = max(depth, 0.0_wp)
   end function penetration
end module law_corners

!> Where a set of contact spans that is known further on begins to hold.
module begin_of_set
   use kinds, only: wp
   use span_test, only: span_test_t, any_fails
   use next_spans, only: next_t, copy_next, go_to_load
   use timing, only: timers_t
   implicit none
   private
   public :: go_back

   integer, parameter :: most_halvings = 20     !! of the way

contains

   !> Back towards a load factor, as far as the next set holds: halves of what is left of the way. Where it holds all the way both
   !> sets have one equilibrium there, and the change lies further back.
   subroutine go_back(to, next, timers)
      real(wp), intent(in) :: to
      type(next_t), intent(inout) :: next
      type(timers_t), intent(inout) :: timers
      type(next_t) :: nearer
      real(wp) :: fails, since, whole              ! load factors at which it fails, and holds
      integer :: try
      logical :: holds, beyond
      call copy_next(next, nearer)
      since = next%state%load_factor
      whole = since - to
      call look_at(to)
      beyond = holds
      if (beyond) call copy_next(nearer, next)
      do try = most_halvings, -most_halvings, -1
         if (.not. holds) exit
         call look_at(to - 0.5_wp**try * whole)
      end do
      if (holds) return
      do try = 1, most_halvings
         call look_at(0.5_wp * (fails + since))
         if (holds .and. .not. beyond) call copy_next(nearer, next)
      end do

   contains

      !> Whether the next set holds at a load factor.
      subroutine look_at(load)
         real(wp), intent(in) :: load
         type(span_test_t), allocatable :: tests(:)
         type(next_t) :: there
         call copy_next(nearer, there)
         call go_to_load(there, load, tests, timers)
         holds = allocated(tests)
         if (holds) holds = .not. any_fails(tests)
         if (holds) call copy_next(there, nearer)
         if (holds) since = load
         if (.not. holds) fails = load
      end subroutine look_at
   end subroutine go_back
end module begin_of_set

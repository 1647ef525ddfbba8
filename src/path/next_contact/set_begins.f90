!> Load factor at which a new contact set becomes valid (onset):
!>
!>   find_begin  by the zero of one test of the new set, from an increment on which the old set fails
!>   go_back     by all tests of the new set, from a point further on, with possibly other sets between
module set_begins
   use kinds, only: wp
   use contact_spans, only: shortest
   use test_kinds, only: span_test_t, test_slack, test_pressure, test_length, test_crossing, any_fails
   use contact_change_types, only: step_interval_t
   use next_spans, only: next_t, copy_next, go_to_load
   use path_state, only: path_state_t
   use converged_state, only: contact_holds
   implicit none
   private
   public :: find_begin, go_back, small_load

   integer, parameter :: max_tries = 30         !! loads of the secant method
   integer, parameter :: most_halvings = 20     !! halvings of the load interval
   real(wp), parameter :: shorter = 0.1_wp      !! least length of a new contact or free span at its onset, as a share of the least
   !! length elsewhere (contact_spans%shortest)

contains

   !> Finds the onset of the new set, that is, the load at which the least pressure of its line contact is zero or slightly above,
   !> or at which a given test is zero. The secant method is used, bracketed if possible. If the closed span has zero length and the
   !> set is valid on the whole increment, the onset is at the run's point: the two meshes may place the onset slightly before this
   !> point.
   subroutine find_begin(run, interval, gone, next, found, test)
      type(path_state_t), intent(in) :: run
      type(step_interval_t), intent(in) :: interval
      logical, intent(in) :: gone                !! the closed span has zero length
      type(next_t), intent(inout) :: next        !! the new set, as from new_next
      logical, intent(out) :: found
      integer, intent(in), optional :: test      !! test of the new set that is zero at the onset; absent: its least pressure
      real(wp), parameter :: small = 1.0e-3_wp * test_slack(test_pressure)
      real(wp) :: load, loads(2), value, values(2), slack, goal
      integer :: try
      logical :: ok, narrow
      ! The pressure of a line contact shall be slightly above zero.
      slack = merge(0.0_wp, small, present(test))
      goal = 0.5_wp * slack
      loads = interval%to%state%load_factor
      call evaluate_at(loads(2), value)
      found = .false.
      if (.not. ok) return
      found = gone .and. value >= 0.0_wp .and. value <= slack
      if (found) return
      values = value - goal
      load = loads(2) + small_load(run)
      if (value > slack) then
         call evaluate_at(run%last%state%load_factor, value)
         found = gone .and. ok .and. value >= 0.0_wp
         if (found) return
         if (ok .and. value < 0.0_wp) load = run%last%state%load_factor
      end if
      do try = 1, max_tries
         ! The two loads are equal within rounding.
         if (.not. abs(load - loads(2)) > 0.0_wp) return
         call evaluate_at(load, value)
         if (.not. ok) return
         ! On a narrow interval the residual of forces spoils the slope.
         narrow = abs(load - loads(2)) <= sqrt(small) * abs(interval%to%state%load_factor - interval%from%load_factor)
         if (.not. (narrow .and. abs(next%rate) > 0.0_wp)) next%rate = (value - goal - values(2)) / (load - loads(2))
         found = (value >= 0.0_wp .and. value <= slack) .or. (narrow .and. abs(value) <= test_slack(test_pressure))
         if (found .or. .not. abs(next%rate) > 0.0_wp) return
         if (values(1) * values(2) < 0.0_wp .and. (value - goal) * values(2) > 0.0_wp) then
            values(1) = 0.5_wp * values(1)
         else
            loads(1) = loads(2)
            values(1) = values(2)
         end if
         loads(2) = load
         values(2) = value - goal
         if (.not. abs(values(2) - values(1)) > 0.0_wp) return
         load = loads(2) - values(2) * (loads(2) - loads(1)) / (values(2) - values(1))
      end do

   contains

      !> Computes the least pressure, or the given test, at a load factor.
      subroutine evaluate_at(load, least)
         real(wp), intent(in) :: load
         real(wp), intent(out) :: least
         type(span_test_t), allocatable :: tests(:)
         call go_to_load(next, load, tests)
         ok = allocated(tests)
         least = 0.0_wp
         if (.not. ok) return
         if (present(test)) then
            least = tests(test)%value
         else
            least = minval(tests%value, mask=tests%kind == test_pressure)
         end if
      end subroutine evaluate_at
   end subroutine find_begin

   !> Change of the load factor for finite differences.
   pure real(wp) function small_load(run) result(step)
      type(path_state_t), intent(in) :: run
      step = 1.0e-4_wp * max(abs(run%last_load), 1.0e-3_wp * abs(run%last%state%load_factor))
   end function small_load

   !> Moves the next set from a point of its path back towards a load factor, as far as the set is valid, by halving the load
   !> interval. At the change itself a new contact or free span has zero length, so shorter ones than elsewhere are valid. If the
   !> set is valid up to this load factor, both sets have the same equilibrium there, and the change is further back.
   subroutine go_back(to, next)
      real(wp), intent(in) :: to
      type(next_t), intent(inout) :: next  !! in: the next set at a point further on; out: at the farthest point back that was found
      !! valid
      type(next_t) :: nearer
      real(wp) :: fails, since, whole              ! load factors at which the set fails and at which it is valid; length of the
      ! interval
      integer :: try
      logical :: holds, beyond
      call copy_next(next, nearer)
      since = next%state%load_factor
      whole = since - to
      call test_at(to)
      beyond = holds
      if (beyond) call copy_next(nearer, next)
      do try = most_halvings, -most_halvings, -1
         if (.not. holds) exit
         call test_at(to - 0.5_wp**try * whole)
      end do
      if (holds) return
      do try = 1, most_halvings
         call test_at(0.5_wp * (fails + since))
         if (holds .and. .not. beyond) call copy_next(nearer, next)
      end do

   contains

      !> Tests the next set at a load factor.
      subroutine test_at(load)
         real(wp), intent(in) :: load
         type(span_test_t), allocatable :: tests(:)
         type(next_t) :: there
         call copy_next(nearer, there)
         call go_to_load(there, load, tests)
         holds = allocated(tests)
         if (holds) then
            where (tests%kind == test_length .or. tests%kind == test_crossing) tests%value = tests%value + (1.0_wp - shorter) * &
               & shortest * minval(next%problem%layout%rod_segment%length) / next%problem%size
            holds = .not. any_fails(tests) .and. contact_holds(there%problem, there%state, there%system)
         end if
         if (holds) call copy_next(there, nearer)
         if (holds) since = load
         if (.not. holds) fails = load
      end subroutine test_at
   end subroutine go_back
end module set_begins

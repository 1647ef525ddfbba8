!> The end of the listing: accuracy and cost of the run.
module run_summary
   use kinds, only: wp
   use text, only: to_text
   use timing, only: timing_seconds, timing_calls, timing_total, counted, n_phases, phase_name, n_counters, &
      & counter_name
   use run_accuracy, only: accuracy_t, check_t, checks_of
   use columns, only: scientific, fixed, left, right
   implicit none
   private
   public :: list_accuracy, list_cost, failed_checks

contains

   !> Writes the worst value of each check over all points.
   subroutine list_accuracy(unit, has_contact, accuracy)
      integer, intent(in) :: unit                 !! unit number, open for formatted writing
      logical, intent(in) :: has_contact          !! false: checks of contact are omitted
      type(accuracy_t), intent(in) :: accuracy
      type(check_t), allocatable :: check(:)
      integer :: i
      check = checks_of(accuracy)
      write (unit, '(/a)') 'Accuracy: worst of all points'
      do i = 1, size(check)
         if (check(i)%of_contact .and. .not. has_contact) cycle
         if (check(i)%if_found .and. check(i)%worst%at%point == 0) cycle
         write (unit, '(a)') '   '//left(check(i)%head, 38)//right(scientific(check(i)%worst%value, 2), 9)
      end do
   end subroutine list_accuracy

   !> Reasons, in words, why the results may be wrong, except those that end a step (point_checks); '' if there are none.
   pure function failed_checks(accuracy) result(text)
      type(accuracy_t), intent(in) :: accuracy
      character(:), allocatable :: text
      text = ''
      if (allocated(accuracy%mesh_words)) call add(accuracy%mesh_words)
      if (allocated(accuracy%rounding_words)) call add(accuracy%rounding_words)
      if (allocated(accuracy%undetermined_words)) call add(accuracy%undetermined_words)

   contains

      pure subroutine add(words)
         character(*), intent(in) :: words
         if (text /= '') text = text//'; '
         text = text//words
      end subroutine add
   end function failed_checks

   !> Writes seconds and calls of every phase that occurred, and the counters that are not zero.
   subroutine list_cost(unit)
      integer, intent(in) :: unit                 !! unit number, open for formatted writing
      real(wp) :: total
      integer :: i
      total = timing_total()
      write (unit, '(/a)') left('Cost', 26)//right('seconds', 15)//right('calls', 14)
      do i = 1, n_phases
         if (timing_calls(i) > 0) write (unit, '(a)') '   '//left(phase_name(i), 23) &
            & //right(fixed(timing_seconds(i), 6), 15)//right(to_text(timing_calls(i)), 14)
      end do
      write (unit, '(a)') '   '//left('total', 23)//right(fixed(total, 6), 15)
      do i = 1, n_counters
         if (counted(i) > 0) write (unit, '(a)') '   '//left(counter_name(i), 38) &
            & //right(to_text(counted(i)), 14)
      end do
   end subroutine list_cost
end module run_summary

!> The end of the listing: accuracy and cost of the run.
module run_summary
   use kinds, only: wp
   use timing, only: timing_seconds, timing_calls, timing_total, counted, n_phases, phase_name, n_counters, &
      & counter_name
   use run_accuracy, only: accuracy_t
   use columns, only: scientific, fixed, whole, left, right
   implicit none
   private
   public :: write_accuracy, write_cost, failed_checks

contains

   !> Writes the worst values over all points.
   subroutine write_accuracy(unit, has_contact, accuracy)
      integer, intent(in) :: unit                 !! open for formatted writing
      logical, intent(in) :: has_contact          !! false: nothing is written about contact
      type(accuracy_t), intent(in) :: accuracy
      write (unit, '(/a)') 'Accuracy: worst of all points'
      call write_value('relative residual', accuracy%residual%value)
      if (has_contact) then
         call write_value('penetration / size of the structure', accuracy%penetration%value)
         call write_value('tension / largest reaction', accuracy%tension%value)
         call write_value('complementarity violation', accuracy%complementarity%value)
         call write_value('reactions and law of foundations', accuracy%foundation%value)
         call write_value('mesh: longest element / allowed', accuracy%mesh%value)
      end if
      call write_value('rounding / stiffness along the path', accuracy%rounding%value)
      if (accuracy%error_bar%at%point > 0) call write_value('error bar of a critical load / load', accuracy%error_bar%value)
      if (accuracy%rolling%at%point > 0) call write_value('roll left open / size of the structure', accuracy%rolling%value)
      call write_value('balance of forces', accuracy%force_balance%value)
      call write_value('balance of moments', accuracy%moment_balance%value)
      call write_value('balance of every node', accuracy%node_balance%value)
   contains
      subroutine write_value(name, value)
         character(*), intent(in) :: name
         real(wp), intent(in) :: value
         write (unit, '(a)') '   '//left(name, 38)//right(scientific(value, 2), 9)
      end subroutine write_value
   end subroutine write_accuracy

   !> Reasons not to trust the results, other than those that end a step (own_checks), in words; '' if there are none.
   pure function failed_checks(accuracy) result(text)
      type(accuracy_t), intent(in) :: accuracy
      character(:), allocatable :: text
      text = ''
      if (allocated(accuracy%mesh_words)) call add(accuracy%mesh_words)
      if (allocated(accuracy%rounding_words)) call add(accuracy%rounding_words)
      if (allocated(accuracy%hanging_words)) call add(accuracy%hanging_words)

   contains

      pure subroutine add(words)
         character(*), intent(in) :: words
         if (text /= '') text = text//'; '
         text = text//words
      end subroutine add
   end function failed_checks

   !> Writes seconds and calls of every phase that was used, and the counters that are not zero.
   subroutine write_cost(unit)
      integer, intent(in) :: unit                 !! open for formatted writing
      real(wp) :: total
      integer :: i
      total = timing_total()
      write (unit, '(/a)') left('Cost', 26)//right('seconds', 15)//right('calls', 14)
      do i = 1, n_phases
         if (timing_calls(i) > 0) write (unit, '(a)') '   '//left(phase_name(i), 23) &
            & //right(fixed(timing_seconds(i), 6), 15)//right(whole(timing_calls(i)), 14)
      end do
      write (unit, '(a)') '   '//left('total', 23)//right(fixed(total, 6), 15)
      do i = 1, n_counters
         if (counted(i) > 0) write (unit, '(a)') '   '//left(counter_name(i), 38) &
            & //right(whole(counted(i)), 14)
      end do
   end subroutine write_cost
end module run_summary

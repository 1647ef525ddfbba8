!> Verdict of the independent checks on one point: a point that fails is no equilibrium and is the last point of its path.
module own_checks
   use kinds, only: wp
   use text, only: to_text
   use run_accuracy, only: accuracy_t, worst_t, place_t, check_penetration, check_tension, check_complementarity, &
      & check_foundation, check_force_balance, check_moment_balance, check_node_balance
   use columns, only: scientific, brief
   implicit none
   private
   public :: failed_words

   ! Bounds of the checks, far above the values of converged points.
   real(wp), parameter :: unbalanced = 1.0e-4_wp     !! relative to the largest force
   real(wp), parameter :: misplaced = 1.0e-7_wp      !! relative to the size of the structure

contains

   !> Names of the checks that a point fails, with value and place; '' if the point passes all checks.
   pure function failed_words(here) result(text)
      type(accuracy_t), intent(in) :: here       !! worst values of that point alone
      character(:), allocatable :: text
      text = ''
      call look('balance of forces', here%worst(check_force_balance), unbalanced)
      call look('balance of moments', here%worst(check_moment_balance), unbalanced)
      call look('balance of every node', here%worst(check_node_balance), unbalanced)
      call look('penetration', here%worst(check_penetration), max(misplaced, here%asked))
      call look('tension', here%worst(check_tension), unbalanced)
      call look('complementarity', here%worst(check_complementarity), max(misplaced, here%asked))
      call look('reactions and law of foundations', here%worst(check_foundation), unbalanced)
      if (text /= '') text = 'its own checks found it wrong: '//text

   contains

      pure subroutine look(name, worst, bound)
         character(*), intent(in) :: name
         type(worst_t), intent(in) :: worst
         real(wp), intent(in) :: bound
         if (worst%value <= bound) return
         if (text /= '') text = text//'; '
         text = text//name//' '//scientific(worst%value, 2)//' '//place_in_words(worst%at)
      end subroutine look
   end function failed_words

   !> "at point 12 (load factor 1.5), node 7"
   pure function place_in_words(at) result(text)
      type(place_t), intent(in) :: at
      character(:), allocatable :: text
      text = 'at point '//to_text(at%point)
      if (at%branch > 0) text = text//' of branch '//to_text(at%branch)
      text = text//' (load factor '//brief(at%load_factor)//')'
      if (at%node > 0) text = text//', node '//to_text(at%node)
      if (at%element > 0) text = text//', element '//to_text(at%element)
   end function place_in_words
end module own_checks

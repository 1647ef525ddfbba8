!> Checks whether a run can be continued with another deck: only the cards that control how steps are followed may differ.
module restart_check
   use text, only: to_text
   use archive, only: archive_t
   use run_archive, only: exchange_model_t
   use model, only: model_t, step_t
   implicit none
   private
   public :: why_not_with

contains

   !> Message that explains why a run of deck `old` cannot be continued with deck `new`; empty if it can.
   function why_not_with(old, new) result(why)
      type(model_t), intent(in) :: old, new
      character(:), allocatable :: why
      why = ''
      if (size(old%step) /= size(new%step)) then
         why = 'the deck has '//to_text(size(new%step))//' steps, that of the results has '//to_text(size(old%step))
      else if (.not. same(structure(old), structure(new))) then
         why = 'the deck is that of another structure, or has other loads: only *STATIC, *CONTROLS, *ACCURACY, *STOP, *LOCATE, ' &
            & //'*TURNING POINTS, *FIELD OUTPUT and the ends of branches may be others'
      end if
   end function why_not_with

   !> Archive of a model without title, job name and the cards that control how steps are followed.
   function structure(model) result(a)
      type(model_t), intent(in) :: model
      type(archive_t) :: a
      type(model_t) :: bare
      type(step_t) :: nothing
      integer :: i, k
      bare = model
      if (allocated(bare%title)) deallocate (bare%title)
      if (allocated(bare%job)) deallocate (bare%job)
      do i = 1, size(bare%step)
         bare%step(i) = nothing
         bare%step(i)%load = model%step(i)%load
         bare%step(i)%branch = model%step(i)%branch
         do k = 1, size(bare%step(i)%branch)
            bare%step(i)%branch(k)%max_points = 0
            deallocate (bare%step(i)%branch(k)%stop)
         end do
         bare%step(i)%limit_curve = model%step(i)%limit_curve
         bare%step(i)%n_modes = model%step(i)%n_modes
      end do
      call exchange_model_t(a, bare)
   end function structure

   !> True if two archives have the same words.
   logical function same(a, b)
      type(archive_t), intent(in) :: a, b
      same = a%n == b%n
      if (same) same = all(a%words(:a%n) == b%words(:b%n))
   end function same
end module restart_check

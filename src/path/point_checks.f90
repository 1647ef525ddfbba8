!> What is checked at every recorded point: balance and signs, and whether mesh and numbers can carry the answer.
module point_checks
   use kinds, only: wp
   use problem, only: problem_t
   use rod_state, only: state_t
   use balance, only: measure_balance
   use mesh_adequacy, only: verdict_t, judge_mesh, verdict_words
   use run_accuracy, only: accuracy_t, place_t, note_worst
   use path_record, only: point_t
   use columns, only: whole, brief
   implicit none
   private
   public :: check_point

contains

   !> Raises the worst values by those of a point, which gets a warning where the mesh becomes too coarse.
   subroutine check_point(problem, state, at, point, accuracy)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state         !! converged
      type(place_t), intent(in) :: at            !! the point
      type(point_t), intent(inout) :: point      !! gives its residual
      type(accuracy_t), intent(inout) :: accuracy
      type(verdict_t) :: verdict
      call measure_balance(problem, state, at, point%residual, accuracy)
      call judge_mesh(problem, state, verdict)
      if (verdict%ratio > 1.0_wp .and. .not. allocated(accuracy%mesh_words)) then
         accuracy%mesh_words = verdict_words(verdict)
         point%warning = 'From here on the mesh is too coarse: '//accuracy%mesh_words//'.'
         accuracy%mesh_words = 'from point '//whole(at%point)//' (load factor '//brief(at%load_factor)//') on '// &
            & accuracy%mesh_words
      end if
      if (size(verdict%element) > 0) call note_worst(accuracy%mesh, verdict%ratio, at, element=verdict%element(1))
   end subroutine check_point
end module point_checks

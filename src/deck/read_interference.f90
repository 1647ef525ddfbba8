!> Reads *CONTACT INTERFERENCE: gaps that close in a step by a prescribed amount.
module read_interference
   use kinds, only: wp
   use model, only: model_t, load_t
   use obstacle_geometry, only: obstacle_gap
   use checked_deck, only: checked_deck_t
   implicit none
   private
   public :: note_pushed_out, read_interference_line, pushes_out

contains

   !> Notes the obstacles whose initial penetration some step pushes out: nodes may begin behind them.
   subroutine note_pushed_out(deck)
      type(checked_deck_t), intent(inout) :: deck       !! receives names%pushed_out
      integer :: i
      logical :: is_new
      do while (deck%next_card('CONTACT INTERFERENCE'))
         if (.not. deck%given('SHRINK')) cycle
         do while (deck%next_line())
            call deck%names%pushed_out%add(deck%text('obstacle'), i, is_new)
         end do
      end do
   end subroutine note_pushed_out

   !> Reads a line: obstacle, value; with SHRINK only the obstacle.
   subroutine read_interference_line(deck, model, shrunk_in, load)
      type(checked_deck_t), intent(inout) :: deck
      type(model_t), intent(in) :: model                !! with obstacles and contacts
      integer, intent(inout) :: shrunk_in(:)            !! (obstacles) line of the deck that pushes the obstacle out already, 0:
      !! none
      type(load_t), intent(inout) :: load
      integer :: obstacle
      logical :: ok
      call deck%touched_obstacle('obstacle', obstacle, ok)
      if (.not. ok) return
      if (.not. deck%given('SHRINK')) then
         load%closing(obstacle) = load%closing(obstacle) + deck%real('interference')
      else if (shrunk_in(obstacle) > 0) then
         call deck%wrong('obstacle', deck%source%line_words(shrunk_in(obstacle))//' pushes out all that penetrates already')
      else if (.not. (deck%names%contacts_incomplete .or. deck%names%mesh_incomplete .or. begins_behind(model, obstacle) .or. &
         deck%names%has_modes)) then
         call deck%wrong('obstacle', 'nothing begins behind '//trim(model%obstacle(obstacle)%name))
      else
         load%resolved(obstacle) = 1.0_wp
         if (model%step(deck%at%step)%n_modes == 0) shrunk_in(obstacle) = deck%at%line_at
      end if
   end subroutine read_interference_line

   !> True if some candidate begins behind the obstacle.
   logical function begins_behind(model, obstacle) result(behind)
      type(model_t), intent(in) :: model
      integer, intent(in) :: obstacle
      real(wp) :: gap, normal(2), bend
      integer :: c, i
      associate (at_nodes => model%obstacle(obstacle)%at_nodes)
         behind = at_nodes .and. any(model%contact%obstacle == obstacle .and. model%contact%gap < 0.0_wp)
         if (at_nodes .or. model%obstacle(obstacle)%bilateral) return
      end associate
      do c = 1, size(model%contact)
         if (model%contact(c)%obstacle /= obstacle) cycle
         do i = 1, size(model%contact(c)%node)
            call obstacle_gap(model%obstacle(obstacle), model%mesh%x(:, model%contact(c)%node(i)), gap, normal, bend)
            behind = behind .or. gap + model%contact(c)%gap < 0.0_wp
         end do
      end do
   end function begins_behind

   !> True if some step pushes out the initial penetration of the obstacle of this name.
   pure logical function pushes_out(deck, name)
      type(checked_deck_t), intent(in) :: deck          !! with names%pushed_out
      character(*), intent(in) :: name
      pushes_out = deck%names%pushed_out%find(trim(name)) > 0
   end function pushes_out
end module read_interference

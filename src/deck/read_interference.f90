!> Reads *CONTACT INTERFERENCE: gaps that close in a step by a prescribed amount.
module read_interference
   use kinds, only: wp
   use text, only: same_name
   use model, only: model_t, load_t
   use obstacle_geometry, only: obstacle_gap
   use checked_deck, only: checked_deck_t, cursor_t
   implicit none
   private
   public :: read_interference_line, pushes_out

contains

   !> Reads a line: obstacle, value; with SHRINK only the obstacle.
   subroutine read_interference_line(deck, at, model, shrunk_in, load)
      type(checked_deck_t), intent(inout) :: deck
      type(cursor_t), intent(in) :: at
      type(model_t), intent(in) :: model                !! with obstacles and contacts
      integer, intent(inout) :: shrunk_in(:)            !! (obstacles) line of the deck that pushes the obstacle out already, 0:
      !! none
      type(load_t), intent(inout) :: load
      integer :: obstacle
      logical :: ok
      call deck%touched_obstacle(at, 'obstacle', obstacle, ok)
      if (.not. ok) return
      if (.not. deck%given(at, 'SHRINK')) then
         load%closing(obstacle) = load%closing(obstacle) + deck%real(at, 'interference')
      else if (shrunk_in(obstacle) > 0) then
         call deck%wrong(at, 'obstacle', deck%source%line_words(shrunk_in(obstacle))//' pushes out all that penetrates already')
      else if (.not. (deck%names%contacts_incomplete .or. deck%names%mesh_incomplete .or. begins_behind(model, obstacle) .or. &
         has_modes(deck))) then
         call deck%wrong(at, 'obstacle', 'nothing begins behind '//trim(model%obstacle(obstacle)%name))
      else
         load%resolved(obstacle) = 1.0_wp
         if (model%step(at%step)%n_modes == 0) shrunk_in(obstacle) = at%line_at
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

   !> True if buckling modes are imperfections: the initial positions are then known only after the buckling step.
   logical function has_modes(deck)
      type(checked_deck_t), intent(in) :: deck
      type(cursor_t) :: at
      has_modes = .false.
      do while (deck%next_card(at, 'IMPERFECTION'))
         has_modes = has_modes .or. deck%word(at, 'SHAPE') == 'MODE'
      end do
   end function has_modes

   !> True if some step pushes out the initial penetration of the obstacle of this name.
   logical function pushes_out(deck, name)
      type(checked_deck_t), intent(in) :: deck
      character(*), intent(in) :: name
      type(cursor_t) :: at
      pushes_out = .false.
      do while (deck%next_card(at, 'CONTACT INTERFERENCE'))
         if (.not. deck%given(at, 'SHRINK')) cycle
         do while (deck%next_line(at))
            pushes_out = pushes_out .or. same_name(deck%text(at, 'obstacle'), name)
         end do
      end do
   end function pushes_out
end module read_interference

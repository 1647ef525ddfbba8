!> Finds the obstacle that a card names and that some contact must be able to touch.
module touched_obstacle
   use model, only: model_t
   use checked_deck, only: checked_deck_t, cursor_t
   implicit none
   private
   public :: find_touched

contains

   !> The obstacle that a value names. An error is added if it is not defined, or if no contact names it.
   subroutine find_touched(deck, at, name, model, obstacle, ok)
      type(checked_deck_t), intent(inout) :: deck
      type(cursor_t), intent(in) :: at
      character(*), intent(in) :: name      !! of the parameter or field in the card table
      type(model_t), intent(in) :: model    !! with obstacles and contacts
      integer, intent(out) :: obstacle      !! 0: not defined
      logical, intent(out) :: ok            !! true: it is defined, and a contact with it exists or may be missing for an error
      obstacle = deck%named(at, name, deck%names%obstacle, 'obstacle')
      ok = obstacle > 0
      if (ok) ok = deck%names%contacts_incomplete .or. any(model%contact%obstacle == obstacle)
      if (obstacle > 0 .and. .not. ok) call deck%wrong(at, name, 'no *CONTACT names obstacle '// &
         trim(model%obstacle(obstacle)%name))
   end subroutine find_touched
end module touched_obstacle

!> Reads *FOUNDATION LAW: piecewise linear force laws of foundations.
module read_foundation_laws
   use kinds, only: wp
   use model, only: model_t, law_t
   use checked_deck, only: checked_deck_t, cursor_t
   implicit none
   private
   public :: read_foundation_law_cards

contains

   !> Reads the laws.
   subroutine read_foundation_law_cards(deck, model)
      type(checked_deck_t), intent(inout) :: deck       !! receives the names of the laws
      type(model_t), intent(inout) :: model             !! receives law
      type(cursor_t) :: at
      type(law_t) :: law
      logical :: ok
      allocate (model%law(0))
      do while (deck%next_card(at, 'FOUNDATION LAW'))
         call deck%define(at, deck%names%law, deck%text(at, 'NAME'), ok)
         if (.not. ok) cycle
         law = law_t(penetration=[real(wp) ::], force=[real(wp) ::])
         law%name = deck%text(at, 'NAME')
         if (deck%lines_sound(at)) call read_points(deck, at, law)
         model%law = [model%law, law]
      end do
   end subroutine read_foundation_law_cards

   !> Reads the points of a law; only the first error is reported.
   subroutine read_points(deck, card, law)
      type(checked_deck_t), intent(inout) :: deck
      type(cursor_t), intent(in) :: card
      type(law_t), intent(inout) :: law
      type(cursor_t) :: at
      real(wp) :: penetration, force
      integer :: n
      at = card
      do while (deck%next_line(at))
         penetration = deck%real(at, 'penetration')
         force = deck%real(at, 'force')
         n = size(law%force)
         if (n == 0) then
            if (abs(penetration) > 0.0_wp) then
               call deck%wrong(at, 'penetration', 'the first point of a law is 0, 0')
               return
            else if (abs(force) > 0.0_wp) then
               call deck%wrong(at, 'force', 'the first point of a law is 0, 0')
               return
            end if
         else if (.not. penetration > law%penetration(n)) then
            call deck%wrong(at, 'penetration', 'penetrations must rise from line to line')
            return
         else if (n == 1 .and. .not. force > 0.0_wp) then
            call deck%wrong(at, 'force', 'the force must rise from 0 at first; for a clearance use GAP of *CONTACT')
            return
         else if (force < law%force(n)) then
            call deck%wrong(at, 'force', 'forces must not fall: a foundation that softens is not available')
            return
         end if
         law%penetration = [law%penetration, penetration]
         law%force = [law%force, force]
      end do
   end subroutine read_points
end module read_foundation_laws

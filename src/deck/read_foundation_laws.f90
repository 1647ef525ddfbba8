!> Reads *FOUNDATION LAW: piecewise linear force laws of foundations.
module read_foundation_laws
   use kinds, only: wp
   use model, only: model_t, law_t
   use diagnostics, only: diagnostics_t
   use deck_cards, only: deck_t, complain
   use card_values, only: parameter_text, parameter_place, field_real, field_place
   use deck_names, only: deck_names_t
   implicit none
   private
   public :: read_foundation_law_cards

contains

   !> Reads the laws.
   subroutine read_foundation_law_cards(deck, names, model, diagnostics)
      type(deck_t), intent(in) :: deck
      type(deck_names_t), intent(inout) :: names        !! receives the laws
      type(model_t), intent(inout) :: model             !! receives law
      type(diagnostics_t), intent(inout) :: diagnostics
      type(law_t) :: law
      integer :: card, position, first, last
      logical :: is_new
      allocate (model%law(0))
      do card = 1, deck%n_cards
         if (.not. deck%card(card)%sound .or. deck%card(card)%keyword /= 'FOUNDATION LAW') cycle
         call names%law%add(parameter_text(deck, card, 'NAME'), position, is_new)
         if (.not. is_new) then
            call complain(deck, diagnostics, card, parameter_place(deck, card, 'NAME'), 'the name is used already')
            cycle
         end if
         law = law_t()
         law%name = parameter_text(deck, card, 'NAME')
         allocate (law%penetration(0), law%force(0))
         first = deck%card(card)%first_line
         last = deck%card(card)%last_line
         if (all(deck%data_line(first:last)%sound)) call read_points(first, last)
         model%law = [model%law, law]
      end do

   contains

      !> Reads the points of a law; only the first error is reported.
      subroutine read_points(from, to)
         integer, intent(in) :: from, to
         integer :: line
         real(wp) :: penetration, force
         do line = from, to
            penetration = field_real(deck, line, 1)
            force = field_real(deck, line, 2)
            if (line == from) then
               if (abs(penetration) > 0.0_wp) then
                  call wrong(line, 1, 'the first point of a law is 0, 0')
                  return
               else if (abs(force) > 0.0_wp) then
                  call wrong(line, 2, 'the first point of a law is 0, 0')
                  return
               end if
            else if (.not. penetration > law%penetration(size(law%penetration))) then
               call wrong(line, 1, 'penetrations must rise from line to line')
               return
            else if (line == from + 1 .and. .not. force > 0.0_wp) then
               call wrong(line, 2, 'the force must rise from 0 at first; for a clearance use GAP of *CONTACT')
               return
            else if (force < law%force(size(law%force))) then
               call wrong(line, 2, 'forces must not fall: a foundation that softens is not available')
               return
            end if
            law%penetration = [law%penetration, penetration]
            law%force = [law%force, force]
         end do
      end subroutine read_points

      subroutine wrong(line, field, message)
         integer, intent(in) :: line, field
         character(*), intent(in) :: message
         call complain(deck, diagnostics, card, field_place(deck, line, field), message)
      end subroutine wrong
   end subroutine read_foundation_law_cards
end module read_foundation_laws

!> The table of all cards of a deck, with all defaults: src/deck/cards.txt.
!>
!> The checks (card_check) and the readers (card_values) use this table. A new card is entered in that file; its reader gets the
!> values by the names given there.
module card_table
   use card_spec, only: card_spec_t, table_t
   use card_rows, only: add_cards
   implicit none
   private
   public :: all_cards, cards_of

contains

   !> The whole table, in the order of the manual.
   pure function all_cards() result(table)
      type(card_spec_t), allocatable :: table(:)
      table = cards_of('')
   end function all_cards

   !> The part of the table with some cards only: a run needs few of them.
   pure function cards_of(keys) result(table)
      character(*), intent(in) :: keys !! keywords in capitals without blanks, between bars, with a bar at both ends; '': all cards
      type(card_spec_t), allocatable :: table(:)
      type(table_t) :: t
      t%wanted = keys
      call add_cards(t)
      table = t%card(:t%n)
   end function cards_of
end module card_table

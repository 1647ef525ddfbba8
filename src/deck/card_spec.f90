!> Types of the table of cards: the parameters and data lines of a card, and the rules for their checks. The table itself is the
!> module card_table, which is made from cards.txt.
module card_spec
   implicit none
   private
   public :: card_spec_t, layout_t, item_t
   public :: kind_flag, kind_word, kind_name, kind_integer, kind_real, kind_label, kind_label_or_set, kind_dof
   public :: kind_component, kind_path, kind_value, kind_distributed, kind_formula
   public :: in_model, in_step, anywhere, outside_step
   public :: any_value, positive, not_negative, not_zero, below_one, poisson, bound_words
   public :: many_lines, usual_most

   enum, bind(c)
      enumerator :: kind_flag = 1     !! a parameter without a value
      enumerator :: kind_word         !! one of the item's words
      enumerator :: kind_name         !! a letter, then letters, digits, _ - . +
      enumerator :: kind_integer
      enumerator :: kind_real
      enumerator :: kind_label        !! positive integer
      enumerator :: kind_label_or_set !! positive integer or the name of a set
      enumerator :: kind_component    !! degree of freedom of a node: 1, 2 or 6
      enumerator :: kind_dof          !! an integer from 1 to 6, or one of the words of the item
      enumerator :: kind_path         !! name of a file
      enumerator :: kind_value        !! name = number, formula or text in quotes
      enumerator :: kind_distributed  !! a number or the name of a *DISTRIBUTION
      enumerator :: kind_formula      !! a formula without commas
   end enum

   enum, bind(c)
      enumerator :: in_model = 1 !! before the first *STEP
      enumerator :: in_step      !! between *STEP and *END STEP
      enumerator :: anywhere     !! inside or outside a step
      enumerator :: outside_step !! not inside a step, but perhaps after one
   end enum

   enum, bind(c)
      enumerator :: any_value = 0, positive, not_negative, not_zero
      enumerator :: below_one !! positive and below 1
      enumerator :: poisson   !! Poisson's ratio
   end enum

   !> Descriptions of the bounds for messages.
   character(*), parameter :: bound_words(0:*) = [character(26) :: '', 'positive', 'zero or positive', 'other than zero', &
      'positive and below 1', 'above -1 and at most 0.5']

   integer, parameter :: many_lines = huge(1)
   integer, parameter :: usual_most = 1000000000 !! largest magnitude of an integer by default; twice this number is still an
   !! integer

   !> A parameter, or a field of a data line. Make_cards.py knows the lengths of the texts of this type and the following ones.
   type :: item_t
      character(24) :: name    !! name of a parameter in the deck; name of a field in the manual
      integer :: kind
      logical :: required !! true: the item must be given; if `only` is set, it must be given if that condition is satisfied
      character(24) :: default !! default value as text; '': none
      character(160) :: words  !! accepted words between bars
      character(80) :: only    !! condition under which the item is allowed, such as 'TYPE=CIRCLE'; '': always
      integer :: bound
      integer :: most          !! largest magnitude of an integer
      integer :: times_field !! number of the field whose value is multiplied by the default; 0: the default itself is the value
   end type item_t

   !> The data lines of a card, or of one variant of the card.
   type :: layout_t
      character(80) :: when !! condition under which the layout applies: 'SECTION=RECT', 'GENERATE' (flag given), or '': always
      integer :: least, most   !! smallest and largest number of data lines
      logical :: last_repeats  !! true: the last field may be given any number of times
      integer :: first, last   !! first and last of the fields in the items of the table
      character(160) :: names  !! names of the fields, between bars
   end type layout_t

   !> Entry of one card in the table of cards.
   type :: card_spec_t
      character(24) :: keyword !! keyword without the star, with single blanks
      character(24) :: key     !! keyword in capitals without blanks
      integer :: where
      logical :: once          !! true: the card is allowed once in the model part, or once in each step
      logical :: free_text     !! true: data lines are not split into fields, and the layout serves the manual only
      character(24) :: follows !! keyword of the card that must precede this card, with only cards of this kind in between; '': none
      integer :: first, last   !! first and last of the parameters in the items of the table
      integer :: first_layout, last_layout !! first and last of the layouts in the table; the first one whose condition is satisfied
      !! applies; none: no data lines
      character(160) :: names  !! names of the parameters, between bars
   end type card_spec_t

end module card_spec

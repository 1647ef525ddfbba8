!> Prints the reference of all cards from their table, as Markdown.
module card_manual
   use text, only: to_text, separated
   use card_spec, only: card_spec_t, layout_t, item_t, in_model, in_step, any_value, not_zero, kind_flag, kind_word, &
      kind_dof, kind_value, kind_names, bound_signs, usual_most, names_of
   use card_table, only: all_cards
   implicit none
   private
   public :: write_card_manual, write_card

   !> Parts of the deck, in the order of card_spec.
   character(*), parameter :: places(*) = [character(23) :: 'Model part', 'In a step', 'Model part or in a step', &
      'After the model part']

contains

   !> Writes the reference: an index, then one section for each card.
   subroutine write_card_manual(unit)
      integer, intent(in) :: unit !! connected for formatted writing
      type(card_spec_t), allocatable :: table(:)
      integer :: i
      table = all_cards()
      write (unit, '(a)') 'Cards:'
      do i = 1, size(table)
         write (unit, '(a)') '[`*'//table(i)%keyword//'`](#'//anchor(table(i)%keyword)//')'//merge('.', ',', &
            i == size(table))
      end do
      do i = 1, size(table)
         call write_card(unit, table(i))
      end do
   end subroutine write_card_manual

   !> Writes the section of one card.
   subroutine write_card(unit, card)
      integer, intent(in) :: unit !! connected for formatted writing
      type(card_spec_t), intent(in) :: card
      integer :: i
      write (unit, '(a)') '', '### `*'//card%keyword//'`', ''
      write (unit, '(a)') card%meaning//' *'//place_text()//'*'
      if (size(card%parameter) > 0) then
         write (unit, '(a)') '', '| parameter | value | default | meaning |', '|---|---|---|---|'
         do i = 1, size(card%parameter)
            call write_parameter(card%parameter(i))
         end do
      end if
      if (size(card%layout) == 0) write (unit, '(a)') '', 'No data lines.'
      do i = 1, size(card%layout)
         if (size(card%layout(i)%field) > 0) call write_layout(card%layout(i))
         if (size(card%layout(i)%field) == 0) write (unit, '(a)') '', 'Data lines: free text.'
      end do

   contains

      !> Part of the deck in which the card may be used, and how often.
      pure function place_text() result(string)
         character(:), allocatable :: string
         string = trim(places(card%where))
         if (card%follows /= '') string = string//', below `*'//card%follows//'`'
         if (card%once .and. card%where == in_step) string = string//', once in each'
         if (card%once .and. card%where == in_model) string = string//', once'
         string = string//'.'
      end function place_text

      subroutine write_parameter(item)
         type(item_t), intent(in) :: item
         character(:), allocatable :: name, default, meaning
         name = '`'//item%name//'`'
         if (item%required .and. item%only == '') name = '**'//name//'**'
         default = item%default
         if (default == '' .and. item%required) default = 'required'
         meaning = item%meaning
         if (item%only /= '') meaning = meaning//'; with '//alternatives(item%only)//' only'
         write (unit, '(a)') '| '//name//' | '//kind_text(item)//' | '//default//' | '//meaning//' |'
      end subroutine write_parameter

      subroutine write_layout(layout)
         type(layout_t), intent(in) :: layout
         logical :: many ! true: the card has further layouts
         character(:), allocatable :: string, default
         integer :: i
         many = size(card%layout) > 1
         string = 'Data lines'
         if (layout%most == 1) string = 'One data line'
         if (many .and. layout%when /= '') string = string//' with '//alternatives(layout%when)
         if (many .and. layout%when == '') string = string//' otherwise'
         if (layout%least == 0) string = string//', which may be left out'
         string = string//': `'//separated(names_of(layout%field), ', ')
         if (layout%last_repeats) string = string//', ...'
         write (unit, '(a)') '', string//'`', '', '| field | value | unit | default | meaning |', '|---|---|---|---|---|'
         do i = 1, size(layout%field)
            associate (item => layout%field(i))
               default = item%default
               if (item%required) default = 'required'
               if (item%times_field > 0) default = default//' times the size of '//layout%field(item%times_field)%name
               write (unit, '(a)') '| '//item%name//' | '//kind_text(item)//' | '//item%unit//' | '//default//' | '// &
                  item%meaning//' |'
            end associate
         end do
      end subroutine write_layout
   end subroutine write_card

   !> Permitted values.
   pure function kind_text(item) result(string)
      type(item_t), intent(in) :: item
      character(:), allocatable :: string
      select case (item%kind)
      case (kind_flag)
         string = '(flag)'
      case (kind_word)
         string = alternatives(item%words)
      case (kind_value)
         string = 'name, and a number, a formula or "text"'
      case (kind_dof)
         string = '1 to 6, or '//alternatives(item%words)
      case default
         string = trim(kind_names(item%kind))
      end select
      if (item%bound == not_zero) string = string//','
      if (item%bound /= any_value) string = string//' '//trim(bound_signs(item%bound))
      if (item%most < usual_most) string = string//', at most '//to_text(item%most)
   end function kind_text

   !> Words, or a condition, of the table, in the type of code; the bars between them would end a cell of the Markdown table.
   pure function alternatives(words) result(string)
      character(*), intent(in) :: words
      character(:), allocatable :: string
      string = '`'//separated(words, '`, `')//'`'
   end function alternatives

   !> Anchor that Markdown renderers give to a card's heading.
   pure function anchor(keyword) result(string)
      character(*), intent(in) :: keyword
      character(:), allocatable :: string
      integer :: i
      string = keyword
      do i = 1, len(string)
         if (string(i:i) == ' ') string(i:i) = '-'
         if (string(i:i) >= 'A' .and. string(i:i) <= 'Z') string(i:i) = achar(iachar(string(i:i)) + 32)
      end do
   end function anchor
end module card_manual

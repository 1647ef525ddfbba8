!> Prints the table of all cards as JSON, for programs that write decks: `unilat --cards=json`.
module card_json
   use text, only: separated, to_text
   use card_spec, only: card_spec_t, layout_t, item_t, many_lines, kind_names, part_names, bound_signs
   use card_table, only: all_cards
   implicit none
   private
   public :: write_card_json, quoted

contains

   !> Writes one object: the version of the program, and the cards in the order of the manual.
   subroutine write_card_json(unit, version)
      integer, intent(in) :: unit          !! connected for formatted writing
      character(*), intent(in) :: version  !! of the program
      type(card_spec_t), allocatable :: table(:)
      integer :: i
      table = all_cards()
      write (unit, '(a)') '{"version": '//quoted(version)//', "cards": ['
      do i = 1, size(table)
         write (unit, '(a)') card_object(table(i))//trim(merge('  ', ', ', i == size(table)))
      end do
      write (unit, '(a)') ']}'
   end subroutine write_card_json

   function card_object(card) result(string)
      type(card_spec_t), intent(in) :: card
      character(:), allocatable :: string
      integer :: i
      string = '{"keyword": '//quoted(card%keyword)//', "where": '//quoted(trim(part_names(card%where)))// &
         & ', "once": '//truth(card%once)//', "free_text": '//truth(card%free_text)//', "follows": '//quoted(card%follows)// &
         & ', "meaning": '//quoted(card%meaning)//', "parameters": '//item_list(card%parameter)//', "lines": ['
      do i = 1, size(card%layout)
         if (i > 1) string = string//', '
         string = string//layout_object(card%layout(i))
      end do
      string = string//']}'
   end function card_object

   !> One form of the data lines of a card. The first form whose condition is satisfied applies. Without "most" the number of lines
   !> is not limited.
   function layout_object(layout) result(string)
      type(layout_t), intent(in) :: layout
      character(:), allocatable :: string
      string = '{"when": '//quoted(layout%when)//', "least": '//to_text(layout%least)//', "last_repeats": '// &
         & truth(layout%last_repeats)
      if (layout%most /= many_lines) string = string//', "most": '//to_text(layout%most)
      string = string//', "fields": '//item_list(layout%field)//'}'
   end function layout_object

   !> Parameters or fields as a list of JSON objects.
   function item_list(items) result(string)
      type(item_t), intent(in) :: items(:)
      character(:), allocatable :: string
      integer :: i
      string = '['
      do i = 1, size(items)
         if (i > 1) string = string//', '
         associate (item => items(i))
            string = string//'{"name": '//quoted(item%name)//', "kind": '//quoted(trim(kind_names(item%kind)))// &
               & ', "required": '//truth(item%required)//', "default": '//quoted(item%default)//', "only": '//quoted(item%only)// &
               & ', "bound": '//quoted(trim(bound_signs(item%bound)))//', "unit": '//quoted(item%unit)// &
               & ', "meaning": '//quoted(item%meaning)//', "words": ['
            if (item%words /= '') string = string//'"'//separated(item%words, '", "')//'"'
            string = string//']}'
         end associate
      end do
      string = string//']'
   end function item_list

   pure function truth(value) result(string)
      logical, intent(in) :: value
      character(:), allocatable :: string
      string = trim(merge('true ', 'false', value))
   end function truth

   !> A text as a JSON string.
   pure function quoted(text) result(string)
      character(*), intent(in) :: text
      character(:), allocatable :: string
      integer :: i
      string = '"'
      do i = 1, len(text)
         if (text(i:i) == '"' .or. text(i:i) == achar(92)) string = string//achar(92)
         string = string//text(i:i)
      end do
      string = string//'"'
   end function quoted
end module card_json

!> Help on one word: a card, an option, a parameter or word of a card, or a word of the decks of other programs.
module help_topics
   use text, only: squeeze, nearest_word, word_index
   use errors, only: error_t, fail
   use printable_text, only: quoted
   use command_line, only: help_text
   use card_spec, only: card_spec_t, item_t, find_card
   use card_table, only: all_cards, write_card, foreign_answer
   use card_check, only: known_card
   implicit none
   private
   public :: write_card_help, write_help

contains

   !> Writes the reference of one card.
   subroutine write_card_help(unit, topic, error)
      integer, intent(in) :: unit                      !! unit connected for formatted writing
      character(*), intent(in) :: topic                !! keyword of the card; star, case and blanks do not matter
      type(error_t), allocatable, intent(out) :: error !! there is no such card; the message suggests a similar one
      type(card_spec_t), allocatable :: table(:)
      integer :: i
      table = all_cards()
      i = find_card(table, without_star(topic))
      if (i == 0) then
         call fail(error, 'no card *'//quoted(without_star(topic))//known_card(table, without_star(topic)))
      else
         call write_card(unit, table(i)%keyword)
      end if
   end subroutine write_card_help

   !> Writes all help about a word.
   subroutine write_help(unit, topic, error)
      integer, intent(in) :: unit                      !! unit connected for formatted writing
      character(*), intent(in) :: topic                !! the word; case and blanks do not matter
      type(error_t), allocatable, intent(out) :: error !! the word is unknown; the message suggests a similar one
      type(card_spec_t), allocatable :: table(:)
      character(:), allocatable :: words, near
      integer :: i, k
      logical :: found
      table = all_cards()
      found = .false.
      call write_option()
      if (found) return
      i = find_card(table, without_star(topic))
      if (i > 0) then
         call write_card(unit, table(i)%keyword)
         found = .true.
      end if
      ! Help on parameters and fields, and on the words that are their values. `words` collects these names for a suggestion.
      words = ''
      do i = 1, size(table)
         words = words//'|*'//table(i)%keyword
         call write_items(table(i)%parameter, '*'//table(i)%keyword//', ', .true.)
         do k = 1, size(table(i)%layout)
            call write_items(table(i)%layout(k)%field, '*'//table(i)%keyword//', field ', .false.)
         end do
      end do
      if (.not. found) call write_foreign()
      if (found) return
      near = nearest_word(words(2:), topic)
      if (near /= '') then
         call fail(error, 'nothing is known of '//quoted(topic)//'; did you mean '//near//'?')
      else
         call fail(error, 'nothing is known of '//quoted(topic)//'; unilat --help lists the options, unilat --cards the cards')
      end if

   contains

      !> Writes a line about each parameter or field whose name or value is the topic.
      subroutine write_items(items, place, named)
         type(item_t), intent(in) :: items(:)
         character(*), intent(in) :: place ! words before the name of the item
         logical, intent(in) :: named      ! true: the name of the item is compared as well
         integer :: f
         do f = 1, size(items)
            associate (item => items(f))
               if (named) words = words//'|'//item%name
               words = words//'|'//item%words
               if (word_index(item%words, topic) > 0 .or. (named .and. squeeze(item%name) == squeeze(topic))) then
                  write (unit, '(a)') place//item%name//': '//item%meaning
                  found = .true.
               end if
            end associate
         end do
      end subroutine write_items

      !> Writes the lines about an option from the help text.
      subroutine write_option()
         character(:), allocatable :: all, line
         integer :: first, length
         logical :: inside
         all = help_text()
         inside = .false.
         first = 1
         do while (first <= len(all))
            length = index(all(first:), new_line('a')) - 1
            line = all(first:first + length - 1)
            first = first + length + 1
            if (index(line, '  -') == 1) then
               inside = any(option_name(line) == [character(12) :: topic, '-'//topic, '--'//topic])
            else if (index(line, '      ') /= 1) then
               inside = .false.
            end if
            if (inside) write (unit, '(a)') line
            found = found .or. inside
         end do
      end subroutine write_option

      !> Writes the equivalents of a word of other programs, for all places in which those programs use the word.
      subroutine write_foreign()
         character(8), parameter :: places(8) = [character(8) :: 'TYPE', 'METHOD', 'SECTION', 'POINTS', 'field', 'quantity', &
            'type', 'dof']
         character(:), allocatable :: answer
         integer :: i
         call answer_with('*'//without_star(topic), foreign_answer('card', '', without_star(topic)))
         answer = foreign_answer('parameter', '', topic) ! 'P': parameter of any card
         call answer_with(topic, answer)
         if (answer == '') then
            do i = 1, size(table)
               call answer_with('*'//table(i)%keyword//', '//topic, foreign_answer('parameter', table(i)%keyword, topic))
            end do
         end if
         do i = 1, size(places)
            call answer_with(trim(places(i))//' '//topic, foreign_answer('value', trim(places(i)), topic))
         end do
      end subroutine write_foreign

      !> Writes the answer for one place; nothing if the answer is ''.
      subroutine answer_with(what, answer)
         character(*), intent(in) :: what, answer
         if (answer == '') return
         write (unit, '(a)') what//': '//answer(3:)
         found = .true.
      end subroutine answer_with
   end subroutine write_help

   !> Name of the option with which a line of the help text begins.
   pure function option_name(line) result(name)
      character(*), intent(in) :: line
      character(:), allocatable :: name
      name = line(3:)
      if (index(name, ' ') > 0) name = name(:index(name, ' ') - 1)
   end function option_name

   !> Removes the star of a keyword.
   pure function without_star(topic) result(keyword)
      character(*), intent(in) :: topic
      character(:), allocatable :: keyword
      keyword = trim(adjustl(topic))
      if (index(keyword, '*') == 1) keyword = trim(adjustl(keyword(2:)))
   end function without_star
end module help_topics

!> Help on one word: a card, an option, a parameter or word of a card, or a word of the decks of other programs.
module help_topics
   use text, only: nearest_word
   use errors, only: error_t, fail
   use printable_text, only: quoted
   use command_line, only: help_text
   use card_table, only: find_card, cards, topic_names, write_card, write_topic
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
      integer :: card
      card = find_card(without_star(topic))
      if (card > 0) call write_card(unit, cards(card)%keyword)
      if (card == 0) call fail(error, 'no card *'//quoted(without_star(topic))//known_card(without_star(topic)))
   end subroutine write_card_help

   !> Writes all help about a word.
   subroutine write_help(unit, topic, error)
      integer, intent(in) :: unit                      !! unit connected for formatted writing
      character(*), intent(in) :: topic                !! the word; case and blanks do not matter
      type(error_t), allocatable, intent(out) :: error !! the word is unknown; the message suggests a similar one
      character(:), allocatable :: near
      integer :: card
      logical :: found
      call write_option(unit, topic, found)
      if (found) return
      card = find_card(without_star(topic))
      found = card > 0
      if (found) call write_card(unit, cards(card)%keyword)
      call write_topic(unit, topic, .false., found)
      if (.not. found) call write_topic(unit, without_star(topic), .true., found)
      if (found) return
      near = nearest_word(topic_names, topic)
      if (near /= '') near = 'did you mean '//near//'?'
      if (near == '') near = 'unilat --help lists the options, unilat --cards the cards'
      call fail(error, 'nothing is known of '//quoted(topic)//'; '//near)
   end subroutine write_help

   !> Writes the lines about an option from the help text.
   subroutine write_option(unit, topic, found)
      integer, intent(in) :: unit
      character(*), intent(in) :: topic
      logical, intent(out) :: found                    ! true: the topic is an option
      character(:), allocatable :: all, line
      integer :: first, length
      logical :: inside
      all = help_text()
      found = .false.
      inside = .false.
      first = 1
      do while (first <= len(all))
         length = index(all(first:), new_line('a')) - 1
         line = all(first:first + length - 1)
         first = first + length + 1
         if (index(line, '  -') == 1) then
            inside = any(line(3:index(line(3:)//' ', ' ') + 1) == [character(12) :: topic, '-'//topic, '--'//topic])
         else if (index(line, '      ') /= 1) then
            inside = .false.
         end if
         if (inside) write (unit, '(a)') line
         found = found .or. inside
      end do
   end subroutine write_option

   !> Removes the star of a keyword.
   pure function without_star(topic) result(keyword)
      character(*), intent(in) :: topic
      character(:), allocatable :: keyword
      keyword = trim(adjustl(topic))
      if (index(keyword, '*') == 1) keyword = trim(adjustl(keyword(2:)))
   end function without_star
end module help_topics

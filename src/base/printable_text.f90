!> Text of a deck for messages and listings: control characters are replaced, and long texts are shortened.
!>
!> A terminal executes control characters: a deck from another person must not change colours, cursor or window title of the
!> terminal that shows a message about the deck.
module printable_text
   implicit none
   private
   public :: printable, printable_lines, shortened, quoted, quoted_path, character_end, inside_character, &
      & control_place, control_words

   integer, parameter :: longest_quote = 80 !! longest quotation of a field in a message [bytes]: the longest name
   integer, parameter :: longest_path = 300 !! longest file name in a message [bytes]
   character(*), parameter :: picture = char(226)//char(144) !! first two of the three bytes of the characters U+2400 to U+243F
   character(*), parameter :: no_text = char(239)//char(191)//char(189) !! character U+FFFD, which replaces bytes that are not UTF-8

contains

   !> Text in which every control character except the tab is replaced by its picture (U+2400 and following). Every byte that is not
   !> UTF-8, and every control character U+0080 to U+009F, is replaced by U+FFFD. The number of characters is unchanged.
   pure function printable(string) result(shown)
      character(*), intent(in) :: string !! text of any bytes
      character(:), allocatable :: shown
      integer :: i, n, length
      shown = string
      if (verify(string, plain()) == 0) return
      deallocate (shown)
      allocate (character(3 * len(string)) :: shown)
      n = 0
      i = 1
      do while (i <= len(string))
         length = character_length(string(i:min(i + 3, len(string))))
         if (length == 0) then
            call put(shown, n, no_text)
            length = 1
         else if (is_control(string(i:i))) then
            call put(shown, n, picture//char(128 + merge(33, iachar(string(i:i)), iachar(string(i:i)) == 127)))
         else
            call put(shown, n, string(i:i + length - 1))
         end if
         i = i + length
      end do
      shown = shown(:n)
   end function printable

   !> Printable form of a text that has several lines: line feeds are kept.
   pure function printable_lines(string) result(shown)
      character(*), intent(in) :: string !! text of any bytes
      character(:), allocatable :: shown, line
      integer :: first, length, n
      allocate (character(3 * len(string)) :: shown)
      n = 0
      first = 1
      do while (first <= len(string))
         length = index(string(first:), achar(10)) - 1
         if (length < 0) length = len(string) - first + 1
         line = printable(string(first:first + length - 1))
         call put(shown, n, line)
         first = first + length + 1
         if (first <= len(string) + 1) call put(shown, n, achar(10))
      end do
      shown = shown(:n)
   end function printable_lines

   !> Appends a piece to a text, which must be long enough for it.
   pure subroutine put(text, n, piece)
      character(*), intent(inout) :: text
      integer, intent(inout) :: n          !! number of bytes of the text so far
      character(*), intent(in) :: piece
      text(n + 1:n + len(piece)) = piece
      n = n + len(piece)
   end subroutine put

   !> Text shortened to at most a given number of bytes, between characters; its middle is replaced by " ... ".
   pure function shortened(string, most) result(short)
      character(*), intent(in) :: string
      integer, intent(in) :: most        !! largest length [bytes], 20 or more
      character(:), allocatable :: short
      integer :: first, last
      short = string
      if (len(string) <= most) return
      first = character_end(string, 3 * (most - 5) / 4)
      last = character_end(string, len(string) - (most - 5 - first)) + 1
      short = string(:first)//' ... '//string(last:)
   end function shortened

   !> Quotation from a deck in a message: the text, or the first characters of a long text and its number of bytes.
   pure function quoted(string) result(quote)
      character(*), intent(in) :: string
      character(:), allocatable :: quote
      character(12) :: number
      integer :: first
      if (len(string) <= longest_quote) then
         quote = printable(string)
         return
      end if
      first = character_end(string, longest_quote - 20)
      write (number, '(i0)') len(string)
      quote = printable(string(:first))//'... ('//trim(number)//' characters)'
   end function quoted

   !> File name in a message; of a long one the beginning and the end.
   pure function quoted_path(path) result(quote)
      character(*), intent(in) :: path
      character(:), allocatable :: quote
      quote = printable(shortened(path, longest_path))
   end function quoted_path

   !> Position of the last byte of the character to which a given byte belongs.
   pure integer function character_end(string, place) result(last)
      character(*), intent(in) :: string
      integer, intent(in) :: place       !! position of the byte
      integer :: i
      last = place
      do i = 1, 3                        ! a character has at most four bytes
         if (last == len(string)) return
         if (.not. inside_character(string(last + 1:last + 1))) return
         last = last + 1
      end do
   end function character_end

   !> Position of the first control character other than the tab; 0: none.
   pure integer function control_place(string) result(place)
      character(*), intent(in) :: string
      do place = 1, len(string)
         if (is_control(string(place:place))) return
         if (place == len(string)) exit
         if (iachar(string(place:place)) == 194 .and. iachar(string(place + 1:place + 1)) >= 128 .and. &
            iachar(string(place + 1:place + 1)) < 160) return
      end do
      place = 0
   end function control_place

   !> Name of a control character in words: "a line feed".
   pure function control_words(letter) result(words)
      character(1), intent(in) :: letter !! a control character
      character(:), allocatable :: words
      character(3) :: number
      select case (iachar(letter))
      case (0)
         words = 'a null character'
      case (10)
         words = 'a line feed'
      case (13)
         words = 'a carriage return'
      case (27)
         words = 'an escape character'
      case default
         write (number, '(i0)') iachar(letter)
         words = 'the control character number '//trim(number)
      end select
   end function control_words

   !> Number of bytes of the UTF-8 character at the beginning of a text; 0: it is not UTF-8, or a control character U+0080 to
   !> U+009F.
   pure integer function character_length(bytes) result(length)
      character(*), intent(in) :: bytes !! 1 to 4 bytes
      integer :: i
      select case (iachar(bytes(1:1)))
      case (0:127)
         length = 1
      case (194:223)
         length = 2
      case (224:239)
         length = 3
      case (240:244)
         length = 4
      case default
         length = 0
      end select
      if (length > len(bytes)) length = 0
      do i = 2, length
         if (.not. inside_character(bytes(i:i))) length = 0
      end do
      if (length == 2 .and. iachar(bytes(1:1)) == 194 .and. iachar(bytes(2:2)) < 160) length = 0
   end function character_length

   !> True for the second and further bytes of a UTF-8 character.
   pure logical function inside_character(byte)
      character(1), intent(in) :: byte
      inside_character = iand(iachar(byte), 192) == 128
   end function inside_character

   !> True for ASCII control characters except the tab.
   pure logical function is_control(letter)
      character(1), intent(in) :: letter
      is_control = (iachar(letter) < 32 .or. iachar(letter) == 127) .and. letter /= achar(9)
   end function is_control

   !> Characters that need no replacement; most texts consist of these.
   pure function plain() result(letters)
      character(96) :: letters
      integer :: i
      do i = 32, 126
         letters(i - 31:i - 31) = achar(i)
      end do
      letters(96:96) = achar(9)
   end function plain
end module printable_text

!> The text of a deck, read completely from a file or a pipe. It is kept, because messages quote it and the result file stores it.
!>
!> The text may differ from the typed text: *INCLUDE is replaced by the included decks, ${...} by values. The origin of each line is
!> stored.
module deck_source
   use kinds, only: wp
   use errors, only: error_t, fail
   use text, only: to_text, blanks
   use printable_text, only: quoted_path, shortened
   use posix_files, only: look_at, kind_folder, kind_pipe
   use, intrinsic :: iso_c_binding, only: c_null_char
   implicit none
   private
   public :: growing_text_t, deck_source_t, deck_file_t, deck_parameter_t, typed_line_t, spot_t, read_source_file, &
      & read_source_unit, source_from_text, most_lines, first_letter

   !> A text that grows by the lines appended to it.
   type :: growing_text_t
      character(:), allocatable :: text !! the text in the first n characters; the rest is unused; not allocated: no text
      integer :: n = 0
   contains
      procedure :: add => add_text
   end type growing_text_t

   !> A file that contributes lines to a deck.
   type :: deck_file_t
      character(:), allocatable :: name             !! name of the file in messages
      integer :: included_by = 0                    !! index of the file that includes it; 0: it is the deck itself
   end type deck_file_t

   !> A parameter ${...} in a typed line, and the value that replaces it.
   type :: spot_t
      integer :: typed(2) = 0                       !! first and last column of ${...} in the typed line
      integer :: read(2) = 0                        !! first and last column of the value in the line that is read
   end type spot_t

   !> A line that differs from the typed line, because values have replaced parameters ${...}.
   type :: typed_line_t
      integer :: line = 0                           !! number of the line
      character(:), allocatable :: text             !! the line as typed
      type(spot_t), allocatable :: spot(:)          !! the parameters in the line, from left to right
   end type typed_line_t

   !> A parameter with its value.
   type :: deck_parameter_t
      character(:), allocatable :: name             !! name as typed where it was first used
      character(:), allocatable :: value            !! text that replaces ${name}
      logical :: is_number = .true.                 !! true: the value is a number; false: it is a text
      real(wp) :: number = 0.0_wp                   !! the value as a number; 0 for a text
      logical :: was_set = .false.                  !! true: the value was set on the command line
      logical :: in_deck = .false.                  !! true: the parameter is defined by *PARAMETER, or used in a ${...}
      integer :: line = 0                           !! line of its definition by *PARAMETER; 0: none
   contains
      procedure :: definition
   end type deck_parameter_t

   !> Text of a deck and positions of its lines.
   type :: deck_source_t
      character(:), allocatable :: name             !! name of the deck's file in messages
      character(:), allocatable :: text             !! all lines, each ended by a newline
      integer :: n_lines = 0
      integer, allocatable :: first(:), last(:)     !! positions in `text` of the first and last character of each line
      type(deck_file_t), allocatable :: file(:)     !! the deck's file, and the included files
      integer, allocatable :: origin(:, :) !! (2, n_lines) index of the file from which each line comes; number of the line in this
      !! file
      type(typed_line_t), allocatable :: typed(:)   !! the lines in which values have replaced parameters, in their order
      type(deck_parameter_t), allocatable :: parameter(:)
      character(:), allocatable :: expanded         !! the deck as typed, with the included decks inserted
      character(:), allocatable :: record !! the expanded deck with the parameters set on the command line, from which the run can
      !! be repeated
   contains
      procedure :: line => source_line
      procedure :: line_words, as_typed
   end type deck_source_t

   integer, parameter :: most_lines = 10000000      !! largest number of lines of a deck with all included decks
   integer, parameter :: longest_line = 10000000    !! [bytes] longest line
   integer, parameter :: longest_text = 500000000   !! [bytes] longest text of a file
   character(*), parameter :: newline = achar(10), carriage_return = achar(13)
   character(*), parameter :: byte_order_mark = char(239)//char(187)//char(191)
   integer, parameter :: chunk = 256 !! number of characters requested in one read; the runtime pads the rest of the buffer with
   !! blanks in each read

contains

   !> Reads a file.
   subroutine read_source_file(path, source, error)
      character(*), intent(in) :: path                !! name of the file, also used in messages
      type(deck_source_t), intent(out) :: source      !! empty text on failure
      type(error_t), allocatable, intent(out) :: error !! the file is missing, cannot be read, or is not a plain file; or an error
      !! of read_source_unit
      integer :: unit, status
      character(200) :: reason
      call source_from_text('', path, source)
      call check_file(path, error)
      if (allocated(error)) return
      open (newunit=unit, file=path, status='old', action='read', iostat=status, iomsg=reason)
      if (status /= 0) then
         call fail(error, 'cannot open the deck '//quoted_path(path)//': '//shortened(trim(reason), 120))
         return
      end if
      call read_source_unit(unit, path, source, error)
      close (unit, iostat=status)
   end subroutine read_source_file

   !> Reads all remaining lines of a formatted sequential unit (such as input_unit).
   subroutine read_source_unit(unit, name, source, error)
      integer, intent(in) :: unit                      !! unit connected for formatted reading
      character(*), intent(in) :: name                 !! name of the deck in messages
      type(deck_source_t), intent(out) :: source       !! empty text on failure
      type(error_t), allocatable, intent(out) :: error !! reading failed, or the text is too long
      type(growing_text_t) :: read
      character(chunk) :: buffer
      integer :: status, n, line, lines
      character(200) :: reason
      character(:), allocatable :: why ! reason why the text cannot be read; '': none
      call source_from_text('', name, source)
      call read%add('')
      why = ''
      line = 0      ! position in the text before the present line
      lines = 0
      do while (why == '')
         read (unit, '(a)', advance='no', size=n, iostat=status, iomsg=reason) buffer
         if (is_iostat_end(status)) exit
         if (status /= 0 .and. .not. is_iostat_eor(status)) then
            why = shortened(trim(reason), 120)
            exit
         end if
         call read%add(buffer(:n))
         if (read%n - line > longest_line) then
            why = 'line '//to_text(lines + 1)//' has more than '//to_text(longest_line)//' characters; is that a deck?'
         else if (read%n > longest_text) then
            why = 'it has more than '//to_text(longest_text)//' characters'
         else if (is_iostat_eor(status)) then
            call read%add(newline)
            line = read%n
            lines = lines + 1
            if (lines > most_lines) why = 'it has more than '//to_text(most_lines)//' lines'
         end if
      end do
      if (why == '') call source_from_text(read%text(:read%n), name, source)
      if (why /= '') call fail(error, 'cannot read the deck '//quoted_path(name)//': '//why)
   end subroutine read_source_unit

   !> Determines the lines of a text.
   pure subroutine source_from_text(text, name, source)
      character(*), intent(in) :: text           !! lines ended by newlines; a carriage return before a newline is dropped
      character(*), intent(in) :: name           !! name of the deck in messages
      type(deck_source_t), intent(out) :: source !! text without byte order mark, every line ended by a newline
      integer :: i, length, first, number
      source%name = name
      allocate (character(len(text) + 1) :: source%text)
      first = 1
      if (index(text, byte_order_mark) == 1) first = len(byte_order_mark) + 1
      length = 0
      do i = first, len(text)
         if (text(i:i) == newline .and. length > 0) then
            if (source%text(length:length) == carriage_return) length = length - 1
         end if
         length = length + 1
         source%text(length:length) = text(i:i)
         if (text(i:i) == newline) source%n_lines = source%n_lines + 1
      end do
      if (length > 0) then
         if (source%text(length:length) /= newline) then
            length = length + 1
            source%text(length:length) = newline
            source%n_lines = source%n_lines + 1
         end if
      end if
      source%text = source%text(:length)
      allocate (source%first(source%n_lines), source%last(source%n_lines))
      first = 1
      number = 0
      do i = 1, length
         if (source%text(i:i) /= newline) cycle
         number = number + 1
         source%first(number) = first
         source%last(number) = i - 1
         first = i + 1
      end do
      allocate (source%file(1), source%typed(0), source%parameter(0), source%origin(2, source%n_lines))
      source%file(1)%name = name
      source%origin(1, :) = 1
      source%origin(2, :) = [(i, i=1, source%n_lines)]
      source%expanded = source%text
      source%record = source%text
   end subroutine source_from_text

   !> One line without its newline; '' if there is no such line.
   pure function source_line(self, number) result(line)
      class(deck_source_t), intent(in) :: self
      integer, intent(in) :: number !! number of the line, from 1
      character(:), allocatable :: line
      line = ''
      if (number >= 1 .and. number <= self%n_lines) line = self%text(self%first(number):self%last(number))
   end function source_line

   !> Column of the first character of a line that is not blank; 0 for blank lines and for comments (lines that begin with **).
   pure integer function first_letter(line)
      character(*), intent(in) :: line
      first_letter = verify(line, blanks)
      if (first_letter == 0) return
      if (index(line(first_letter:min(first_letter + 1, len(line))), '**') == 1) first_letter = 0
   end function first_letter

   !> Line of a *PARAMETER card that would define this parameter.
   pure function definition(self) result(string)
      class(deck_parameter_t), intent(in) :: self
      character(:), allocatable :: string
      string = self%name//' = '//self%value
      if (.not. self%is_number) string = self%name//' = "'//self%value//'"'
   end function definition

   !> "line 12", with the name of its file if there are several.
   pure function line_words(self, number) result(words)
      class(deck_source_t), intent(in) :: self
      integer, intent(in) :: number !! number of the line, from 1
      character(:), allocatable :: words
      words = 'line '//to_text(self%origin(2, number))
      if (size(self%file) > 1) words = words//' of '//self%file(self%origin(1, number))%name
   end function line_words

   !> Converts a line and the columns of a part of it to the line as typed.
   pure subroutine as_typed(self, number, first, last, line)
      class(deck_source_t), intent(in) :: self
      integer, intent(in) :: number                    !! number of the line, from 1
      integer, intent(inout) :: first, last !! first and last column of the part; in: in the line that is read; out: in the typed
      !! line. A part of a value that replaced ${...} becomes the whole ${...}
      character(:), allocatable, intent(out) :: line
      integer :: t, i, shift(2)
      line = self%line(number)
      do t = 1, size(self%typed)
         if (self%typed(t)%line == number) exit
      end do
      if (t > size(self%typed)) return
      shift = 0
      associate (typed => self%typed(t))
         line = typed%text
         ! (If the list is empty, the copy would not be allocated.)
         if (.not. allocated(typed%spot)) return
         do i = 1, size(typed%spot)
            associate (spot => typed%spot(i))
               if (first > spot%read(2)) shift(1) = spot%typed(2) - spot%read(2)
               if (last > spot%read(2)) shift(2) = spot%typed(2) - spot%read(2)
               if (first >= spot%read(1) .and. first <= spot%read(2)) shift(1) = spot%typed(1) - first
               if (last >= spot%read(1) .and. last <= spot%read(2)) shift(2) = spot%typed(2) - last
            end associate
         end do
      end associate
      first = first + shift(1)
      last = last + shift(2)
   end subroutine as_typed

   !> Adds text at the end.
   pure subroutine add_text(self, string)
      class(growing_text_t), intent(inout) :: self
      character(*), intent(in) :: string
      character(:), allocatable :: longer
      if (.not. allocated(self%text)) allocate (character(1024) :: self%text)
      if (self%n + len(string) > len(self%text)) then
         allocate (character(2 * (self%n + len(string))) :: longer)
         longer(:self%n) = self%text(:self%n)
         call move_alloc(longer, self%text)
      end if
      self%text(self%n + 1:self%n + len(string)) = string
      self%n = self%n + len(string)
   end subroutine add_text

   !> Rejects folders and pipes. Names of files that the shell has opened are accepted even if they are pipes: unilat <(command).
   subroutine check_file(path, error)
      character(*), intent(in) :: path                 !! name of the file to be read
      type(error_t), allocatable, intent(out) :: error !! allocated: the name is that of a folder or a pipe (a missing file is not
      !! an error here)
      integer :: kind, status
      status = look_at(path//c_null_char, kind)
      if (kind == kind_folder) then
         call fail(error, quoted_path(path)//' is a folder; a deck is a file')
      else if (kind == kind_pipe .and. all([index(path, '/dev/stdin'), index(path, '/dev/fd/'), &
         & index(path, '/proc/self/fd/')] /= 1)) then
         call fail(error, quoted_path(path)//' is empty, or a pipe; a deck from a pipe is read from standard input')
      end if
   end subroutine check_file
end module deck_source

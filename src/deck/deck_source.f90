!> The text of a deck, read whole from a file or a pipe and kept: messages quote it, the result file stores it.
module deck_source
   use errors, only: error_t, fail
   implicit none
   private
   public :: deck_source_t, read_source_file, read_source_unit, source_from_text

   !> A deck's text and where its lines are.
   type :: deck_source_t
      character(:), allocatable :: name             !! of the file, as messages show it
      character(:), allocatable :: text             !! all lines, each ended by a newline
      integer :: n_lines = 0
      integer, allocatable :: first(:), last(:)     !! positions in `text` of a line's first and last character
   contains
      procedure :: line => source_line
   end type deck_source_t

   character(*), parameter :: newline = achar(10), carriage_return = achar(13)
   character(*), parameter :: byte_order_mark = char(239)//char(187)//char(191)
   integer, parameter :: chunk = 256 !! characters asked for in one read, which fills the rest with blanks each time

contains

   !> Reads a file.
   subroutine read_source_file(path, source, error)
      character(*), intent(in) :: path                !! the file, also its name in messages
      type(deck_source_t), intent(out) :: source      !! empty text on failure
      type(error_t), allocatable, intent(out) :: error !! the file is missing or cannot be read
      integer :: unit, status
      character(200) :: reason
      open (newunit=unit, file=path, status='old', action='read', iostat=status, iomsg=reason)
      if (status /= 0) then
         call source_from_text('', path, source)
         call fail(error, 'cannot open the deck '//path//': '//trim(reason))
         return
      end if
      call read_source_unit(unit, path, source, error)
      close (unit, iostat=status)
   end subroutine read_source_file

   !> Reads everything that a formatted sequential unit (such as input_unit) still holds.
   subroutine read_source_unit(unit, name, source, error)
      integer, intent(in) :: unit                      !! connected for formatted reading
      character(*), intent(in) :: name                 !! what messages call the deck
      type(deck_source_t), intent(out) :: source       !! empty text on failure
      type(error_t), allocatable, intent(out) :: error !! reading failed
      character(:), allocatable :: text, buffer
      integer :: status, n, length
      character(200) :: reason
      allocate (character(chunk) :: buffer)
      allocate (character(65536) :: text)
      length = 0
      do
         read (unit, '(a)', advance='no', size=n, iostat=status, iomsg=reason) buffer
         if (is_iostat_end(status)) exit
         if (status /= 0 .and. .not. is_iostat_eor(status)) then
            call source_from_text('', name, source)
            call fail(error, 'cannot read the deck '//name//': '//trim(reason))
            return
         end if
         if (length + n + 1 > len(text)) call enlarge(text, 2 * len(text) + n)
         text(length + 1:length + n) = buffer(:n)
         length = length + n
         if (is_iostat_eor(status)) then
            length = length + 1
            text(length:length) = newline
         end if
      end do
      call source_from_text(text(:length), name, source)
   end subroutine read_source_unit

   !> Finds the lines of a text.
   pure subroutine source_from_text(text, name, source)
      character(*), intent(in) :: text           !! lines ended by newlines; a carriage return before one is dropped
      character(*), intent(in) :: name           !! what messages call the deck
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
   end subroutine source_from_text

   !> One line without its newline; '' when there is no such line.
   pure function source_line(self, number) result(line)
      class(deck_source_t), intent(in) :: self
      integer, intent(in) :: number !! from 1
      character(:), allocatable :: line
      line = ''
      if (number >= 1 .and. number <= self%n_lines) line = self%text(self%first(number):self%last(number))
   end function source_line

   subroutine enlarge(text, length)
      character(:), allocatable, intent(inout) :: text
      integer, intent(in) :: length
      character(:), allocatable :: larger
      allocate (character(length) :: larger)
      larger(:len(text)) = text
      call move_alloc(larger, text)
   end subroutine enlarge
end module deck_source

!> Collects the errors in a deck, each with its place in the deck, and prints them as one report.
module diagnostics
   use text, only: to_text, plural
   use printable_text, only: printable, shortened, character_end, inside_character
   use deck_source, only: deck_source_t
   use terminal, only: painted, red, bold
   implicit none
   private
   public :: diagnostics_t, place_t, diagnostics_report, most_shown

   integer, parameter :: most_shown = 20 !! largest number of errors in a report

   !> Place in the deck: columns of one line; line 0: the deck as a whole.
   type :: place_t
      integer :: line = 0
      integer :: first = 1, last = 1
   end type place_t

   !> One error in the deck: its place and the message.
   type :: diagnostic_t
      type(place_t) :: place
      character(:), allocatable :: message
   end type diagnostic_t

   !> All errors found so far.
   type :: diagnostics_t
      integer :: n = 0
      type(diagnostic_t), private :: item(most_shown) !! the first errors by place; errors at one place keep their order
   contains
      procedure :: add
   end type diagnostics_t

   integer, parameter :: longest_message = 1000 !! [bytes] longest message
   integer, parameter :: longest_line = 160     !! longest part of a line of the deck that is shown [bytes]
   integer, parameter :: least_before = 60      !! smallest part of this line that is shown before the place of the error [bytes]

contains

   !> Adds an error.
   pure subroutine add(self, place, message)
      class(diagnostics_t), intent(inout) :: self
      type(place_t), intent(in) :: place  !! place that is marked by carets
      character(*), intent(in) :: message !! message, one line
      integer :: i
      self%n = self%n + 1
      do i = min(self%n - 1, most_shown), 1, -1
         if (.not. before(place, self%item(i)%place)) exit
         if (i < most_shown) self%item(i + 1) = self%item(i)
      end do
      if (i < most_shown) self%item(i + 1) = diagnostic_t(place, shortened(message, longest_message))
   end subroutine add

   !> The report: the errors in the order of the deck, each with its line and carets below its place; '' if there are no errors.
   !>
   !> At most 20 errors are shown, then "and N more"; the last line contains the total number.
   pure function diagnostics_report(diagnostics, source, coloured) result(report)
      type(diagnostics_t), intent(in) :: diagnostics
      type(deck_source_t), intent(in) :: source !! the deck to which the errors belong
      logical, intent(in), optional :: coloured !! true: coloured for a terminal; default: false
      character(:), allocatable :: report       !! lines of the report, ended by newlines
      integer :: i
      logical :: paint
      paint = .false.
      if (present(coloured)) paint = coloured
      report = ''
      if (diagnostics%n == 0) return
      do i = 1, min(diagnostics%n, most_shown)
         report = report//described(diagnostics%item(i))
      end do
      if (diagnostics%n > most_shown) report = report//'and '//to_text(diagnostics%n - most_shown)//' more'//new_line('a')
      report = report//plural(diagnostics%n, 'error')//' in '//printable(source%name)//new_line('a')

   contains

      !> Text of one error: file:line:column: message, the line, and carets. Of a long line only the part around the place is shown.
      pure function described(item) result(string)
         type(diagnostic_t), intent(in) :: item
         character(:), allocatable :: string, line, margin, shown
         character(8) :: number
         integer :: first, last, from, to
         if (item%place%line == 0 .or. source%n_lines == 0) then
            string = printable(source%name)//trim(merge(':1:1', '    ', item%place%line > 0))//': '// &
               painted(printable(item%message), bold, paint)//new_line('a')
            return
         end if
         first = item%place%first
         last = max(item%place%last, first)
         call source%as_typed(item%place%line, first, last, line)
         ! Columns count characters; a character outside ASCII takes several bytes.
         margin = blanked(printable(line(:min(first - 1, len(line)))))//repeat(' ', max(0, first - 1 - len(line)))
         associate (origin => source%origin(:, item%place%line))
            string = printable(source%file(origin(1))%name)//':'//to_text(origin(2))//':'//to_text(1 + len(margin))//': '// &
               painted(printable(item%message), bold, paint)//new_line('a')
            write (number, '(i8)') origin(2)
         end associate
         from = 1
         to = len(line)
         if (len(line) > longest_line) then
            from = max(1, min(first - least_before, len(line) - longest_line + 1))
            if (from > 1) from = character_end(line, from - 1) + 1
            to = character_end(line, min(len(line), from + longest_line - 1))
            margin = blanked(printable(line(from:min(first - 1, len(line)))))//repeat(' ', max(0, first - 1 - len(line)))
         end if
         shown = printable(line(from:to))
         if (from > 1) shown = '...'//shown
         if (from > 1) margin = '   '//margin
         if (to < len(line)) shown = shown//'...'
         string = string//number//' | '//shown//new_line('a')
         last = min(last, max(to, first))
         if (last <= len(line)) last = first - 1 + characters(printable(line(first:last)))
         string = string//repeat(' ', 8)//' | '//margin//painted(repeat('^', max(1, last - first + 1)), red, paint)//new_line('a')
      end function described
   end function diagnostics_report

   !> Blanks with the printed width of a text; tabs are kept.
   pure function blanked(string) result(blanks)
      character(*), intent(in) :: string        !! text in UTF-8
      character(:), allocatable :: blanks
      integer :: i, n
      n = characters(string)
      allocate (character(n) :: blanks)
      n = 0
      do i = 1, len(string)
         if (inside_character(string(i:i))) cycle
         n = n + 1
         blanks(n:n) = merge(string(i:i), ' ', string(i:i) == achar(9))
      end do
   end function blanked

   !> Number of characters of UTF-8 text.
   pure integer function characters(string)
      character(*), intent(in) :: string
      integer :: i
      characters = count([(.not. inside_character(string(i:i)), i=1, len(string))])
   end function characters

   !> True if a place is before another one; the deck as a whole comes last.
   pure logical function before(one, other)
      type(place_t), intent(in) :: one, other
      if (one%line == other%line) then
         before = one%first < other%first
      else
         before = one%line /= 0 .and. (one%line < other%line .or. other%line == 0)
      end if
   end function before
end module diagnostics

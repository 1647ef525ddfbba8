!> Assembly of the deck: *INCLUDE is replaced by the included decks, and ${...} by values.
!>
!> Lines are processed before they are split into cards, because an included deck may contain cards, or data lines of the preceding
!> card. Parameters are defined in the order of the lines.
module deck_assembly
   use text, only: squeeze, to_text, blanks
   use printable_text, only: quoted, quoted_path
   use errors, only: error_t
   use posix_files, only: longest_name
   use deck_source, only: growing_text_t, deck_source_t, deck_file_t, typed_line_t, spot_t, read_source_file, source_from_text, &
      most_lines, first_letter
   use deck_parameters, only: deck_parameters_t
   use diagnostics, only: diagnostics_t, place_t
   implicit none
   private
   public :: assemble_deck

   character(*), parameter :: nl = new_line('a')
   character(*), parameter :: expanded_mark = '** *' !! prefix that marks an *INCLUDE whose lines follow in the expanded deck
   integer, parameter :: deepest = 100 !! largest depth of includes; it ends includes that are circular through symbolic links
   integer, parameter :: most_files = 10000 !! largest number of included files, with repetitions
   integer, parameter :: most_names = 20    !! largest number of parameters listed in a message

   !> A deck during its assembly: its three texts (assembled, expanded, record; see deck_source_t), and the origin of their lines.
   type :: assembly_t
      type(growing_text_t) :: read, expanded, record
      integer :: n = 0                             !! number of lines read so far
      integer, allocatable :: origin(:, :)         !! (2, lines) file and line number of each line; the array may be larger
      integer :: n_typed = 0
      type(typed_line_t), allocatable :: typed(:)  !! lines with replaced parameters; only the first n_typed entries are in use
      integer :: n_files = 0
      type(deck_file_t), allocatable :: file(:)    !! files of the deck; only the first n_files entries are in use
      type(deck_parameters_t) :: parameters
      type(diagnostics_t) :: diagnostics           !! errors found so far
      logical :: in_parameters = .false.           !! true: the present data lines belong to a *PARAMETER card
      integer :: heading_file = 0 !! index of the file with the *HEADING to which the present data lines belong; 0: they belong to
      !! another card
      type(place_t) :: included_at                 !! place of the *INCLUDE in the deck from which the present lines come
      logical :: ended = .false.                   !! true: reading has stopped because the deck is too large
   end type assembly_t

contains

   !> Assembles a deck.
   subroutine assemble_deck(source, settings, diagnostics)
      type(deck_source_t), intent(inout) :: source        !! in: as typed; out: assembled
      character(*), intent(in) :: settings(:)             !! name=value for every --set of the command line
      type(diagnostics_t), intent(inout) :: diagnostics   !! out: with the errors added
      type(assembly_t) :: a
      type(deck_source_t) :: whole
      character(:), allocatable :: wrong
      integer :: i
      a%diagnostics = diagnostics
      call a%read%add('')
      call a%expanded%add('')
      call a%record%add('')
      allocate (a%origin(2, 1024), a%typed(16), a%file(16), a%parameters%list(16))
      call add_file(a, source%name, 0)
      do i = 1, size(settings)
         call a%parameters%set(trim(settings(i)), wrong)
         if (wrong /= '') call a%diagnostics%add(place_t(), '--set '//quoted(trim(settings(i)))//': '//wrong)
      end do
      call take_file(a, source, 1, 1)
      call check_settings(a, settings)
      call source_from_text(a%read%text(:a%read%n), source%name, whole)
      whole%file = a%file(:a%n_files)
      whole%origin = a%origin(:, :a%n)
      whole%typed = a%typed(:a%n_typed)
      whole%parameter = a%parameters%list(:a%parameters%n)
      whole%expanded = a%expanded%text(:a%expanded%n)
      ! Parameters that were set on the command line and are not defined in the deck are defined before it.
      whole%record = ''
      do i = 1, a%parameters%n
         if (a%parameters%list(i)%line == 0) whole%record = whole%record//a%parameters%list(i)%definition()//nl
      end do
      if (whole%record /= '') whole%record = '*PARAMETER'//nl//whole%record
      whole%record = whole%record//a%record%text(:a%record%n)
      source = whole
      diagnostics = a%diagnostics
   end subroutine assemble_deck

   !> Reports parameters set on the command line that the deck does not use.
   subroutine check_settings(a, settings)
      type(assembly_t), intent(inout) :: a
      character(*), intent(in) :: settings(:)
      character(:), allocatable :: known
      integer :: i, n
      if (size(settings) == 0 .or. a%diagnostics%n > 0) return
      known = ''
      n = 0
      do i = 1, a%parameters%n
         if (.not. a%parameters%list(i)%in_deck) cycle
         n = n + 1
         if (n <= most_names) known = known//', '//a%parameters%list(i)%name
      end do
      if (known == '') known = ', none'
      if (n > most_names) known = known//' and '//to_text(n - most_names)//' more'
      do i = 1, a%parameters%n
         associate (parameter => a%parameters%list(i))
            if (.not. parameter%in_deck) call a%diagnostics%add(place_t(), '--set '//quoted(parameter%name)// &
               ': the deck has no such parameter (it has: '//known(3:)//')')
         end associate
      end do
   end subroutine check_settings

   recursive subroutine take_file(a, source, file, depth)
      type(assembly_t), intent(inout) :: a
      type(deck_source_t), intent(in) :: source
      integer, intent(in) :: file, depth
      integer :: i
      do i = 1, source%n_lines
         if (a%ended) exit
         call take_line(a, source%line(i), [file, i], depth)
      end do
   end subroutine take_file

   recursive subroutine take_line(a, typed, origin, depth)
      type(assembly_t), intent(inout) :: a
      character(*), intent(in) :: typed
      integer, intent(in) :: origin(2), depth
      type(spot_t), allocatable :: spots(:)
      character(:), allocatable :: filled, wrong
      integer :: first
      if (a%n >= most_lines) then
         call a%diagnostics%add(place_t(a%n, 1, 1), 'the deck has more than '//to_text(most_lines)// &
            ' lines with all that it includes')
         a%ended = .true.
         return
      end if
      first = first_letter(typed)
      if (first == 0) then
         ! This *INCLUDE is marked in an expanded deck, and its lines follow. Its file name may contain a parameter, which then
         ! counts as used.
         if (index(typed, expanded_mark) == 1) then
            if (keyword(typed(len(expanded_mark):)) == 'INCLUDE') call a%parameters%note_use(typed)
         end if
         call keep(a, origin, typed, typed, typed)
      else if (typed(first:first) /= '*' .and. .not. may_write_title(a, origin(1))) then
         ! An included file cannot continue the title of another file: otherwise the text of any file could become the title, and be
         ! stored in the results.
         call a%diagnostics%add(a%included_at, '*INCLUDE: below *HEADING a deck that begins with a keyword; its text does not '// &
            'become the title')
         a%ended = .true.
      else if (a%in_parameters .and. typed(first:first) /= '*') then
         call define_parameter(a, typed, first, origin)
      else if (typed(first:first) /= '*' .and. index(typed, '${') == 0) then
         call keep(a, origin, typed, typed, typed)
      else
         call a%parameters%fill(typed, filled, spots, wrong)
         if (wrong /= '') then
            call keep(a, origin, typed, typed, typed)
            associate (spot => spots(size(spots)))
               call a%diagnostics%add(place_t(a%n, spot%typed(1), spot%typed(2)), &
                  quoted(typed(spot%typed(1):spot%typed(2)))//': '//wrong)
            end associate
         else if (keyword(filled) == 'INCLUDE') then
            call keep(a, origin, '', '** '//typed(first:), '** '//typed(first:))
            call note_typed(a, typed, [spot_t ::])
            call include_file(a, filled, typed, first, depth)
         else
            call keep(a, origin, filled, typed, typed)
            if (size(spots) > 0) call note_typed(a, typed, spots)
            if (typed(first:first) == '*') then
               a%in_parameters = keyword(filled) == 'PARAMETER'
               a%heading_file = merge(origin(1), 0, keyword(filled) == 'HEADING')
            end if
         end if
      end if
   end subroutine take_line

   subroutine define_parameter(a, typed, first, origin)
      type(assembly_t), intent(inout) :: a
      character(*), intent(in) :: typed
      integer, intent(in) :: first, origin(2)
      character(:), allocatable :: wrong, as_set
      integer :: earlier
      call a%parameters%define(typed, a%n + 1, wrong, earlier, as_set)
      if (as_set == '') then
         call keep(a, origin, typed, typed, typed)
      else
         call keep(a, origin, as_set, typed, '** '//typed//nl//as_set)
         call note_typed(a, typed, [spot_t ::])
      end if
      if (earlier > 0) then
         wrong = 'the name was used in line '//to_text(a%origin(2, earlier))
         if (a%origin(1, earlier) /= origin(1)) wrong = wrong//' of '//quoted_path(a%file(a%origin(1, earlier))%name)
      end if
      if (wrong /= '') call a%diagnostics%add(place_t(a%n, first, len_trim(typed)), '*PARAMETER: '//wrong)
   end subroutine define_parameter

   !> Reads the deck that *INCLUDE names, and processes its lines.
   recursive subroutine include_file(a, card, typed, first, depth)
      type(assembly_t), intent(inout) :: a
      character(*), intent(in) :: card, typed    ! the line with values inserted; the line as typed
      integer, intent(in) :: first, depth
      type(deck_source_t) :: source
      type(error_t), allocatable :: error
      character(:), allocatable :: path, wrong
      integer :: comma, equals, here, above, file
      here = a%origin(1, a%n)
      comma = index(card, ',')
      equals = index(card, '=')
      wrong = ''
      path = ''
      if (comma == 0 .or. equals < comma) then
         wrong = 'a file is missing: *INCLUDE, FILE=name'
      else if (squeeze(card(comma + 1:equals - 1)) /= 'FILE') then
         wrong = 'reads: *INCLUDE, FILE=name'
      else
         path = trim(adjustl(card(equals + 1:)))
         if (path == '') wrong = 'a file is missing: *INCLUDE, FILE=name'
         if (len(path) > longest_name) wrong = 'a name of more than '//to_text(longest_name)//' characters names no file'
      end if
      if (may_write_title(a, here)) a%included_at = place_t(a%n, first, len_trim(typed))
      if (wrong == '') then
         path = beside(a%file(here)%name, path)
         above = here
         do while (above > 0)
            if (a%file(above)%name == path) wrong = quoted_path(path)//' includes itself'//way(a, above, here)
            above = a%file(above)%included_by
         end do
         if (depth == deepest) wrong = 'more than '//to_text(deepest)//' decks include each other'
         if (a%n_files > most_files) then
            wrong = 'the deck includes more than '//to_text(most_files)//' files'
            a%ended = .true.
         end if
      end if
      if (wrong == '') then
         call read_source_file(path, source, error)
         if (allocated(error)) wrong = error%message
      end if
      if (wrong /= '') then
         call a%diagnostics%add(place_t(a%n, first, len_trim(typed)), '*INCLUDE: '//wrong)
         return
      end if
      call add_file(a, path, here)
      file = a%n_files
      call take_file(a, source, file, depth + 1)
   end subroutine include_file

   !> False if the text of a file would become the title of a *HEADING that is neither in this file nor in a file included by it.
   pure logical function may_write_title(a, file) result(may)
      type(assembly_t), intent(in) :: a
      integer, intent(in) :: file
      integer :: above
      above = a%heading_file
      may = above == 0
      do while (above > 0)
         may = may .or. above == file
         above = a%file(above)%included_by
      end do
   end function may_write_title

   !> Stores the name of a file.
   subroutine add_file(a, name, included_by)
      type(assembly_t), intent(inout) :: a
      character(*), intent(in) :: name
      integer, intent(in) :: included_by
      if (a%n_files == size(a%file)) a%file = [a%file, a%file] ! the length of the array is doubled
      a%n_files = a%n_files + 1
      a%file(a%n_files) = deck_file_t(name, included_by)
   end subroutine add_file

   !> ": a.inp, b.inp, a.inp": the chain of includes from a file back to itself.
   function way(a, top, bottom) result(string)
      type(assembly_t), intent(in) :: a
      integer, intent(in) :: top, bottom
      character(:), allocatable :: string
      integer :: file
      string = quoted_path(a%file(top)%name)
      file = bottom
      do while (file /= top)
         string = quoted_path(a%file(file)%name)//', '//string
         file = a%file(file)%included_by
      end do
      string = ': '//quoted_path(a%file(top)%name)//', '//string
      if (top == bottom) string = ''
   end function way

   !> A path relative to the folder of another file, in its simplest form.
   function beside(name, path) result(whole)
      character(*), intent(in) :: name, path
      character(:), allocatable :: whole, part
      integer :: slash, before
      whole = path
      slash = index(name, '/', back=.true.)
      if (path(1:1) /= '/' .and. slash > 0) whole = name(:slash)//path
      ! dir/./deck.inp and dir/other/../deck.inp become dir/deck.inp, so that circular includes are detected by the names.
      slash = 1
      do while (index(whole(slash:), '/') > 0)
         before = slash
         slash = slash + index(whole(slash:), '/')
         part = whole(before:slash - 1)
         if (part == './' .or. (part == '/' .and. before > 1)) then
            whole = whole(:before - 1)//whole(slash:)
            slash = before
         else if (part == '../' .and. before > 1) then
            slash = index(whole(:before - 2), '/', back=.true.) + 1
            if (whole(slash:before - 1) == '../' .or. before == 2) then
               slash = before + 3
            else
               whole = whole(:slash - 1)//whole(before + 3:)
            end if
         end if
      end do
   end function beside

   !> Adds a line to the assembled deck, the expanded deck, and the record.
   subroutine keep(a, origin, read, expanded, record)
      type(assembly_t), intent(inout) :: a
      integer, intent(in) :: origin(2)
      character(*), intent(in) :: read, expanded, record
      if (a%n == size(a%origin, 2)) a%origin = reshape(a%origin, [2, 2 * a%n], pad=a%origin)
      a%n = a%n + 1
      a%origin(:, a%n) = origin
      call a%read%add(read)
      call a%read%add(nl)
      call a%expanded%add(expanded)
      call a%expanded%add(nl)
      call a%record%add(record)
      call a%record%add(nl)
   end subroutine keep

   !> Stores the last line as it was typed.
   subroutine note_typed(a, typed, spots)
      type(assembly_t), intent(inout) :: a
      character(*), intent(in) :: typed
      type(spot_t), intent(in) :: spots(:)
      if (a%n_typed == size(a%typed)) a%typed = [a%typed, a%typed]
      a%n_typed = a%n_typed + 1
      a%typed(a%n_typed) = typed_line_t(a%n, typed, spots)
   end subroutine note_typed

   !> The keyword of a line, in capitals without blanks; '' if there is none.
   pure function keyword(line)
      character(*), intent(in) :: line
      character(:), allocatable :: keyword
      integer :: star, comma
      keyword = ''
      star = verify(line, blanks)
      if (star == 0) return
      if (line(star:star) /= '*') return
      comma = index(line(star:), ',')
      if (comma == 0) comma = len(line) - star + 2
      keyword = squeeze(line(star + 1:star + comma - 2))
   end function keyword
end module deck_assembly

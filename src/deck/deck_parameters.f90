!> Parameters of a deck: their definition by *PARAMETER cards and the command line, and the replacement of ${...} by their values.
module deck_parameters
   use kinds, only: wp, name_length
   use text, only: to_text, blanks, nearest_word, word_index
   use printable_text, only: quoted, control_place, control_words
   use lookup, only: name_list_t
   use deck_source, only: growing_text_t, deck_parameter_t, spot_t
   use diagnostics, only: most_shown
   use formula, only: evaluate, is_plain_name, is_reserved, span_of, letters, digits
   implicit none
   private
   public :: deck_parameters_t

   integer, parameter :: longest_formula = 2000 !! largest length of a formula, in characters

   !> All parameters defined so far.
   type :: deck_parameters_t
      integer :: n = 0
      type(deck_parameter_t), allocatable :: list(:) !! only the first n entries are in use; size 1 or more
      type(name_list_t) :: names               !! names of the parameters, in the order of `list`
      integer :: guesses = 0
   contains
      procedure :: set, define, fill, note_use
   end type deck_parameters_t

contains

   !> Adds a parameter NAME=VALUE from the command line, before the deck is read.
   subroutine set(self, string, wrong)
      class(deck_parameters_t), intent(inout) :: self
      character(*), intent(in) :: string                !! text NAME=VALUE as typed
      character(:), allocatable, intent(out) :: wrong   !! description of the error; '' if there is none
      type(deck_parameter_t) :: parameter
      call new_parameter(self, string, parameter, wrong)
      if (wrong /= '') return ! the name may be missing
      if (place(self, parameter%name) > 0) wrong = 'set twice'
      if (wrong /= '') return
      parameter%was_set = .true.
      call append(self, parameter)
   end subroutine set

   !> Adds the definition on a line of a *PARAMETER card. A value that was set on the command line is kept.
   subroutine define(self, string, line, wrong, earlier, as_set)
      class(deck_parameters_t), intent(inout) :: self
      character(*), intent(in) :: string                !! text NAME = VALUE
      integer, intent(in) :: line                       !! number of the line in the deck
      character(:), allocatable, intent(out) :: wrong   !! description of the error; '' if there is none
      integer, intent(out) :: earlier                   !! line that already defines the parameter; 0: none
      character(:), allocatable, intent(out) :: as_set !! the line with the value from the command line; '': the value of the line
      !! itself applies
      type(deck_parameter_t) :: parameter
      integer :: i
      earlier = 0
      as_set = ''
      if (index(string, '${') > 0) then
         wrong = 'names stand without ${ } here'
         return
      end if
      call self%note_use(string)
      call new_parameter(self, string, parameter, wrong)
      if (wrong /= '') then
         ! After an error the parameter has the value 1, so that lines that contain its name cause no further errors.
         if (.not. allocated(parameter%value)) return
         parameter%value = '1'
         parameter%is_number = .true.
         parameter%number = 1.0_wp
      end if
      i = place(self, parameter%name)
      if (i == 0) then
         parameter%in_deck = .true.
         parameter%line = line
         call append(self, parameter)
      else
         earlier = self%list(i)%line
         self%list(i)%line = line
         self%list(i)%in_deck = .true.
         as_set = self%list(i)%definition()
      end if
   end subroutine define

   !> Replaces every ${...} of a line.
   subroutine fill(self, typed, filled, spots, wrong)
      class(deck_parameters_t), intent(inout) :: self
      character(*), intent(in) :: typed                   !! the line as typed
      character(:), allocatable, intent(out) :: filled    !! the line with values; undefined after an error
      type(spot_t), allocatable, intent(out) :: spots(:) !! the replaced parts; after an error the last one is the place of the
      !! error
      character(:), allocatable, intent(out) :: wrong     !! description of the error; '' if there is none
      character(:), allocatable :: value
      type(growing_text_t) :: read
      integer :: from, first, length, n
      allocate (spots(4))
      call read%add('')
      wrong = ''
      n = 0
      from = 1
      do
         first = index(typed(from:), '${')
         if (first == 0) exit
         first = from + first - 1
         length = index(typed(first:), '}')
         if (n == size(spots)) spots = [spots, spots] ! the length of the array is doubled
         n = n + 1
         associate (spot => spots(n))
            spot%typed = [first, len_trim(typed)]
            if (length > 0) spot%typed(2) = first + length - 1
            if (length == 0) wrong = 'the closing } is missing'
            if (length > 0) call value_of(self, typed(first + 2:spot%typed(2) - 1), value, wrong)
            call read%add(typed(from:first - 1))
            spot%read(1) = read%n + 1
            if (wrong == '') call read%add(value)
            spot%read(2) = read%n
            from = spot%typed(2) + 1
         end associate
         if (wrong /= '') exit
      end do
      if (wrong == '') call read%add(typed(from:))
      filled = read%text(:read%n)
      spots = spots(:n)
   end subroutine fill

   !> The text that replaces ${string}.
   subroutine value_of(self, string, value, wrong)
      type(deck_parameters_t), intent(inout) :: self
      character(*), intent(in) :: string
      character(:), allocatable, intent(out) :: value, wrong
      real(wp) :: number
      integer :: i
      wrong = ''
      call self%note_use(string)
      i = place(self, stripped(string))
      if (i > 0) then
         value = self%list(i)%value
      else
         call find_value(self, string, number, wrong)
         value = written(number)
      end if
   end subroutine value_of

   !> Marks parameters set on the command line as used by the deck if a formula contains them.
   pure subroutine note_use(self, string)
      class(deck_parameters_t), intent(inout) :: self
      character(*), intent(in) :: string  !! formula or any other text
      integer :: first, last, i
      last = 0
      do
         call next_name(string, last + 1, first, last)
         if (first == 0) exit
         i = place(self, string(first:last))
         if (i > 0) self%list(i)%in_deck = .true.
      end do
   end subroutine note_use

   !> Reads the text NAME = VALUE.
   subroutine new_parameter(self, string, parameter, wrong)
      type(deck_parameters_t), intent(inout) :: self
      character(*), intent(in) :: string
      type(deck_parameter_t), intent(out) :: parameter
      character(:), allocatable, intent(out) :: wrong
      character(:), allocatable :: typed
      integer :: equals, control
      wrong = ''
      control = control_place(string)
      if (control > 0) then
         wrong = 'character '//to_text(control)//' is '//control_words(string(control:control))// &
            '; names and values are printable text'
         return
      end if
      equals = index(string, '=')
      if (equals == 0) then
         wrong = 'must read: name = value'
         return
      end if
      parameter%name = stripped(string(:equals - 1))
      typed = stripped(string(equals + 1:))
      if (.not. is_plain_name(parameter%name) .or. len(parameter%name) > name_length) then
         wrong = 'a parameter has a name of letters, digits and _ ('//to_text(name_length)//' at most), a letter first, not '// &
            quoted(parameter%name)
      else if (is_reserved(parameter%name)) then
         wrong = parameter%name//' means something in formulas; choose another name'
      else if (typed == '') then
         wrong = parameter%name//' has no value'
      else if (scan(typed(1:1), '"''') == 1) then
         parameter%is_number = .false.
         parameter%value = typed(2:max(len(typed) - 1, 1))
         if (len(typed) < 2 .or. typed(len(typed):) /= typed(1:1) .or. scan(parameter%value, '"''') > 0) &
            wrong = 'text stands in a pair of quotes and has none inside: '//quoted(typed)
      else
         call find_value(self, typed, parameter%number, wrong)
         parameter%value = written(parameter%number)
      end if
   end subroutine new_parameter

   !> Evaluates a formula.
   subroutine find_value(self, string, number, wrong)
      type(deck_parameters_t), intent(inout) :: self
      character(*), intent(in) :: string
      real(wp), intent(out) :: number
      character(:), allocatable, intent(out) :: wrong
      character(:), allocatable :: known, no_number
      real(wp), allocatable :: value(:)
      integer :: first, last, i
      ! Collects the names in the formula, and a suggestion for a name that does not exist.
      number = 0.0_wp
      wrong = ''
      if (len_trim(string) > longest_formula) wrong = 'a formula has '//to_text(longest_formula)//' characters at most'
      if (wrong /= '') return
      known = ''
      no_number = ''
      allocate (value(0))
      last = 0
      do
         call next_name(string, last + 1, first, last)
         if (first == 0) exit
         i = place(self, string(first:last))
         if (i == 0 .and. .not. is_reserved(string(first:last)) .and. self%guesses < most_shown) then
            self%guesses = self%guesses + 1
            i = place(self, nearest_word(self%names%listed(), string(first:last)))
         else if (i > 0) then
            if (.not. self%list(i)%is_number) no_number = self%list(i)%name
            if (.not. self%list(i)%is_number .or. word_index(known, self%list(i)%name) > 0) cycle
         end if
         if (i == 0) cycle
         if (known /= '') known = known//'|'
         known = known//self%list(i)%name
         value = [value, self%list(i)%number]
      end do
      call evaluate(string, known, value, number, wrong)
      if (wrong /= '' .and. no_number /= '') wrong = no_number//' is text, and formulas are made of numbers'
   end subroutine find_value

   pure subroutine append(self, parameter)
      type(deck_parameters_t), intent(inout) :: self
      type(deck_parameter_t), intent(in) :: parameter
      integer :: i
      logical :: is_new
      if (self%n == size(self%list)) self%list = [self%list, self%list] ! the length of the array is doubled
      self%n = self%n + 1
      self%list(self%n) = parameter
      call self%names%add(parameter%name, i, is_new)
   end subroutine append

   !> A number as text. Integers have no decimal point, so that they may also be used where an integer is required.
   pure function written(number) result(string)
      real(wp), intent(in) :: number
      character(:), allocatable :: string
      if (abs(number) <= real(huge(1), wp) .and. abs(number - anint(number)) <= 0.0_wp) then
         string = to_text(nint(number))
      else
         string = to_text(number)
      end if
   end function written

   !> Position of a parameter in the list, 0 if there is none.
   pure integer function place(self, name)
      type(deck_parameters_t), intent(in) :: self
      character(*), intent(in) :: name
      place = 0
      if (len_trim(name) > 0 .and. len_trim(name) <= name_length) place = self%names%find(trim(name))
   end function place

   !> First and last character of the next plain name in a text; 0 if there is none.
   pure subroutine next_name(string, from, first, last)
      character(*), intent(in) :: string
      integer, intent(in) :: from             !! position in the text at which the search begins
      integer, intent(out) :: first, last
      integer :: length
      first = from
      do while (first <= len(string))
         length = span_of(string(first:), letters//digits)
         last = first + length - 1
         ! The e of a number such as 1e5 is not a name.
         if (length > 0 .and. scan(string(first:first), digits) == 0) return
         first = first + max(length, 1)
      end do
      first = 0
      last = len(string)
   end subroutine next_name

   !> A text without the blanks at its ends.
   pure function stripped(string)
      character(*), intent(in) :: string
      character(:), allocatable :: stripped
      stripped = string(max(1, verify(string, blanks)):verify(string, blanks, back=.true.))
   end function stripped
end module deck_parameters

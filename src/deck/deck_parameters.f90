!> Names with values in a deck: what *PARAMETER cards and the command line define, and what ${...} makes of them.
module deck_parameters
   use kinds, only: wp, name_length
   use text, only: to_text, same_name, is_blank
   use deck_source, only: deck_parameter_t, spot_t
   use formula, only: evaluate, is_plain_name, is_reserved
   implicit none
   private
   public :: deck_parameters_t

   !> All that have a value so far.
   type :: deck_parameters_t
      type(deck_parameter_t), allocatable :: list(:)
      character(:), allocatable :: numbers     !! names of those that are numbers, between bars
      real(wp), allocatable :: number(:)       !! their values
   contains
      procedure :: start, set, define, fill, note_use
   end type deck_parameters_t

contains

   !> No parameters yet.
   pure subroutine start(self)
      class(deck_parameters_t), intent(inout) :: self
      self%list = [deck_parameter_t ::]
      self%numbers = ''
      self%number = [real(wp) ::]
   end subroutine start

   !> Takes NAME=VALUE from the command line, before the deck is read.
   pure subroutine set(self, string, wrong)
      class(deck_parameters_t), intent(inout) :: self
      character(*), intent(in) :: string                !! as typed
      character(:), allocatable, intent(out) :: wrong   !! what is wrong with it; ''
      type(deck_parameter_t) :: parameter
      call new_parameter(self, string, parameter, wrong)
      if (wrong == '' .and. place(self, parameter%name) > 0) wrong = 'set twice'
      if (wrong /= '') return
      parameter%was_set = .true.
      call append(self, parameter)
   end subroutine set

   !> Takes a line of a *PARAMETER card. What the command line has set keeps that value.
   pure subroutine define(self, string, line, wrong, earlier, as_set)
      class(deck_parameters_t), intent(inout) :: self
      character(*), intent(in) :: string                !! NAME = VALUE
      integer, intent(in) :: line                       !! of the deck
      character(:), allocatable, intent(out) :: wrong   !! what is wrong with it; ''
      integer, intent(out) :: earlier                   !! line that names the parameter already; 0
      character(:), allocatable, intent(out) :: as_set  !! the line with the value that was set; '': that of the line holds
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
         ! Any value, so that what uses the name is not reported, too.
         if (.not. allocated(parameter%value)) return
         parameter%value = '1'
         parameter%is_number = .true.
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
   pure subroutine fill(self, typed, filled, spots, wrong)
      class(deck_parameters_t), intent(inout) :: self
      character(*), intent(in) :: typed                   !! the line
      character(:), allocatable, intent(out) :: filled    !! with values; of no use when something is wrong
      type(spot_t), allocatable, intent(out) :: spots(:)  !! what was replaced; of an error the last one is the place
      character(:), allocatable, intent(out) :: wrong     !! what is wrong; ''
      character(:), allocatable :: value
      type(spot_t) :: spot
      integer :: from, first, length
      allocate (spots(0))
      filled = ''
      wrong = ''
      from = 1
      do
         first = index(typed(from:), '${')
         if (first == 0) exit
         first = from + first - 1
         length = index(typed(first:), '}')
         spot%typed = [first, len_trim(typed)]
         if (length > 0) spot%typed(2) = first + length - 1
         if (length == 0) wrong = 'the closing } is missing'
         if (length > 0) call value_of(self, typed(first + 2:spot%typed(2) - 1), value, wrong)
         filled = filled//typed(from:first - 1)
         spot%read(1) = len(filled) + 1
         if (wrong == '') filled = filled//value
         spot%read(2) = len(filled)
         spots = [spots, spot]
         if (wrong /= '') return
         from = spot%typed(2) + 1
      end do
      filled = filled//typed(from:)
   end subroutine fill

   !> What ${string} writes.
   pure subroutine value_of(self, string, value, wrong)
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

   !> Names that the command line has set mean something to the deck when a formula has them.
   pure subroutine note_use(self, string)
      class(deck_parameters_t), intent(inout) :: self
      character(*), intent(in) :: string  !! formulas and other text
      integer :: i
      do i = 1, size(self%list)
         if (.not. self%list(i)%in_deck) self%list(i)%in_deck = uses(string, self%list(i)%name)
      end do
   end subroutine note_use

   !> Reads NAME = VALUE.
   pure subroutine new_parameter(self, string, parameter, wrong)
      type(deck_parameters_t), intent(in) :: self
      character(*), intent(in) :: string
      type(deck_parameter_t), intent(out) :: parameter
      character(:), allocatable, intent(out) :: wrong
      character(:), allocatable :: typed
      real(wp) :: number
      integer :: equals
      wrong = ''
      equals = index(string, '=')
      if (equals == 0) then
         wrong = 'must read: name = value'
         return
      end if
      parameter%name = stripped(string(:equals - 1))
      typed = stripped(string(equals + 1:))
      if (.not. is_plain_name(parameter%name) .or. len(parameter%name) > name_length) then
         wrong = 'a parameter has a name of letters, digits and _, a letter first, not '//parameter%name
      else if (is_reserved(parameter%name)) then
         wrong = parameter%name//' means something in formulas; choose another name'
      else if (typed == '') then
         wrong = parameter%name//' has no value'
      else if (scan(typed(1:1), '"''') == 1) then
         parameter%is_number = .false.
         parameter%value = typed(2:max(len(typed) - 1, 1))
         if (len(typed) < 2 .or. typed(len(typed):) /= typed(1:1) .or. scan(parameter%value, '"''') > 0) &
            wrong = 'text stands in a pair of quotes and has none inside: '//typed
      else
         call find_value(self, typed, number, wrong)
         parameter%value = written(number)
      end if
   end subroutine new_parameter

   !> The value of a formula.
   pure subroutine find_value(self, string, number, wrong)
      type(deck_parameters_t), intent(in) :: self
      character(*), intent(in) :: string
      real(wp), intent(out) :: number
      character(:), allocatable, intent(out) :: wrong
      integer :: i
      call evaluate(string, self%numbers, self%number, number, wrong)
      if (wrong == '') return
      do i = 1, size(self%list)
         if (uses(string, self%list(i)%name) .and. .not. self%list(i)%is_number) &
            wrong = self%list(i)%name//' is text, and formulas are made of numbers'
      end do
   end subroutine find_value

   pure subroutine append(self, parameter)
      type(deck_parameters_t), intent(inout) :: self
      type(deck_parameter_t), intent(in) :: parameter
      type(deck_parameter_t), allocatable :: more(:)
      real(wp) :: number
      integer :: n
      n = size(self%list)
      allocate (more(n + 1))
      more(:n) = self%list
      more(n + 1) = parameter
      call move_alloc(more, self%list)
      if (.not. parameter%is_number) return
      if (self%numbers /= '') self%numbers = self%numbers//'|'
      self%numbers = self%numbers//parameter%name
      read (parameter%value, *) number
      self%number = [self%number, number]
   end subroutine append

   !> A number as decks have it: whole ones without a point, so that they may stand for integers, too.
   pure function written(number) result(string)
      real(wp), intent(in) :: number
      character(:), allocatable :: string
      if (abs(number) <= real(huge(1), wp) .and. abs(number - anint(number)) <= 0.0_wp) then
         string = to_text(nint(number))
      else
         string = to_text(number)
      end if
   end function written

   !> Position of a parameter in the list, 0 when there is none.
   pure integer function place(self, name)
      type(deck_parameters_t), intent(in) :: self
      character(*), intent(in) :: name
      do place = 1, size(self%list)
         if (same_name(self%list(place)%name, name)) return
      end do
      place = 0
   end function place

   !> True when a formula has a name in it.
   pure logical function uses(string, name)
      character(*), intent(in) :: string, name
      integer :: first, length
      first = 1
      uses = .false.
      do while (first <= len(string) .and. .not. uses)
         do length = 1, len(string) - first + 1
            if (.not. is_plain_name('a'//string(first:first + length - 1))) exit
         end do
         length = length - 1
         uses = same_name(string(first:first + length - 1), name)
         first = first + max(length, 1)
      end do
   end function uses

   !> A text without the blanks at its ends.
   pure function stripped(string)
      character(*), intent(in) :: string
      character(:), allocatable :: stripped
      integer :: first, last
      do first = 1, len(string)
         if (.not. is_blank(string(first:first))) exit
      end do
      do last = len(string), first, -1
         if (.not. is_blank(string(last:last))) exit
      end do
      stripped = string(first:last)
   end function stripped
end module deck_parameters

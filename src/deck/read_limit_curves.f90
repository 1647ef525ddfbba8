!> Reads *LIMIT CURVE: the limit point that is followed, and the second parameter that varies.
module read_limit_curves
   use kinds, only: wp
   use text, only: to_text, same_name
   use lookup, only: name_list_t
   use model, only: model_t, limit_curve_t, method_load, parameter_modulus, parameter_gap, parameter_imperfection, parameter_ea, &
      & parameter_ei, parameter_constant_load
   use obstacle_types, only: ground_half_space
   use diagnostics, only: diagnostics_t
   use deck_cards, only: deck_t, complain
   use card_values, only: given, parameter_text, parameter_word, parameter_integer, parameter_place, value_place, &
      field_place, field_real
   use deck_names, only: deck_names_t, find_set, find_named
   implicit none
   private
   public :: read_limit_curve_cards

contains

   !> Reads the limit curves of all steps.
   subroutine read_limit_curve_cards(deck, names, model, diagnostics)
      type(deck_t), intent(in) :: deck
      type(deck_names_t), intent(in) :: names           !! complete
      type(model_t), intent(inout) :: model             !! complete; receives step%limit_curve
      type(diagnostics_t), intent(inout) :: diagnostics
      type(limit_curve_t) :: curve
      type(name_list_t) :: known
      integer :: card, n, s, position
      real(wp) :: start
      logical :: is_new, ok
      n = 0
      do card = 1, deck%n_cards
         if (deck%card(card)%keyword /= 'LIMIT CURVE') cycle
         n = n + 1
         s = deck%card(card)%step
         if (.not. deck%card(card)%sound .or. s == 0) cycle
         if (model%step(s)%n_modes > 0) cycle ! reported elsewhere
         if (model%step(s)%method == method_load) call complain(deck, diagnostics, card, deck%card(card)%place, &
            'the step has METHOD=LOAD, which ends where it meets a limit point')
         curve = limit_curve_t(name='Curve-'//to_text(n))
         if (given(deck, card, 'NAME')) curve%name = parameter_text(deck, card, 'NAME')
         call known%add(curve%name, position, is_new)
         if (.not. is_new) call complain(deck, diagnostics, card, parameter_place(deck, card, 'NAME'), &
            'the name '//trim(curve%name)//' is used already')
         curve%limit_point = parameter_integer(deck, card, 'LIMIT')
         curve%max_points = parameter_integer(deck, card, 'POINTS')
         curve%logarithmic = parameter_word(deck, card, 'SCALE') == 'LOG'
         curve%to_rigid = given(deck, card, 'RIGID')
         call read_parameter(deck, names, model, diagnostics, card, curve, start, ok)
         if (deck%data_line(deck%card(card)%first_line)%sound) call read_increments(deck, diagnostics, card, start, ok, curve)
         model%step(s)%limit_curve = [model%step(s)%limit_curve, curve]
      end do
   end subroutine read_limit_curve_cards

   !> Reads the parameter that varies, and its value in the model.
   subroutine read_parameter(deck, names, model, diagnostics, card, curve, start, ok)
      type(deck_t), intent(in) :: deck
      type(deck_names_t), intent(in) :: names
      type(model_t), intent(in) :: model
      type(diagnostics_t), intent(inout) :: diagnostics
      integer, intent(in) :: card
      type(limit_curve_t), intent(inout) :: curve
      real(wp), intent(out) :: start
      logical, intent(out) :: ok ! false: the value is unknown because of an error
      integer :: set
      start = 1.0_wp
      ok = .false.
      set = 0
      allocate (curve%element(0))
      if (given(deck, card, 'OBSTACLE')) call find_named(deck, names%obstacle, diagnostics, card, &
         value_place(deck, card, 'OBSTACLE'), 'obstacle', curve%obstacle)
      if (given(deck, card, 'ELSET')) then
         call find_set(deck, names, diagnostics, card, 'ELSET', 'element', set)
         curve%set = parameter_text(deck, card, 'ELSET')
         curve%element = names%element_set%members(set)
      end if
      select case (parameter_word(deck, card, 'PARAMETER'))
      case ('MODULUS')
         curve%parameter = parameter_modulus
         if (curve%obstacle > 0) call read_modulus(deck, names, model, diagnostics, card, curve%obstacle, start, ok)
      case ('GAP')
         curve%parameter = parameter_gap
         if (curve%obstacle > 0) call read_gap(deck, names, model, diagnostics, card, curve%obstacle, start, ok)
      case ('IMPERFECTION')
         curve%parameter = parameter_imperfection
         if (set > 0) call check_imperfection(deck, names, model, diagnostics, card, curve%element, ok)
      case ('EA')
         curve%parameter = parameter_ea
         if (set > 0) call read_stiffness(deck, names, model, diagnostics, card, curve, start, ok)
      case ('EI')
         curve%parameter = parameter_ei
         if (set > 0) call read_stiffness(deck, names, model, diagnostics, card, curve, start, ok)
      case ('CONSTANT LOAD')
         curve%parameter = parameter_constant_load
         call check_constant_load(deck, model, diagnostics, card, ok)
      end select
   end subroutine read_parameter

   !> Reads MODULUS: of a foundation with a contact.
   subroutine read_modulus(deck, names, model, diagnostics, card, obstacle, start, ok)
      type(deck_t), intent(in) :: deck
      type(deck_names_t), intent(in) :: names
      type(model_t), intent(in) :: model
      type(diagnostics_t), intent(inout) :: diagnostics
      integer, intent(in) :: card, obstacle
      real(wp), intent(out) :: start
      logical, intent(out) :: ok
      character(:), allocatable :: instead
      start = model%obstacle(obstacle)%modulus
      ok = model%obstacle(obstacle)%modulus > 0.0_wp
      instead = ' has a law'
      if (model%obstacle(obstacle)%rigid) instead = ' is rigid'
      if (model%obstacle(obstacle)%ground == ground_half_space) instead = ' is a half-space'
      if (.not. ok) call complain(deck, diagnostics, card, value_place(deck, card, 'OBSTACLE'), 'obstacle '// &
         trim(model%obstacle(obstacle)%name)//instead// &
         '; MODULUS needs FOUNDATION=WINKLER or PASTERNAK')
      if (.not. (names%contacts_incomplete .or. any(model%contact%obstacle == obstacle))) &
         call without_contact(deck, model, diagnostics, card, obstacle)
   end subroutine read_modulus

   !> Reads GAP: the common value of all contacts with the obstacle.
   subroutine read_gap(deck, names, model, diagnostics, card, obstacle, start, ok)
      type(deck_t), intent(in) :: deck
      type(deck_names_t), intent(in) :: names
      type(model_t), intent(in) :: model
      type(diagnostics_t), intent(inout) :: diagnostics
      integer, intent(in) :: card, obstacle
      real(wp), intent(out) :: start
      logical, intent(out) :: ok
      real(wp) :: least, greatest
      start = 0.0_wp
      ok = .false.
      if (names%contacts_incomplete) return
      if (.not. any(model%contact%obstacle == obstacle)) then
         call without_contact(deck, model, diagnostics, card, obstacle)
         return
      end if
      if (model%obstacle(obstacle)%bilateral) then
         call complain(deck, diagnostics, card, value_place(deck, card, 'OBSTACLE'), trim(model%obstacle(obstacle)%name)// &
            ' is BILATERAL: it holds its candidates where they begin, whatever the gap')
         return
      end if
      least = minval(model%contact%gap, mask=model%contact%obstacle == obstacle)
      greatest = maxval(model%contact%gap, mask=model%contact%obstacle == obstacle)
      start = least
      ok = .not. greatest > least
      if (.not. ok) call complain(deck, diagnostics, card, value_place(deck, card, 'OBSTACLE'), 'the contacts with '// &
         trim(model%obstacle(obstacle)%name)//' have different gaps, from '//to_text(least)//' to '//to_text(greatest)// &
         '; a curve needs one gap')
   end subroutine read_gap

   subroutine without_contact(deck, model, diagnostics, card, obstacle)
      type(deck_t), intent(in) :: deck
      type(model_t), intent(in) :: model
      type(diagnostics_t), intent(inout) :: diagnostics
      integer, intent(in) :: card, obstacle
      call complain(deck, diagnostics, card, value_place(deck, card, 'OBSTACLE'), 'no *CONTACT names obstacle '// &
         trim(model%obstacle(obstacle)%name))
   end subroutine without_contact

   !> Reads EA, EI: of the section assigned to the set.
   subroutine read_stiffness(deck, names, model, diagnostics, card, curve, start, ok)
      type(deck_t), intent(in) :: deck
      type(deck_names_t), intent(in) :: names
      type(model_t), intent(in) :: model
      type(diagnostics_t), intent(inout) :: diagnostics
      integer, intent(in) :: card
      type(limit_curve_t), intent(in) :: curve
      real(wp), intent(out) :: start
      logical, intent(out) :: ok
      integer :: i
      start = 0.0_wp
      ok = .false.
      if (names%sections_incomplete) return
      do i = 1, size(model%section)
         if (.not. same_name(model%section(i)%name, curve%set)) cycle
         start = model%section(i)%ea
         if (curve%parameter == parameter_ei) start = model%section(i)%ei
         if (curve%parameter == parameter_ea .and. model%section(i)%inextensible) exit
         ok = .true.
         return
      end do
      if (i > size(model%section)) then
         call complain(deck, diagnostics, card, value_place(deck, card, 'ELSET'), 'no *BEAM SECTION names set '//trim(curve%set))
      else
         call complain(deck, diagnostics, card, value_place(deck, card, 'ELSET'), 'the rods of set '//trim(curve%set)// &
            ' are INEXTENSIBLE and have no EA')
      end if
   end subroutine read_stiffness

   !> Checks IMPERFECTION: the set must be a whole chain with an imperfection, from the model part or as a mode in this step.
   subroutine check_imperfection(deck, names, model, diagnostics, card, element, ok)
      type(deck_t), intent(in) :: deck
      type(deck_names_t), intent(in) :: names
      type(model_t), intent(in) :: model
      type(diagnostics_t), intent(inout) :: diagnostics
      integer, intent(in) :: card
      integer, intent(in) :: element(:)
      logical, intent(out) :: ok
      integer :: owner(0:model%mesh%n_elements) ! imperfection of each element; element 0: that of the first element
      integer :: e, i
      ok = names%mesh_incomplete .or. names%imperfections_incomplete
      if (ok) return
      owner = 0
      do e = 1, model%mesh%n_elements
         if (model%mesh%curve(e) > 0) owner(e) = model%curve(model%mesh%curve(e))%imperfection
      end do
      if (size(element) > 0) owner(0) = owner(element(1))
      ok = owner(0) > 0
      if (ok) ok = all(owner(element) == owner(0)) .and. count(owner(1:) == owner(0)) == size(element)
      associate (mode_offset => model%step(deck%card(card)%step)%mode_offset)
         do i = 1, size(mode_offset)
            if (size(mode_offset(i)%element) == size(element)) ok = ok .or. all(mode_offset(i)%element == element)
         end do
      end associate
      if (.not. ok) call complain(deck, diagnostics, card, value_place(deck, card, 'ELSET'), &
         'these are not the elements of an *IMPERFECTION')
   end subroutine check_imperfection

   !> Checks CONSTANT LOAD: a previous step must have left a load.
   subroutine check_constant_load(deck, model, diagnostics, card, ok)
      type(deck_t), intent(in) :: deck
      type(model_t), intent(in) :: model
      type(diagnostics_t), intent(inout) :: diagnostics
      integer, intent(in) :: card
      logical, intent(out) :: ok
      integer :: s
      s = deck%card(card)%step
      ok = any(model%step(:s - 1)%n_modes == 0)
      if (.not. ok) then
         call complain(deck, diagnostics, card, parameter_place(deck, card, 'PARAMETER'), &
            'no step with *STATIC stands before this one, so there is no constant load')
      else if (size(model%step(s)%mode_offset) > 0) then
         ok = .false.
         call complain(deck, diagnostics, card, parameter_place(deck, card, 'PARAMETER'), 'the step begins with the '// &
            'stress-free structure (*IMPERFECTION, SHAPE=MODE), so there is no constant load')
      end if
   end subroutine check_constant_load

   !> Reads the data line: first, last, largest, values for additional points.
   subroutine read_increments(deck, diagnostics, card, start, start_known, curve)
      type(deck_t), intent(in) :: deck
      type(diagnostics_t), intent(inout) :: diagnostics
      integer, intent(in) :: card
      real(wp), intent(in) :: start
      logical, intent(in) :: start_known
      type(limit_curve_t), intent(inout) :: curve
      integer :: line, field
      line = deck%card(card)%first_line
      allocate (curve%at(0))
      curve%increment = field_real(deck, line, 1)
      curve%last = field_real(deck, line, 2)
      curve%largest = field_real(deck, line, 3)
      if (curve%largest < abs(curve%increment)) call wrong(3, 'the largest increment must not be below the first one')
      if (curve%last <= 0.0_wp) then
         if (curve%logarithmic) then
            call wrong(2, 'SCALE=LOG needs a positive last value')
            return
         else if (any(curve%parameter == [parameter_modulus, parameter_ea, parameter_ei])) then
            call wrong(2, parameter_word(deck, card, 'PARAMETER')//' must stay positive')
            return
         end if
      end if
      if (.not. start_known) return
      if (curve%logarithmic .and. start <= 0.0_wp) then
         call complain(deck, diagnostics, card, parameter_place(deck, card, 'SCALE'), &
            'SCALE=LOG needs a positive value to start from, not '//to_text(start))
      else if (.not. abs(curve%last - start) > 0.0_wp) then
         call wrong(2, 'the curve would end where it begins, at '//to_text(start))
      else if (curve%increment * (curve%last - start) < 0.0_wp) then
         call wrong(1, 'the first increment leads away from the last value: from '//to_text(start)//' to '// &
            to_text(curve%last))
      else if (curve%to_rigid .and. curve%last < start) then
         call complain(deck, diagnostics, card, parameter_place(deck, card, 'RIGID'), &
            'RIGID goes with a modulus that grows')
      end if
      do field = 4, deck%data_line(line)%n_fields
         curve%at = [curve%at, field_real(deck, line, field)]
         associate (value => curve%at(size(curve%at)))
            if ((value - start) * (value - curve%last) >= 0.0_wp) call wrong(field, to_text(value)// &
               ' does not lie between '//to_text(start)//' and '//to_text(curve%last))
         end associate
      end do

   contains

      subroutine wrong(field, message)
         integer, intent(in) :: field
         character(*), intent(in) :: message
         call complain(deck, diagnostics, card, field_place(deck, line, field), message)
      end subroutine wrong
   end subroutine read_increments
end module read_limit_curves

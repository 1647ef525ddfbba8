!> Reads *BRANCH, paths that start at a bifurcation of a step, and *LIMIT CURVE: a limit point that is followed while a second
!> parameter varies.
module read_branches
   use kinds, only: wp
   use text, only: to_text, same_name
   use cross_section, only: varies
   use model, only: model_t, step_t, branch_t, limit_curve_t, method_load, method_displacement, parameter_modulus, parameter_gap, &
      & parameter_imperfection, parameter_ea, parameter_ei, parameter_constant_load
   use obstacle_types, only: obstacle_t, ground_half_space
   use checked_deck, only: checked_deck_t, definitions_t
   use read_steps, only: read_bound
   implicit none
   private
   public :: read_branch_cards, read_limit_curve_cards

contains

   !> Reads the branches of all steps; a card without SIDE defines two branches.
   subroutine read_branch_cards(deck, model)
      type(checked_deck_t), intent(inout) :: deck       !! contains the monitors
      type(model_t), intent(inout) :: model             !! in: steps with their stops; out: also step%branch
      type(definitions_t) :: known                      ! names of the present step's branches
      integer :: step                                   ! the present step
      integer :: n                                      ! number of its cards so far, including those with errors
      step = 0
      n = 0
      do while (deck%next_card('BRANCH', also_bad=.true.))
         if (deck%at%step == 0) cycle
         if (deck%at%step /= step) then
            step = deck%at%step
            known = definitions_t()
            n = 0
         end if
         n = n + 1
         if (.not. deck%at%sound) then
            known%incomplete = .true.
         else if (model%step(step)%n_modes == 0) then
            call read_branch(deck, n, known, model%step(step))
         end if
      end do
   end subroutine read_branch_cards

   !> Reads a card of a branch.
   subroutine read_branch(deck, n, known, step)
      type(checked_deck_t), intent(inout) :: deck
      integer, intent(in) :: n                          ! number of the card in its step
      type(definitions_t), intent(inout) :: known       ! names of the step's branches so far
      type(step_t), intent(inout) :: step
      type(branch_t) :: branch
      character(:), allocatable :: side
      branch%name = 'Branch-'//to_text(n)
      if (deck%given('NAME')) branch%name = deck%text('NAME')
      branch%bifurcation = deck%integer('BIFURCATION')
      branch%mode = deck%integer('MODE')
      if (deck%given('OF')) call find_parent() ! this must be done before the name of the present card is added
      branch%increment = deck%real('INCREMENT')
      ! If the step limits arc lengths, the first increment of a branch must be within the limits.
      if (deck%given('INCREMENT') .and. step%method /= method_load .and. step%method /= method_displacement .and. &
         (branch%increment < step%smallest .or. branch%increment > step%largest)) call deck%wrong('INCREMENT', &
         'INCREMENT must lie between the smallest and the largest arc length of the step: '//to_text(step%smallest)//' to '// &
         to_text(step%largest))
      branch%max_points = step%max_points
      if (deck%given('POINTS')) branch%max_points = deck%integer('POINTS')
      allocate (branch%stop(0))
      do while (deck%next_line())
         call read_bound(deck, branch%stop)
      end do
      if (deck%at%n_lines == 0) branch%stop = step%stop
      if (.not. deck%defines(known, branch%name)) return
      side = deck%word('SIDE')
      branch%both = side == 'BOTH'
      if (side /= 'MINUS') then
         branch%side = 1
         step%branch = [step%branch, branch]
      end if
      if (side /= 'PLUS') then
         branch%side = -1
         step%branch = [step%branch, branch]
      end if

   contains

      !> Finds the branch that parameter OF names: a preceding branch with a single side.
      subroutine find_parent()
         integer :: position
         position = known%find(deck%text('OF'))
         if (position > 0) then
            branch%of = findloc(step%branch%name, known%name(position), 1)
            if (step%branch(branch%of)%both) call deck%wrong('OF', 'branch '//deck%text('OF')// &
               ' has two sides; give it SIDE=PLUS or MINUS')
         else if (.not. known%incomplete) then
            call deck%wrong('OF', 'branch '//deck%text('OF')//' is not defined above this line in the step')
         end if
      end subroutine find_parent
   end subroutine read_branch

   !> Reads the limit curves of all steps.
   subroutine read_limit_curve_cards(deck, model)
      type(checked_deck_t), intent(inout) :: deck       !! contains all other definitions
      type(model_t), intent(inout) :: model             !! in: complete; out: also step%limit_curve
      type(limit_curve_t) :: curve
      type(definitions_t) :: known
      integer :: n, s
      real(wp) :: start
      logical :: ok
      n = 0
      do while (deck%next_card('LIMIT CURVE', also_bad=.true.))
         n = n + 1
         s = deck%at%step
         if (s == 0 .or. .not. deck%at%sound) cycle
         if (model%step(s)%n_modes > 0) cycle ! another procedure reports this error
         if (model%step(s)%method == method_load) call deck%wrong_card(&
            'the step has METHOD=LOAD, which ends where it meets a limit point')
         curve = limit_curve_t(name='Curve-'//to_text(n))
         allocate (curve%element(0), curve%at(0))
         if (deck%given('NAME')) curve%name = deck%text('NAME')
         ok = deck%defines(known, curve%name)
         curve%limit_point = deck%integer('LIMIT')
         curve%max_points = deck%integer('POINTS')
         curve%logarithmic = deck%word('SCALE') == 'LOG'
         curve%to_rigid = deck%given('RIGID')
         curve%parameter = deck%integer('PARAMETER')
         call find_start(deck, model, curve, start, ok)
         if (deck%next_line()) call read_increments(deck, start, ok, curve)
         model%step(s)%limit_curve = [model%step(s)%limit_curve, curve]
      end do
   end subroutine read_limit_curve_cards

   !> Reads the obstacle or element set to which the varied parameter belongs, and finds the present value of the parameter in the
   !> model.
   subroutine find_start(deck, model, curve, start, ok)
      type(checked_deck_t), intent(inout) :: deck
      type(model_t), intent(in) :: model
      type(limit_curve_t), intent(inout) :: curve
      real(wp), intent(out) :: start ! present value of the parameter; 1 for factors
      logical, intent(out) :: ok     ! false: the value is unknown because of an error
      logical :: touched
      start = 1.0_wp
      ok = .false.
      touched = .false.
      if (deck%given('OBSTACLE')) call deck%touched_obstacle('OBSTACLE', curve%obstacle, touched)
      if (deck%given('ELSET')) then
         curve%element = deck%elements('ELSET')
         curve%set = deck%text('ELSET')
      end if
      select case (curve%parameter)
      case (parameter_modulus)
         if (curve%obstacle > 0) call find_modulus(model%obstacle(curve%obstacle))
      case (parameter_gap)
         if (touched .and. .not. deck%names%contacts_incomplete) call find_gap(model%obstacle(curve%obstacle))
      case (parameter_imperfection)
         if (size(curve%element) > 0) call check_imperfection(curve%element)
      case (parameter_ea, parameter_ei)
         if (size(curve%element) > 0 .and. .not. deck%names%sections_incomplete) call find_stiffness()
      case (parameter_constant_load)
         call check_constant_load(deck%at%step)
      end select

   contains

      !> Present value of the parameter MODULUS: modulus of a Winkler or Pasternak foundation.
      subroutine find_modulus(ground)
         type(obstacle_t), intent(in) :: ground
         character(:), allocatable :: instead
         start = ground%modulus
         ok = start > 0.0_wp
         if (ok) return
         instead = ' has a law'
         if (ground%rigid) instead = ' is rigid'
         if (ground%ground == ground_half_space) instead = ' is a half-space'
         call deck%wrong('OBSTACLE', 'obstacle '//trim(ground%name)//instead//'; MODULUS needs FOUNDATION=WINKLER or PASTERNAK')
      end subroutine find_modulus

      !> Present value of the parameter GAP: all contacts with the obstacle must have the same gap.
      subroutine find_gap(obstacle)
         type(obstacle_t), intent(in) :: obstacle
         real(wp) :: greatest
         start = minval(model%contact%gap, mask=model%contact%obstacle == curve%obstacle)
         greatest = maxval(model%contact%gap, mask=model%contact%obstacle == curve%obstacle)
         ok = .not. (obstacle%bilateral .or. greatest > start)
         if (obstacle%bilateral) then
            call deck%wrong('OBSTACLE', trim(obstacle%name)// &
               ' is BILATERAL: it holds its candidates where they begin, whatever the gap')
         else if (.not. ok) then
            call deck%wrong('OBSTACLE', 'the contacts with '//trim(obstacle%name)// &
               ' have different gaps, from '//to_text(start)//' to '//to_text(greatest)//'; a curve needs one gap')
         end if
      end subroutine find_gap

      !> Present value of the parameter EA or EI: stiffness of the section assigned to the set.
      subroutine find_stiffness()
         integer :: i
         start = 0.0_wp
         do i = 1, size(model%section)
            if (same_name(model%section(i)%name, curve%set)) exit
         end do
         if (i > size(model%section)) then
            call deck%wrong('ELSET', 'no *BEAM SECTION names set '//trim(curve%set))
         else if (varies(model%section(i))) then
            call deck%wrong('ELSET', 'the section of set '//trim(curve%set)//' varies, and has no one EA or EI')
         else if (curve%parameter == parameter_ea .and. model%section(i)%inextensible) then
            call deck%wrong('ELSET', 'the rods of set '//trim(curve%set)//' are INEXTENSIBLE and have no EA')
         else
            start = merge(model%section(i)%ea, model%section(i)%ei, curve%parameter == parameter_ea)
            ok = .true.
         end if
      end subroutine find_stiffness

      !> For parameter IMPERFECTION: the set must be a whole chain with an imperfection, from the model part or from a mode in this
      !> step.
      subroutine check_imperfection(element)
         integer, intent(in) :: element(:) ! elements of the set, at least one
         integer :: owner(model%mesh%n_elements) ! (elements) index of the element's imperfection
         integer :: e, i
         ok = deck%names%mesh_incomplete .or. deck%names%imperfections_incomplete
         if (ok) return
         owner = 0
         do e = 1, model%mesh%n_elements
            if (model%mesh%curve(e) > 0) owner(e) = model%curve(model%mesh%curve(e))%imperfection
         end do
         i = owner(element(1))
         ok = i > 0 .and. all(owner(element) == i) .and. count(owner == i) == size(element)
         associate (mode_offset => model%step(deck%at%step)%mode_offset)
            do i = 1, size(mode_offset)
               if (size(mode_offset(i)%element) == size(element)) ok = ok .or. all(mode_offset(i)%element == element)
            end do
         end associate
         if (.not. ok) call deck%wrong('ELSET', 'these are not the elements of an *IMPERFECTION')
      end subroutine check_imperfection

      !> For parameter CONSTANT LOAD: a previous step must have left a load.
      subroutine check_constant_load(s)
         integer, intent(in) :: s ! number of the step
         if (.not. any(model%step(:s - 1)%n_modes == 0)) then
            call deck%wrong('PARAMETER', 'no step with *STATIC stands before this one, so there is no constant load')
         else if (size(model%step(s)%mode_offset) > 0) then
            call deck%wrong('PARAMETER', 'the step begins with the stress-free structure (*IMPERFECTION, SHAPE=MODE), so there '// &
               'is no constant load')
         else
            ok = .true.
         end if
      end subroutine check_constant_load
   end subroutine find_start

   !> Reads the data line: first increment, last value, largest increment, values for additional points.
   subroutine read_increments(deck, start, start_known, curve)
      type(checked_deck_t), intent(inout) :: deck
      real(wp), intent(in) :: start
      logical, intent(in) :: start_known
      type(limit_curve_t), intent(inout) :: curve
      integer :: k
      curve%increment = deck%real('first')
      curve%last = deck%real('last')
      curve%largest = deck%real('largest')
      if (curve%largest < abs(curve%increment)) call deck%wrong('largest', 'the largest increment must not be below the first one')
      if (curve%last <= 0.0_wp) then
         if (curve%logarithmic) then
            call deck%wrong('last', 'SCALE=LOG needs a positive last value')
            return
         else if (any(curve%parameter == [parameter_modulus, parameter_ea, parameter_ei])) then
            call deck%wrong('last', deck%word('PARAMETER')//' must stay positive')
            return
         end if
      end if
      if (.not. start_known) return
      if (curve%logarithmic .and. start <= 0.0_wp) then
         call deck%wrong('SCALE', 'SCALE=LOG needs a positive value to start from, not '//to_text(start))
      else if (.not. abs(curve%last - start) > 0.0_wp) then
         call deck%wrong('last', 'the curve would end where it begins, at '//to_text(start))
      else if (curve%increment * (curve%last - start) < 0.0_wp) then
         call deck%wrong('first', 'the first increment leads away from the last value: from '//to_text(start)//' to '// &
            to_text(curve%last))
      else if (curve%to_rigid .and. curve%last < start) then
         call deck%wrong('RIGID', 'RIGID goes with a modulus that grows')
      end if
      do k = 1, deck%count('value')
         associate (value => deck%real('value', k))
            curve%at = [curve%at, value]
            if ((value - start) * (value - curve%last) >= 0.0_wp) call deck%wrong('value', to_text(value)// &
               ' does not lie between '//to_text(start)//' and '//to_text(curve%last), k)
         end associate
      end do
   end subroutine read_increments
end module read_branches

!> Reads *STEP, *STATIC, *BUCKLE and *CONTROLS: kind, strategy and iteration controls of each step.
module read_steps
   use text, only: to_text, plural
   use model, only: model_t, step_t, quantity_displacement, method_load, method_displacement
   use card_values, only: is_listed
   use checked_deck, only: checked_deck_t
   implicit none
   private
   public :: read_step_cards

   !> Cards that belong to a path, and are therefore allowed only in a step with *STATIC.
   character(*), parameter :: path_cards = 'CONTROLS|STOP|LOCATE|TURNING POINTS|FIELD OUTPUT|BRANCH|LIMIT CURVE|IMPERFECTION'

   !> Number of tangent updates in an increment for NEWTON=FULL, MODIFIED, ONCE.
   integer, parameter :: updates(3) = [huge(1), 0, 1]

contains

   !> Reads names, methods and controls of all steps.
   subroutine read_step_cards(deck, model)
      type(checked_deck_t), intent(inout) :: deck       !! in: contains the monitors; out: also the names of the steps
      type(model_t), intent(inout) :: model             !! in: with monitors; out: also step, without loads and path control
      integer :: s
      allocate (model%step(maxval([0, deck%card(:deck%n_cards)%step])))
      do while (deck%next_card('STEP', also_bad=.true.))
         call name_step(deck, model%step(deck%at%step))
      end do
      deck%at = deck%left_out('CONTROLS')
      do s = 1, size(model%step)
         call read_controls(deck, model%step(s))
      end do
      call deck%rewind()
      do while (deck%next_card('STATIC|BUCKLE|CONTROLS'))
         associate (step => model%step(deck%at%step))
            if (deck%at%keyword == 'STATIC') call read_static(deck, model, step)
            if (deck%at%keyword == 'BUCKLE') call read_buckle(deck, model%fixed, step%n_modes)
            if (deck%at%keyword == 'CONTROLS') call read_controls(deck, step)
         end associate
      end do
      if (.not. deck%names%unknown_cards) call check_kinds(deck)
   end subroutine read_step_cards

   !> Checks that each step either follows a path or computes buckling modes.
   subroutine check_kinds(deck)
      type(checked_deck_t), intent(inout) :: deck
      integer :: static, buckle
      do while (deck%next_card('STEP|STATIC|BUCKLE|'//path_cards, also_bad=.true.))
         if (deck%at%step == 0) cycle
         static = deck%last_card('STATIC', deck%at%step)
         buckle = deck%last_card('BUCKLE', deck%at%step)
         if (static == 0 .and. buckle == 0) then
            if (deck%at%keyword == 'STEP') call deck%wrong_card('the step has neither *STATIC nor *BUCKLE')
         else if (static > 0 .and. buckle > 0) then
            if (deck%at%card == max(static, buckle)) call deck%wrong_card('a step has either *STATIC or *BUCKLE, not both')
         else if (buckle > 0 .and. is_listed(path_cards, deck%at%keyword)) then
            call deck%wrong_card('belongs to a step with *STATIC; this one has *BUCKLE')
         end if
      end do
   end subroutine check_kinds

   !> Sets the name of a step, and makes its lists empty.
   subroutine name_step(deck, step)
      type(checked_deck_t), intent(inout) :: deck
      type(step_t), intent(inout) :: step
      logical :: ok
      step%name = 'Step-'//to_text(deck%at%step)
      if (.not. deck%at%sound) then
         deck%names%step%incomplete = .true.
      else if (deck%given('NAME')) then
         step%name = deck%text('NAME')
      end if
      ok = deck%defines(deck%names%step, step%name)
      allocate (step%stop(0), step%locate(0), step%turning(0), step%branch(0), step%limit_curve(0), step%mode_offset(0))
   end subroutine name_step

   !> Reads *STATIC: strategy, monitor, increments.
   subroutine read_static(deck, model, step)
      type(checked_deck_t), intent(inout) :: deck
      type(model_t), intent(in) :: model
      type(step_t), intent(inout) :: step
      step%method = deck%integer('METHOD')
      step%tangent_updates = updates(deck%integer('NEWTON'))
      step%paper_loop = deck%word('LOOP') == 'PAPER'
      if (deck%given('MONITOR')) then
         step%monitor = deck%named('MONITOR', deck%names%monitor, 'monitor')
         if (step%monitor > 0) then
            if (model%monitor(step%monitor)%quantity /= quantity_displacement) call deck%wrong('MONITOR', 'monitor '// &
               trim(model%monitor(step%monitor)%name)//' is a reaction; displacement control needs U1, U2 or UR')
         end if
      end if
      if (.not. deck%next_line()) return
      step%increment = deck%real('first')
      step%smallest = deck%real('smallest')
      step%smallest_given = deck%given('smallest')
      step%largest = deck%real('largest')
      if (step%method /= method_load .and. step%method /= method_displacement) then
         if (step%smallest >= step%largest) call deck%wrong_line('the smallest arc length must be below the largest one: '// &
            to_text(step%smallest)//', '//to_text(step%largest))
      else if (step%smallest > abs(step%increment) .or. abs(step%increment) > step%largest) then
         call deck%wrong_line('the first increment must lie between the smallest and the largest one: '// &
            to_text(abs(step%increment))//' in '//to_text(step%smallest)//' to '//to_text(step%largest))
      end if
   end subroutine read_static

   !> Reads *BUCKLE: number of modes.
   subroutine read_buckle(deck, fixed, n_modes)
      type(checked_deck_t), intent(inout) :: deck
      logical, intent(in) :: fixed(:, :)
      integer, intent(out) :: n_modes
      n_modes = 0
      if (.not. deck%next_line()) return
      n_modes = deck%integer('modes')
      if (n_modes > count(.not. fixed) .and. .not. deck%names%mesh_incomplete) call deck%wrong('modes', 'there are only '// &
         plural(count(.not. fixed), 'free degree')//' of freedom')
   end subroutine read_buckle

   subroutine read_controls(deck, step)
      type(checked_deck_t), intent(inout) :: deck
      type(step_t), intent(inout) :: step
      step%tolerance = deck%real('TOLERANCE')
      step%tolerance_given = deck%given('TOLERANCE')
      step%locate_tolerance = deck%real('LOCATE')
      step%max_iterations = deck%integer('ITERATIONS')
      step%desired_iterations = deck%integer('DESIRED')
      step%max_points = deck%integer('POINTS')
      if (step%desired_iterations > step%max_iterations) call deck%wrong(&
         trim(merge('DESIRED   ', 'ITERATIONS', deck%given('DESIRED'))), 'DESIRED ('//to_text(step%desired_iterations)// &
         ') must not be above ITERATIONS ('//to_text(step%max_iterations)//')')
   end subroutine read_controls
end module read_steps

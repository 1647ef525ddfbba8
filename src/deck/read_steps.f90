!> Reads *STEP, *STATIC, *BUCKLE and *CONTROLS: kind, method and controls of each step.
module read_steps
   use text, only: to_text, plural
   use model, only: model_t, step_t, quantity_displacement, method_load, method_displacement
   use checked_deck, only: checked_deck_t, cursor_t
   implicit none
   private
   public :: read_step_cards

   !> Cards that belong to a path, and so to a step with *STATIC.
   character(*), parameter :: path_cards = 'CONTROLS|STOP|LOCATE|TURNING POINTS|FIELD OUTPUT|BRANCH|LIMIT CURVE|IMPERFECTION'

   !> Cards of a step. Card 0: not given.
   type :: step_cards_t
      type(cursor_t) :: step, static, buckle
   end type step_cards_t

contains

   !> Reads names, methods and controls of all steps.
   subroutine read_step_cards(deck, model)
      type(checked_deck_t), intent(inout) :: deck       !! with the monitors; receives the names of the steps
      type(model_t), intent(inout) :: model             !! with monitors; receives step without loads and path control
      type(step_cards_t), allocatable :: cards(:)
      type(cursor_t) :: at
      integer :: s
      allocate (cards(0))
      do while (deck%next_card(at, 'STEP', also_bad=.true.))
         cards = [cards, step_cards_t(step=at)]
      end do
      allocate (model%step(size(cards)))
      do s = 1, size(cards)
         call begin_step(deck, cards(s)%step, s, model%step(s))
      end do
      do while (deck%next_card(at, 'STATIC|BUCKLE|CONTROLS', also_bad=.true.))
         s = at%step
         if (s == 0) cycle
         if (at%keyword == 'STATIC') cards(s)%static = at
         if (at%keyword == 'BUCKLE') cards(s)%buckle = at
         if (.not. at%sound) cycle
         if (at%keyword == 'STATIC') call read_static(deck, at, model, model%step(s))
         if (at%keyword == 'BUCKLE') call read_buckle(deck, at, model%fixed, model%step(s)%n_modes)
         if (at%keyword == 'CONTROLS') call read_controls(deck, at, model%step(s))
      end do
      if (deck%names%unknown_cards) return
      do s = 1, size(cards)
         call check_kind(deck, cards(s), s)
      end do
   end subroutine read_step_cards

   !> Checks that a step either follows a path or computes buckling modes.
   subroutine check_kind(deck, cards, s)
      type(checked_deck_t), intent(inout) :: deck
      type(step_cards_t), intent(in) :: cards
      integer, intent(in) :: s
      type(cursor_t) :: at
      if (cards%static%card == 0 .and. cards%buckle%card == 0) then
         call deck%wrong_card(cards%step, 'the step has neither *STATIC nor *BUCKLE')
      else if (cards%static%card > 0 .and. cards%buckle%card > 0) then
         call deck%wrong_card(deck%at_card(max(cards%static%card, cards%buckle%card)), &
            'a step has either *STATIC or *BUCKLE, not both')
      else if (cards%buckle%card > 0) then
         do while (deck%next_card(at, path_cards, also_bad=.true.))
            if (at%step == s) call deck%wrong_card(at, 'belongs to a step with *STATIC; this one has *BUCKLE')
         end do
      end if
   end subroutine check_kind

   !> Sets name and defaults of a step.
   subroutine begin_step(deck, at, s, step)
      type(checked_deck_t), intent(inout) :: deck
      type(cursor_t), intent(in) :: at
      integer, intent(in) :: s
      type(step_t), intent(inout) :: step
      logical :: ok
      step%name = 'Step-'//to_text(s)
      if (.not. at%sound) then
         deck%names%step%incomplete = .true.
      else if (deck%given(at, 'NAME')) then
         step%name = deck%text(at, 'NAME')
      end if
      call deck%define(at, deck%names%step, step%name, ok)
      step%tolerance = deck%default('CONTROLS', 'TOLERANCE')
      step%locate_tolerance = deck%default('CONTROLS', 'LOCATE')
      step%max_iterations = nint(deck%default('CONTROLS', 'ITERATIONS'))
      step%desired_iterations = nint(deck%default('CONTROLS', 'DESIRED'))
      step%max_points = nint(deck%default('CONTROLS', 'POINTS'))
      allocate (step%stop(0), step%locate(0), step%turning(0), step%branch(0), step%limit_curve(0), step%mode_offset(0))
   end subroutine begin_step

   !> Reads *STATIC: method, monitor, increments.
   subroutine read_static(deck, at, model, step)
      type(checked_deck_t), intent(inout) :: deck
      type(cursor_t), intent(inout) :: at
      type(model_t), intent(in) :: model
      type(step_t), intent(inout) :: step
      step%method = deck%integer(at, 'METHOD')
      select case (deck%word(at, 'NEWTON'))
      case ('FULL')
         step%tangent_updates = huge(1)
      case ('MODIFIED')
         step%tangent_updates = 0
      case ('ONCE')
         step%tangent_updates = 1
      end select
      step%paper_loop = deck%word(at, 'LOOP') == 'PAPER'
      if (deck%given(at, 'MONITOR')) then
         step%monitor = deck%named(at, 'MONITOR', deck%names%monitor, 'monitor')
         if (step%monitor > 0) then
            if (model%monitor(step%monitor)%quantity /= quantity_displacement) call deck%wrong(at, 'MONITOR', 'monitor '// &
               trim(model%monitor(step%monitor)%name)//' is a reaction; displacement control needs U1, U2 or UR')
         end if
      end if
      if (.not. deck%next_line(at)) return
      step%increment = deck%real(at, 'first')
      step%smallest = deck%real(at, 'smallest')
      step%smallest_given = deck%given(at, 'smallest')
      step%largest = deck%real(at, 'largest')
      if (step%method /= method_load .and. step%method /= method_displacement) then
         if (step%smallest >= step%largest) call deck%wrong_line(at, 'the smallest arc length must be below the largest one: '// &
            to_text(step%smallest)//', '//to_text(step%largest))
      else if (step%smallest > abs(step%increment) .or. abs(step%increment) > step%largest) then
         call deck%wrong_line(at, 'the first increment must lie between the smallest and the largest one: '// &
            to_text(abs(step%increment))//' in '//to_text(step%smallest)//' to '//to_text(step%largest))
      end if
   end subroutine read_static

   !> Reads *BUCKLE: number of modes.
   subroutine read_buckle(deck, at, fixed, n_modes)
      type(checked_deck_t), intent(inout) :: deck
      type(cursor_t), intent(inout) :: at
      logical, intent(in) :: fixed(:, :)
      integer, intent(out) :: n_modes
      n_modes = 0
      if (.not. deck%next_line(at)) return
      n_modes = deck%integer(at, 'modes')
      if (n_modes > count(.not. fixed) .and. .not. deck%names%mesh_incomplete) call deck%wrong(at, 'modes', 'there are only '// &
         plural(count(.not. fixed), 'free degree')//' of freedom')
   end subroutine read_buckle

   subroutine read_controls(deck, at, step)
      type(checked_deck_t), intent(inout) :: deck
      type(cursor_t), intent(in) :: at
      type(step_t), intent(inout) :: step
      step%tolerance = deck%real(at, 'TOLERANCE')
      step%tolerance_given = deck%given(at, 'TOLERANCE')
      step%locate_tolerance = deck%real(at, 'LOCATE')
      step%max_iterations = deck%integer(at, 'ITERATIONS')
      step%desired_iterations = deck%integer(at, 'DESIRED')
      step%max_points = deck%integer(at, 'POINTS')
      if (step%desired_iterations > step%max_iterations) call deck%wrong(at, &
         trim(merge('DESIRED   ', 'ITERATIONS', deck%given(at, 'DESIRED'))), 'DESIRED ('//to_text(step%desired_iterations)// &
         ') must not be above ITERATIONS ('//to_text(step%max_iterations)//')')
   end subroutine read_controls
end module read_steps

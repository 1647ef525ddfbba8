!> Reads *ACCURACY, and checks the conditions for an omitted number of elements.
module read_accuracy
   use kinds, only: wp
   use text, only: same_name, parse_real
   use model, only: model_t, step_t
   use rod_layout, only: layout_t, new_layout
   use diagnostics, only: diagnostics_t
   use deck_cards, only: deck_t, complain
   use card_values, only: given, default_text, parameter_word, parameter_real, parameter_place, field_place, field_text, &
      & whole_line
   use deck_names, only: deck_names_t, find_named
   implicit none
   private
   public :: read_accuracy_cards, check_placed

   real(wp), parameter :: widest = 0.01_wp       !! widest error bar of a load, over the load, if the deck requests no accuracy
   ! Parts of the requested error. The residual is to be a tenth of the error left by the last correction, see corrector; if the
   ! tolerance turns out to be too large, the iteration is continued.
   real(wp), parameter :: part_of_residual = 1.0e-3_wp, part_of_place = 0.01_wp
   real(wp), parameter :: closest = 1.0e-11_wp   !! smallest tolerance of event locations: below it the event function is rounding
   real(wp), parameter :: coarsest = 1.0e-5_wp   !! largest tolerance of the residual: a tenth of the limit in the balance checks

contains

   !> Sets the error bars and errors that the steps request. If the program makes the mesh, every step has a tolerance.
   subroutine read_accuracy_cards(deck, names, model, diagnostics)
      type(deck_t), intent(in) :: deck
      type(deck_names_t), intent(in) :: names           !! with the monitors
      type(model_t), intent(inout) :: model             !! with its steps
      type(diagnostics_t), intent(inout) :: diagnostics
      integer :: card, s, k
      logical :: makes_mesh, ok
      makes_mesh = any(model%mesh%placed)
      do s = 1, size(model%step)
         associate (step => model%step(s))
            if (makes_mesh) call parse_real(default_text(deck, 'ACCURACY', 'TOLERANCE'), step%asked, ok)
            step%asked_of = [(k, k=0, size(model%monitor))]
            step%widest_bar = merge(step%asked, widest, makes_mesh)
            step%asked_of_path = step%asked
         end associate
      end do
      do card = 1, deck%n_cards
         if (.not. deck%card(card)%sound .or. deck%card(card)%keyword /= 'ACCURACY') cycle
         if (deck%card(card)%step == 0) cycle
         call read_card(deck, names, diagnostics, card, makes_mesh, model%step(deck%card(card)%step))
      end do
      if (makes_mesh) call balance_iteration(deck, model)
   end subroutine read_accuracy_cards

   !> Adjusts the tolerances of the iteration: for a requested error of 1e-3 no residual of 1e-9 is needed. The errors left by
   !> Newton's method and by the location of events become a small part of the requested error. Tolerances given by the deck are
   !> kept.
   subroutine balance_iteration(deck, model)
      type(deck_t), intent(in) :: deck
      type(model_t), intent(inout) :: model
      logical :: locate_given(size(model%step))
      integer :: card, s
      locate_given = .false.
      do card = 1, deck%n_cards
         if (.not. deck%card(card)%sound .or. deck%card(card)%keyword /= 'CONTROLS' .or. deck%card(card)%step == 0) cycle
         locate_given(deck%card(card)%step) = given(deck, card, 'LOCATE')
      end do
      do s = 1, size(model%step)
         associate (step => model%step(s), finest => min(model%step(s)%asked, model%step(s)%asked_of_path))
            if (.not. step%tolerance_given) step%tolerance = max(step%tolerance, min(part_of_residual * finest, coarsest))
            if (.not. locate_given(s)) step%locate_tolerance = max(closest, min(part_of_place * finest, coarsest))
         end associate
      end do
   end subroutine balance_iteration

   !> Reads one card.
   subroutine read_card(deck, names, diagnostics, card, makes_mesh, step)
      type(deck_t), intent(in) :: deck
      type(deck_names_t), intent(in) :: names
      type(diagnostics_t), intent(inout) :: diagnostics
      integer, intent(in) :: card
      logical, intent(in) :: makes_mesh
      type(step_t), intent(inout) :: step
      integer :: line, monitor
      step%error_bars = parameter_word(deck, card, 'POINTS') /= 'NONE'
      step%bars_everywhere = parameter_word(deck, card, 'POINTS') == 'ALL'
      if (makes_mesh .or. given(deck, card, 'TOLERANCE')) then
         step%asked = parameter_real(deck, card, 'TOLERANCE')
         step%widest_bar = step%asked
      end if
      step%asked_of_path = step%asked
      if (given(deck, card, 'PATH')) step%asked_of_path = parameter_real(deck, card, 'PATH')
      if (given(deck, card, 'WIDEST')) step%widest_bar = parameter_real(deck, card, 'WIDEST')
      call check('TOLERANCE', step%asked < 1.0_wp, 'must be below 1')
      call check('PATH', step%asked_of_path < 1.0_wp .or. .not. given(deck, card, 'PATH'), 'must be below 1')
      call check('PATH', .not. given(deck, card, 'PATH') .or. makes_mesh, 'goes with a number of elements that is left out')
      call check('POINTS', step%error_bars .or. .not. makes_mesh, 'must not be NONE where a number of elements is left out')
      if (deck%card(card)%last_line < deck%card(card)%first_line) return
      deallocate (step%asked_of)
      allocate (step%asked_of(0))
      do line = deck%card(card)%first_line, deck%card(card)%last_line
         if (.not. deck%data_line(line)%sound) cycle
         monitor = 0
         if (.not. same_name(field_text(deck, line, 1), 'LOAD')) then
            call find_named(deck, names%monitor, diagnostics, card, field_place(deck, line, 1), 'monitor', monitor, also='LOAD')
            if (monitor == 0) cycle
         end if
         step%asked_of = [step%asked_of, monitor]
      end do

   contains

      subroutine check(name, right, otherwise)
         character(*), intent(in) :: name, otherwise
         logical, intent(in) :: right
         if (.not. right) call complain(deck, diagnostics, card, parameter_place(deck, card, name), name//' '//otherwise)
      end subroutine check
   end subroutine read_card

   !> Checks omitted numbers of elements: an error estimate by elements of the next order must exist, and the nodes must be free to
   !> move along the rod.
   subroutine check_placed(deck, names, model, diagnostics)
      type(deck_t), intent(in) :: deck
      type(deck_names_t), intent(in) :: names           !! with the lines that omit numbers of elements
      type(model_t), intent(in) :: model                !! read completely, without errors
      type(diagnostics_t), intent(inout) :: diagnostics
      type(layout_t) :: layout
      logical :: told(size(names%placed_line))
      character(:), allocatable :: why
      integer :: e, k
      if (.not. any(model%mesh%placed)) return
      layout = new_layout(model)
      told = .false.
      do k = 1, size(layout%rod_segment)
         if (.not. layout%rod_segment(k)%placed) cycle
         e = layout%rod_segment(k)%element(1)
         associate (line => names%placed_line(model%mesh%curve(e)))
            if (told(model%mesh%curve(e))) cycle
            why = why_not(e, layout%rod_segment(k)%free)
            if (why == '') cycle
            told(model%mesh%curve(e)) = .true.
            call complain(deck, diagnostics, deck%data_line(line)%card, whole_line(deck, line), &
               & 'the number of elements cannot be left out here: '//why)
         end associate
      end do

   contains

      !> Reason why the mesh of a rod segment cannot be made for a tolerance; '' if it can.
      function why_not(e, free) result(why)
         integer, intent(in) :: e                ! first element of the segment
         logical, intent(in) :: free
         character(:), allocatable :: why
         logical :: member(model%mesh%n_nodes)
         integer :: c
         why = ''
         do c = 1, size(model%contact)
            member = .false.
            member(model%contact(c)%node) = .true.
            if (.not. all(member(model%mesh%node(:, e)))) cycle
            associate (obstacle => model%obstacle(model%contact(c)%obstacle), contact => model%contact(c))
               if (obstacle%at_nodes) cycle
               if (obstacle%rigid .and. contact%along) cycle
               if (contact%distributed) cycle
               why = 'contact with '//trim(obstacle%name)//' acts at the nodes'
            end associate
         end do
         if (free .or. why /= '') return
         why = 'its nodes have to stay'
      end function why_not
   end subroutine check_placed
end module read_accuracy

!> Translation of a deck to the model: calls all readers in sequence.
!>
!> All cards are read even after errors, so that the user sees all errors at once. Errors that are only consequences of a reported
!> error (a missing node whose line has an error) are not reported. Nothing is read from a deck that cannot be assembled because an
!> included deck or a value is missing.
module deck_to_model
   use model, only: model_t
   use deck_source, only: growing_text_t, deck_source_t
   use diagnostics, only: diagnostics_t
   use deck_assembly, only: assemble_deck
   use deck_cards, only: split_deck, line_end
   use card_check, only: check_cards
   use card_values, only: is_listed
   use checked_deck, only: checked_deck_t
   use read_mesh, only: read_mesh_cards
   use read_imperfections, only: read_imperfection_cards, read_mode_imperfection_cards
   use read_sections, only: read_section_cards, read_distribution_cards
   use read_supports, only: read_support_cards, read_spring_cards, read_gap_cards
   use read_ties, only: read_release_cards, read_tie_cards, order_ties
   use read_obstacles, only: read_foundation_law_cards, read_obstacle_cards
   use wall_pieces, only: join_walls
   use read_contact, only: read_contact_cards, read_soil_cards, choose_contact_points
   use read_monitors, only: read_monitor_cards, read_contact_print_cards, read_accuracy_cards, check_placed
   use read_steps, only: read_step_cards, read_path_cards, check_steps
   use read_loads, only: note_pushed_out, read_load_cards, load_cards
   use read_branches, only: read_branch_cards, read_limit_curve_cards
   use check_contacts, only: check_ground_candidates, check_contact_of_tied_nodes, check_carriers, keep_leaders
   implicit none
   private
   public :: read_deck

contains

   !> Reads and checks a deck.
   subroutine read_deck(source, model, diagnostics, steps_optional, settings)
      type(deck_source_t), intent(inout) :: source     !! in: text as typed; out: assembled
      type(model_t), intent(out) :: model !! model with all components allocated; meaningful only if there are no errors
      type(diagnostics_t), intent(out) :: diagnostics  !! diagnostics%n: number of errors
      logical, intent(in), optional :: steps_optional  !! true: a deck without *STEP is not an error (default: false)
      character(*), intent(in), optional :: settings(:) !! name=value from the command line, which defines ${name} (default: none)
      type(checked_deck_t) :: deck

      if (present(settings)) call assemble_deck(source, settings, diagnostics)
      if (.not. present(settings)) call assemble_deck(source, [character(1) ::], diagnostics)
      if (diagnostics%n > 0) return
      call split_deck(source, deck)
      call check_cards(deck)
      call note_bad_cards(deck)
      call read_model_part(deck, model)
      call read_steps_part(deck, model)
      if (deck%diagnostics%n == 0) call check_contact_of_tied_nodes(deck, model)
      if (deck%diagnostics%n == 0) call check_carriers(deck, model)
      if (deck%diagnostics%n == 0) call choose_contact_points(deck, model)
      if (deck%diagnostics%n == 0) call keep_leaders(model)
      if (deck%diagnostics%n == 0) call check_ground_candidates(deck, model)
      if (deck%diagnostics%n == 0) call check_placed(deck, model)
      ! From here on the contacts are no longer those of the cards.
      if (deck%diagnostics%n == 0) call join_walls(model)
      call check_not_empty(deck, model, steps_optional)
      diagnostics = deck%diagnostics
   end subroutine read_deck

   !> Reads all cards that are allowed before the first *STEP.
   subroutine read_model_part(deck, model)
      type(checked_deck_t), intent(inout) :: deck
      type(model_t), intent(inout) :: model
      logical :: joints_wrong
      integer :: n ! number of errors before the readers whose errors the next call of note_errors counts
      integer :: i
      joints_wrong = .false.
      call read_heading(deck, model)
      call read_mesh_cards(deck, model)
      n = deck%diagnostics%n
      call read_imperfection_cards(deck, model)
      call note_errors(deck%names%imperfections_incomplete)
      call read_release_cards(deck, model)
      call read_tie_cards(deck, model)
      call note_errors(joints_wrong)
      call read_distribution_cards(deck, model)
      call read_section_cards(deck, model)
      call note_errors(deck%names%sections_incomplete)
      call read_support_cards(deck, model)
      call read_spring_cards(deck, model)
      call note_errors(deck%names%supports_incomplete)
      call read_foundation_law_cards(deck, model)
      call read_obstacle_cards(deck, model)
      n = deck%diagnostics%n
      call note_pushed_out(deck)
      call read_contact_cards(deck, model)
      call read_gap_cards(deck, model)
      call read_soil_cards(deck, model)
      call note_errors(deck%names%contacts_incomplete)
      if (.not. joints_wrong) call order_ties(deck, model)
      deck%names%touched = [(any(model%contact%obstacle == i), i=1, size(model%obstacle))]
      call read_monitor_cards(deck, model)
      call read_contact_print_cards(deck, model)

   contains

      !> Marks a kind of definitions as incomplete if errors were added since the last call.
      subroutine note_errors(incomplete)
         logical, intent(inout) :: incomplete
         incomplete = incomplete .or. deck%diagnostics%n > n
         n = deck%diagnostics%n
      end subroutine note_errors
   end subroutine read_model_part

   !> Reads all cards of the steps.
   subroutine read_steps_part(deck, model)
      type(checked_deck_t), intent(inout) :: deck       !! contains the model part
      type(model_t), intent(inout) :: model
      integer :: n
      call read_step_cards(deck, model)
      call read_accuracy_cards(deck, model)
      n = deck%diagnostics%n
      call read_load_cards(deck, model)
      if (deck%diagnostics%n > n) deck%names%loads_incomplete = .true.
      call read_path_cards(deck, model)
      call check_steps(deck, model)
      n = deck%diagnostics%n
      call read_mode_imperfection_cards(deck, model)
      if (deck%diagnostics%n > n) deck%names%imperfections_incomplete = .true.
      call read_branch_cards(deck, model)
      call read_limit_curve_cards(deck, model)
   end subroutine read_steps_part

   !> Reports a deck without cards, elements or steps at its last line that is not blank.
   subroutine check_not_empty(deck, model, steps_optional)
      type(checked_deck_t), intent(inout) :: deck
      type(model_t), intent(in) :: model
      logical, intent(in), optional :: steps_optional
      integer :: last
      logical :: needs_step
      needs_step = .true.
      if (present(steps_optional)) needs_step = .not. steps_optional
      do last = deck%source%n_lines, 2, -1
         if (line_end(deck%source, last) > 0) exit
      end do
      last = max(last, 1)
      if (deck%n_cards == 0 .and. deck%diagnostics%n == 0) call deck%wrong_at_line(last, 'the deck is empty')
      if (deck%n_cards == 0 .or. deck%names%unknown_cards) return
      if (model%mesh%n_elements == 0 .and. .not. deck%names%mesh_incomplete) &
         call deck%wrong_at_line(last, 'the deck ends here and has no elements')
      if (size(model%step) == 0 .and. needs_step) call deck%wrong_at_line(last, 'the deck ends here and has no *STEP')
   end subroutine check_not_empty

   !> Notes which kinds of definitions may be missing because their cards have errors.
   subroutine note_bad_cards(deck)
      type(checked_deck_t), intent(inout) :: deck
      logical :: bad(deck%n_cards)
      integer :: card
      if (deck%diagnostics%n == 0) return
      do card = 1, deck%n_cards
         deck%at = deck%at_card(card)
         bad(card) = .not. (deck%at%sound .and. deck%lines_sound())
      end do
      call deck%rewind()
      associate (names => deck%names)
         names%unknown_cards = deck%n_cards == 0 .or. any(bad .and. deck%card(:deck%n_cards)%spec == 0)
         names%mesh_incomplete = incomplete('NODE|NSET|ELEMENT|ELSET|LINE|ARC|RING|ELLIPSE|SPLINE')
         names%imperfections_incomplete = incomplete('IMPERFECTION')
         names%sections_incomplete = incomplete('MATERIAL|ELASTIC|DENSITY|EXPANSION|BEAM SECTION')
         names%material%incomplete = names%sections_incomplete
         names%distribution%incomplete = incomplete('DISTRIBUTION')
         names%law%incomplete = incomplete('FOUNDATION LAW')
         names%obstacle%incomplete = incomplete('OBSTACLE|GAP')
         names%contacts_incomplete = incomplete('CONTACT|GAP')
         names%monitor%incomplete = incomplete('MONITOR')
         names%supports_incomplete = incomplete('SPRING|RELEASE|MPC|EQUATION|BOUNDARY')
         names%loads_incomplete = incomplete('BOUNDARY|'//load_cards)
      end associate

   contains

      !> True if a card with one of these keywords, between bars, has errors, or if a keyword is unknown.
      logical function incomplete(keywords)
         character(*), intent(in) :: keywords
         incomplete = deck%names%unknown_cards
         do card = 1, deck%n_cards
            if (bad(card)) incomplete = incomplete .or. is_listed(keywords, deck%card(card)%keyword)
         end do
      end function incomplete
   end subroutine note_bad_cards

   !> Reads title, job name, and the names of the units of length and force.
   subroutine read_heading(deck, model)
      type(checked_deck_t), intent(inout) :: deck
      type(model_t), intent(inout) :: model
      type(growing_text_t) :: title
      model%title = ''
      model%job = ''
      model%length_unit = ''
      model%force_unit = ''
      do while (deck%next_card('HEADING'))
         model%job = deck%text('JOB')
         do while (deck%next_line())
            if (title%n > 0) call title%add(new_line('a'))
            call title%add(trim(adjustl(deck%source%line(deck%at%line_at))))
         end do
         if (title%n > 0) model%title = title%text(:title%n)
      end do
      do while (deck%next_card('UNITS'))
         if (.not. deck%next_line()) cycle
         model%length_unit = deck%text('length')
         model%force_unit = deck%text('force')
      end do
   end subroutine read_heading
end module deck_to_model

!> Translation of a deck to the model: the sequence of all readers.
!>
!> All cards are read even after errors, so that the user sees all errors at once. Errors that only follow from a reported one (a
!> missing node whose line is bad) are not reported. Nothing is read from a deck that cannot be assembled because an included deck
!> or a value is missing.
module deck_to_model
   use model, only: model_t
   use deck_source, only: deck_source_t
   use diagnostics, only: diagnostics_t, place_t
   use deck_assembly, only: assemble_deck
   use deck_cards, only: deck_t, split_deck, line_end
   use card_check, only: check_cards
   use card_values, only: parameter_text, field_text
   use deck_names, only: deck_names_t
   use read_mesh, only: read_mesh_cards
   use read_imperfections, only: read_imperfection_cards
   use read_sections, only: read_section_cards
   use read_supports, only: read_support_cards, read_spring_cards
   use read_releases, only: read_release_cards
   use read_ties, only: tie_origin_t, read_tie_cards, order_ties
   use read_foundation_laws, only: read_foundation_law_cards
   use read_obstacles, only: read_obstacle_cards
   use read_contact, only: read_contact_cards, choose_contact_points
   use read_gap_supports, only: read_gap_cards
   use read_contact_prints, only: read_contact_print_cards
   use read_monitors, only: read_monitor_cards
   use read_steps, only: read_step_cards
   use read_loads, only: read_load_cards, is_load_card
   use read_path_control, only: read_path_cards, check_steps
   use read_mode_imperfections, only: read_mode_imperfection_cards
   use read_branches, only: read_branch_cards
   use check_tied_contact, only: check_contact_of_tied_nodes, touch_by_leaders
   use check_grounds, only: check_ground_candidates
   use read_limit_curves, only: read_limit_curve_cards
   use read_accuracy, only: read_accuracy_cards, check_placed
   implicit none
   private
   public :: read_deck

contains

   !> Reads and checks a deck.
   subroutine read_deck(source, model, diagnostics, steps_optional, settings)
      type(deck_source_t), intent(inout) :: source     !! in: text as typed; out: assembled
      type(model_t), intent(out) :: model              !! all components allocated; meaningful only without errors
      type(diagnostics_t), intent(out) :: diagnostics  !! diagnostics%n: number of errors
      logical, intent(in), optional :: steps_optional  !! true: a deck without *STEP is no error (default false)
      character(*), intent(in), optional :: settings(:) !! name=value from the command line, for ${name} (default none)
      type(deck_t) :: deck
      type(deck_names_t) :: names
      type(tie_origin_t), allocatable :: tie_origin(:)
      logical :: joints_sound
      integer :: n

      if (present(settings)) call assemble_deck(source, settings, diagnostics)
      if (.not. present(settings)) call assemble_deck(source, [character(1) ::], diagnostics)
      if (diagnostics%n > 0) return
      call split_deck(source, deck, diagnostics)
      call check_cards(deck, diagnostics)
      call note_bad_cards(deck, diagnostics, names)

      call read_heading(deck, model)
      call read_units(deck, model)
      call read_mesh_cards(deck, names, model, diagnostics)
      n = diagnostics%n
      call read_imperfection_cards(deck, names, model, diagnostics)
      if (diagnostics%n > n) names%imperfections_incomplete = .true.
      n = diagnostics%n
      call read_release_cards(deck, names, model, diagnostics)
      call read_tie_cards(deck, names, model, tie_origin, diagnostics)
      joints_sound = diagnostics%n == n
      n = diagnostics%n
      call read_section_cards(deck, names, model, diagnostics)
      if (diagnostics%n > n) names%sections_incomplete = .true.
      n = diagnostics%n
      call read_support_cards(deck, names, model, diagnostics)
      call read_spring_cards(deck, names, model, diagnostics)
      if (diagnostics%n > n) names%supports_incomplete = .true.
      if (joints_sound) call order_ties(deck, names, tie_origin, model, diagnostics)
      call read_foundation_law_cards(deck, names, model, diagnostics)
      call read_obstacle_cards(deck, names, model, diagnostics)
      n = diagnostics%n
      call read_contact_cards(deck, names, model, diagnostics)
      call read_gap_cards(deck, names, model, diagnostics)
      if (diagnostics%n > n) names%contacts_incomplete = .true.
      call read_monitor_cards(deck, names, model, diagnostics)
      call read_contact_print_cards(deck, names, model, diagnostics)
      call read_step_cards(deck, names, model, diagnostics)
      call read_accuracy_cards(deck, names, model, diagnostics)
      n = diagnostics%n
      call read_load_cards(deck, names, model, diagnostics)
      if (diagnostics%n > n) names%loads_incomplete = .true.
      call read_path_cards(deck, names, model, diagnostics)
      call check_steps(deck, names, model, diagnostics)
      n = diagnostics%n
      call read_mode_imperfection_cards(deck, names, model, diagnostics)
      if (diagnostics%n > n) names%imperfections_incomplete = .true.
      call read_branch_cards(deck, names, model, diagnostics)
      call read_limit_curve_cards(deck, names, model, diagnostics)
      if (diagnostics%n == 0) call check_contact_of_tied_nodes(deck, model, diagnostics)
      if (diagnostics%n == 0) call choose_contact_points(deck, model, diagnostics)
      if (diagnostics%n == 0) call touch_by_leaders(model)
      if (diagnostics%n == 0) call check_ground_candidates(deck, names, model, diagnostics)
      if (diagnostics%n == 0) call check_placed(deck, names, model, diagnostics)

      if (deck%n_cards == 0 .and. diagnostics%n == 0) call diagnostics%add(last_place(source), 'the deck is empty')
      if (deck%n_cards == 0 .or. names%unknown_cards) return
      if (model%mesh%n_elements == 0 .and. .not. names%mesh_incomplete) &
         call diagnostics%add(last_place(source), 'the deck ends here and has no elements')
      if (size(model%step) > 0) return
      if (present(steps_optional)) then
         if (steps_optional) return
      end if
      call diagnostics%add(last_place(source), 'the deck ends here and has no *STEP')
   end subroutine read_deck

   !> The last line that is not blank, as the place of an error about missing cards; the first line of a deck without lines.
   pure type(place_t) function last_place(source) result(place)
      type(deck_source_t), intent(in) :: source
      integer :: line
      place = place_t(max(1, source%n_lines), 1, 1)
      do line = source%n_lines, 1, -1
         if (line_end(source, line) == 0) cycle
         place = place_t(line, 1, line_end(source, line))
         return
      end do
   end function last_place

   !> Notes which kinds of definitions may be missing because their cards have errors.
   subroutine note_bad_cards(deck, diagnostics, names)
      type(deck_t), intent(in) :: deck
      type(diagnostics_t), intent(in) :: diagnostics
      type(deck_names_t), intent(inout) :: names
      integer :: card
      logical :: bad
      if (diagnostics%n == 0) return
      names%unknown_cards = deck%n_cards == 0
      do card = 1, deck%n_cards
         bad = .not. deck%card(card)%sound
         bad = bad .or. .not. all(deck%data_line(deck%card(card)%first_line:deck%card(card)%last_line)%sound)
         if (.not. bad) cycle
         if (deck%card(card)%spec == 0) names%unknown_cards = .true.
         select case (deck%card(card)%keyword)
         case ('NODE', 'NSET', 'ELEMENT', 'ELSET', 'LINE', 'ARC', 'RING')
            names%mesh_incomplete = .true.
         case ('IMPERFECTION')
            names%imperfections_incomplete = .true.
         case ('MATERIAL', 'ELASTIC', 'DENSITY', 'EXPANSION', 'BEAM SECTION')
            names%sections_incomplete = .true.
            names%material%incomplete = .true.
         case ('FOUNDATION LAW')
            names%law%incomplete = .true.
         case ('OBSTACLE')
            names%obstacle%incomplete = .true.
         case ('CONTACT')
            names%contacts_incomplete = .true.
         case ('GAP')
            names%obstacle%incomplete = .true.
            names%contacts_incomplete = .true.
         case ('MONITOR')
            names%monitor%incomplete = .true.
         case ('SPRING', 'RELEASE', 'MPC', 'EQUATION')
            names%supports_incomplete = .true.
         case ('BOUNDARY')
            names%supports_incomplete = .true.
            names%loads_incomplete = .true.
         case default
            if (is_load_card(deck%card(card)%keyword)) names%loads_incomplete = .true.
         end select
      end do
      if (.not. names%unknown_cards) return
      names%mesh_incomplete = .true.
      names%imperfections_incomplete = .true.
      names%sections_incomplete = .true.
      names%material%incomplete = .true.
      names%law%incomplete = .true.
      names%obstacle%incomplete = .true.
      names%contacts_incomplete = .true.
      names%monitor%incomplete = .true.
      names%supports_incomplete = .true.
      names%loads_incomplete = .true.
   end subroutine note_bad_cards

   !> Reads title and job name.
   subroutine read_heading(deck, model)
      type(deck_t), intent(in) :: deck
      type(model_t), intent(inout) :: model
      integer :: card, line, n, i
      model%title = ''
      model%job = ''
      do card = 1, deck%n_cards
         if (.not. deck%card(card)%sound .or. deck%card(card)%keyword /= 'HEADING') cycle
         model%job = parameter_text(deck, card, 'JOB')
         n = 0
         do i = deck%card(card)%first_line, deck%card(card)%last_line
            line = deck%data_line(i)%line
            n = n + deck%source%last(line) - deck%source%first(line) + 2
         end do
         deallocate (model%title)
         allocate (character(n) :: model%title)
         n = 0
         do i = deck%card(card)%first_line, deck%card(card)%last_line
            call append(trim(adjustl(deck%source%line(deck%data_line(i)%line))))
         end do
         model%title = model%title(:n)
      end do

   contains

      !> Appends a line to the title.
      subroutine append(string)
         character(*), intent(in) :: string
         if (n > 0) then
            n = n + 1
            model%title(n:n) = new_line('a')
         end if
         model%title(n + 1:n + len(string)) = string
         n = n + len(string)
      end subroutine append
   end subroutine read_heading

   !> Reads the names of the units of length and force.
   subroutine read_units(deck, model)
      type(deck_t), intent(in) :: deck
      type(model_t), intent(inout) :: model
      integer :: card, line
      model%length_unit = ''
      model%force_unit = ''
      do card = 1, deck%n_cards
         if (.not. deck%card(card)%sound .or. deck%card(card)%keyword /= 'UNITS') cycle
         line = deck%card(card)%first_line
         model%length_unit = field_text(deck, line, 1)
         model%force_unit = field_text(deck, line, 2)
      end do
   end subroutine read_units
end module deck_to_model

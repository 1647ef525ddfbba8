!> Reads *BRANCH: paths that start at a bifurcation of a step.
module read_branches
   use kinds, only: wp
   use text, only: to_text
   use lookup, only: name_list_t
   use model, only: model_t, step_t, branch_t, method_load, method_displacement
   use diagnostics, only: diagnostics_t
   use deck_cards, only: deck_t, complain
   use card_values, only: given, parameter_text, parameter_word, parameter_integer, parameter_real, parameter_place, &
      value_place
   use deck_names, only: deck_names_t
   use read_path_control, only: read_bound
   implicit none
   private
   public :: read_branch_cards

   !> Branches of a step by the names of their cards.
   type :: branch_names_t
      integer :: step = 0
      type(name_list_t) :: list
      integer, allocatable :: branch(:)    !! by name: index of its first branch in step%branch
      logical, allocatable :: two_sides(:) !! by name: true if it has two sides
   end type branch_names_t

contains

   !> Reads the branches of all steps; a card without SIDE defines two branches.
   subroutine read_branch_cards(deck, names, model, diagnostics)
      type(deck_t), intent(in) :: deck
      type(deck_names_t), intent(in) :: names           !! with the monitors
      type(model_t), intent(inout) :: model             !! with steps and their stops; receives step%branch
      type(diagnostics_t), intent(inout) :: diagnostics
      type(branch_names_t) :: known
      integer :: card, n
      n = 0
      do card = 1, deck%n_cards
         if (deck%card(card)%keyword /= 'BRANCH' .or. deck%card(card)%step == 0) cycle
         if (deck%card(card)%step /= known%step) then
            n = 0
            known = branch_names_t(step=deck%card(card)%step, list=name_list_t(), branch=[integer ::], two_sides=[logical ::])
         end if
         n = n + 1
         if (.not. deck%card(card)%sound) then
            known%list%incomplete = .true.
         else if (model%step(known%step)%n_modes == 0) then
            call read_branch(deck, names, diagnostics, card, 'Branch-'//to_text(n), known, model%step(known%step))
         end if
      end do
   end subroutine read_branch_cards

   subroutine read_branch(deck, names, diagnostics, card, default_name, known, step)
      type(deck_t), intent(in) :: deck
      type(deck_names_t), intent(in) :: names
      type(diagnostics_t), intent(inout) :: diagnostics
      integer, intent(in) :: card
      character(*), intent(in) :: default_name
      type(branch_names_t), intent(inout) :: known
      type(step_t), intent(inout) :: step
      type(branch_t) :: branch
      character(:), allocatable :: side
      integer :: line, first, last, position
      logical :: is_new
      branch%name = default_name
      if (given(deck, card, 'NAME')) branch%name = parameter_text(deck, card, 'NAME')
      branch%bifurcation = parameter_integer(deck, card, 'BIFURCATION')
      branch%mode = parameter_integer(deck, card, 'MODE')
      if (given(deck, card, 'OF')) call find_parent(deck, diagnostics, card, known, branch%of) ! before the name of this card is
      ! added
      if (given(deck, card, 'INCREMENT')) then
         branch%increment = parameter_real(deck, card, 'INCREMENT')
         call check_increment(deck, diagnostics, card, branch%increment, step)
      end if
      branch%max_points = step%max_points
      if (given(deck, card, 'POINTS')) branch%max_points = parameter_integer(deck, card, 'POINTS')
      first = deck%card(card)%first_line
      last = deck%card(card)%last_line
      if (last < first) then
         branch%stop = step%stop
      else
         allocate (branch%stop(0))
         do line = first, last
            if (deck%data_line(line)%sound) call read_bound(deck, names, diagnostics, line, branch%stop)
         end do
      end if

      call known%list%add(branch%name, position, is_new)
      if (.not. is_new) then
         call complain(deck, diagnostics, card, parameter_place(deck, card, 'NAME'), &
            'the name '//trim(branch%name)//' is used already in this step')
         return
      end if
      side = parameter_word(deck, card, 'SIDE')
      known%branch = [known%branch, size(step%branch) + 1]
      known%two_sides = [known%two_sides, side == 'BOTH']
      if (side /= 'MINUS') then
         branch%side = 1
         step%branch = [step%branch, branch]
      end if
      if (side /= 'PLUS') then
         branch%side = -1
         step%branch = [step%branch, branch]
      end if
   end subroutine read_branch

   !> The branch named by OF: a preceding one with a single side.
   subroutine find_parent(deck, diagnostics, card, known, parent)
      type(deck_t), intent(in) :: deck
      type(diagnostics_t), intent(inout) :: diagnostics
      integer, intent(in) :: card
      type(branch_names_t), intent(in) :: known
      integer, intent(out) :: parent ! 0: there is none
      character(:), allocatable :: name
      integer :: position
      parent = 0
      name = parameter_text(deck, card, 'OF')
      position = known%list%find(name)
      if (position > 0) then
         parent = known%branch(position)
         if (known%two_sides(position)) call complain(deck, diagnostics, card, value_place(deck, card, 'OF'), 'branch '// &
            name//' has two sides; give it SIDE=PLUS or MINUS')
      else if (.not. known%list%incomplete) then
         call complain(deck, diagnostics, card, value_place(deck, card, 'OF'), 'branch '//name// &
            ' is not defined above this line in the step')
      end if
   end subroutine find_parent

   !> If the step limits arc lengths, the first increment of a branch must be within these limits.
   subroutine check_increment(deck, diagnostics, card, increment, step)
      type(deck_t), intent(in) :: deck
      type(diagnostics_t), intent(inout) :: diagnostics
      integer, intent(in) :: card
      real(wp), intent(in) :: increment
      type(step_t), intent(in) :: step
      if (step%method == method_load .or. step%method == method_displacement) return
      if (increment >= step%smallest .and. increment <= step%largest) return
      call complain(deck, diagnostics, card, parameter_place(deck, card, 'INCREMENT'), 'INCREMENT must lie between the '// &
         'smallest and the largest arc length of the step: '//to_text(step%smallest)//' to '//to_text(step%largest))
   end subroutine check_increment
end module read_branches

!> Reads *BRANCH: paths that start at a bifurcation of a step.
module read_branches
   use text, only: to_text
   use model, only: model_t, step_t, branch_t, method_load, method_displacement
   use checked_deck, only: checked_deck_t
   use deck_names, only: definitions_t
   use read_path_control, only: read_bound
   implicit none
   private
   public :: read_branch_cards

   !> Branches of a step and the names of their cards.
   type :: branch_names_t
      integer :: step = 0
      integer :: n = 0                     !! number of cards so far, including those with errors
      type(definitions_t) :: list
      integer, allocatable :: branch(:)    !! (names) index of the name's first branch in step%branch
      logical, allocatable :: two_sides(:) !! (names) true: the name has branches on two sides
   end type branch_names_t

contains

   !> Reads the branches of all steps; a card without SIDE defines two branches.
   subroutine read_branch_cards(deck, model)
      type(checked_deck_t), intent(inout) :: deck       !! contains the monitors
      type(model_t), intent(inout) :: model             !! in: steps with their stops; out: also step%branch
      type(branch_names_t) :: known
      do while (deck%next_card('BRANCH', also_bad=.true.))
         if (deck%at%step == 0) cycle
         if (deck%at%step /= known%step) then
            known = branch_names_t(step=deck%at%step)
            allocate (known%branch(0), known%two_sides(0))
         end if
         known%n = known%n + 1
         if (.not. deck%at%sound) then
            known%list%incomplete = .true.
         else if (model%step(known%step)%n_modes == 0) then
            call read_branch(deck, known, model%step(known%step))
         end if
      end do
   end subroutine read_branch_cards

   subroutine read_branch(deck, known, step)
      type(checked_deck_t), intent(inout) :: deck
      type(branch_names_t), intent(inout) :: known
      type(step_t), intent(inout) :: step
      type(branch_t) :: branch
      character(:), allocatable :: side
      branch%name = 'Branch-'//to_text(known%n)
      if (deck%given('NAME')) branch%name = deck%text('NAME')
      branch%bifurcation = deck%integer('BIFURCATION')
      branch%mode = deck%integer('MODE')
      if (deck%given('OF')) call find_parent() ! this must be done before the name of the present card is added
      branch%increment = deck%real('INCREMENT')
      if (deck%given('INCREMENT')) call check_increment()
      branch%max_points = step%max_points
      if (deck%given('POINTS')) branch%max_points = deck%integer('POINTS')
      allocate (branch%stop(0))
      do while (deck%next_line())
         call read_bound(deck, branch%stop)
      end do
      if (deck%at%n_lines == 0) branch%stop = step%stop
      if (.not. deck%defines(known%list, branch%name)) return
      side = deck%word('SIDE')
      branch%both = side == 'BOTH'
      known%branch = [known%branch, size(step%branch) + 1]
      known%two_sides = [known%two_sides, branch%both]
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
         position = known%list%find(deck%text('OF'))
         if (position > 0) then
            branch%of = known%branch(position)
            if (known%two_sides(position)) call deck%wrong('OF', 'branch '//deck%text('OF')// &
               ' has two sides; give it SIDE=PLUS or MINUS')
         else if (.not. known%list%incomplete) then
            call deck%wrong('OF', 'branch '//deck%text('OF')//' is not defined above this line in the step')
         end if
      end subroutine find_parent

      !> If the step limits arc lengths, the first increment of a branch must be within the limits.
      subroutine check_increment()
         if (step%method == method_load .or. step%method == method_displacement) return
         if (branch%increment >= step%smallest .and. branch%increment <= step%largest) return
         call deck%wrong('INCREMENT', 'INCREMENT must lie between the smallest and the largest arc length of the step: '// &
            to_text(step%smallest)//' to '//to_text(step%largest))
      end subroutine check_increment
   end subroutine read_branch
end module read_branches

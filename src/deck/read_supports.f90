!> Reads *BOUNDARY in the model part: fixed degrees of freedom (in a step the card prescribes their values); *SPRING; and *GAP:
!> one-sided supports of nodes. Each becomes a candidate for a line obstacle that represents the stops of the card.
module read_supports
   use kinds, only: wp, parallel, degree
   use text, only: to_text
   use model, only: model_t, contact_t, joint_spring_t, complete_joints
   use obstacle_types, only: obstacle_t, obstacle_line
   use item_values, only: component_dof
   use checked_deck, only: checked_deck_t
   use deck_names, only: node_words
   implicit none
   private
   public :: read_support_cards, read_spring_cards, read_gap_cards, read_dofs

   !> (x, y, rotation; words) true for the components that ENCASTRE, PINNED, XSYMM and YSYMM name.
   logical, parameter :: dofs_of_word(3, 4) = reshape([.true., .true., .true., .true., .true., .false., &
      .true., .false., .true., .false., .true., .true.], [3, 4])

contains

   !> Reads the supports.
   subroutine read_support_cards(deck, model)
      type(checked_deck_t), intent(inout) :: deck       !! with the mesh
      type(model_t), intent(inout) :: model             !! receives fixed
      integer, allocatable :: nodes(:)
      logical :: dofs(3)
      integer :: i
      allocate (model%fixed(3, model%mesh%n_nodes), source=.false.)
      do while (deck%next_card('BOUNDARY'))
         if (deck%at%step > 0) cycle
         do while (deck%next_line())
            nodes = deck%nodes('node or set')
            call read_dofs(deck, dofs)
            if (abs(deck%real('value')) > 0.0_wp) call deck%wrong('value', &
               'supports are fixed at zero here; a prescribed value belongs in a step')
            do i = 1, size(nodes)
               model%fixed(:, nodes(i)) = model%fixed(:, nodes(i)) .or. dofs
            end do
         end do
      end do
   end subroutine read_support_cards

   !> Reads the springs.
   subroutine read_spring_cards(deck, model)
      type(checked_deck_t), intent(inout) :: deck       !! with the mesh
      type(model_t), intent(inout) :: model             !! with the supports; receives spring and joint_spring
      character(:), allocatable :: problem
      integer, allocatable :: nodes(:)
      integer :: dof, i
      integer :: other                                  ! second node; 0: the ground
      allocate (model%spring(3, model%mesh%n_nodes), source=0.0_wp)
      call complete_joints(model)
      do while (deck%next_card('SPRING'))
         do while (deck%next_line())
            nodes = deck%nodes('node or set')
            dof = deck%integer('dof')
            other = 0
            if (deck%given('second node')) then
               other = deck%node('second node')
               if (other == 0) cycle
            end if
            do i = 1, size(nodes)
               problem = spring_problem(nodes(i))
               if (problem /= '') then
                  call deck%wrong('node or set', node_words(model%mesh, nodes(i))//' '//problem)
                  exit
               else if (other == 0) then
                  model%spring(dof, nodes(i)) = model%spring(dof, nodes(i)) + deck%real('stiffness')
               else
                  model%joint_spring = [model%joint_spring, joint_spring_t([nodes(i), other], dof, deck%real('stiffness'))]
               end if
            end do
         end do
      end do

   contains

      !> Reason why a node cannot have a spring to the ground or to another node; '' if it can.
      function spring_problem(node) result(problem)
         integer, intent(in) :: node
         character(:), allocatable :: problem
         problem = ''
         if (deck%names%is_loose(node)) problem = 'belongs to no element'
         if (other == 0) then
            if (model%fixed(dof, node)) problem = 'is supported in this degree of freedom already'
         else
            if (node == other) problem = 'is the second node, too'
            if (all(model%fixed(dof, [node, other]))) problem = 'is supported in this degree of freedom, and the second node, too'
            if (deck%names%is_loose(other)) problem = 'has a spring to a node of no element'
         end if
      end function spring_problem
   end subroutine read_spring_cards

   !> Components of a range of degrees of freedom, or of a word of *BOUNDARY; none, and an error is added, if they are invalid.
   subroutine read_dofs(deck, dofs)
      type(checked_deck_t), intent(inout) :: deck !! at a line with the fields dof and last dof
      logical, intent(out) :: dofs(3)  !! (x, y, rotation) true for the components named
      integer :: first, last
      dofs = .false.
      first = deck%integer('dof')
      if (first < 0) then
         if (deck%given('last dof')) then
            call deck%wrong('last dof', 'a last dof does not go with the word '//deck%word('dof'))
            return
         end if
         dofs = dofs_of_word(:, -first)
         return
      end if
      last = first
      if (deck%given('last dof')) last = deck%integer('last dof')
      if (deck%given('last dof') .and. (last < first .or. last > 6)) then
         call deck%wrong('last dof', 'last dof must be from '//to_text(first)//' to 6')
         return
      end if
      dofs = component_dof >= first .and. component_dof <= last
      if (.not. any(dofs)) call deck%wrong('dof', 'a plane rod has the degrees of freedom 1, 2 and 6 only')
   end subroutine read_dofs

   !> Reads the one-sided supports: each card becomes an obstacle, each data line a contact.
   subroutine read_gap_cards(deck, model)
      type(checked_deck_t), intent(inout) :: deck       !! with mesh and laws; receives the names of the cards as those of obstacles
      type(model_t), intent(inout) :: model             !! with supports, obstacles and contacts; receives new obstacles and
      !! contacts
      type(obstacle_t) :: obstacle
      real(wp) :: normal(2)
      integer :: stopped_in(model%mesh%n_nodes)         ! (nodes) line of the deck with the stop, for the card being read; 0: none
      do while (deck%next_card('GAP'))
         if (.not. deck%defines(deck%names%obstacle, deck%text('NAME'))) cycle
         obstacle = obstacle_t()
         obstacle%name = deck%text('NAME')
         obstacle%kind = obstacle_line
         obstacle%at_nodes = .true.
         normal = direction(deck%real('DIRECTION'))
         obstacle%point = reshape([0.0_wp, 0.0_wp, normal(2), -normal(1)], [2, 2])
         obstacle%rigid = .not. (deck%given('STIFFNESS') .or. deck%given('LAW'))
         if (deck%given('STIFFNESS')) obstacle%modulus = deck%real('STIFFNESS')
         if (deck%given('LAW')) obstacle%law = deck%named('LAW', deck%names%law, 'foundation law')
         if (deck%given('STIFFNESS') .and. deck%given('LAW')) call deck%wrong('LAW', 'a stop has either STIFFNESS or LAW')
         model%obstacle = [model%obstacle, obstacle]
         stopped_in = 0
         do while (deck%next_line())
            call read_stops()
         end do
      end do

   contains

      !> Reads a data line: node or set, clearance.
      subroutine read_stops()
         type(contact_t) :: contact
         character(:), allocatable :: problem
         integer :: i
         contact%obstacle = size(model%obstacle)
         contact%gap = deck%real('clearance')
         contact%node = deck%nodes('node or set')
         if (contact%gap < 0.0_wp .and. deck%names%pushed_out%find(obstacle%name) == 0) call deck%wrong('clearance', &
            'a clearance below zero needs *CONTACT INTERFERENCE, SHRINK in a step, which pushes out what penetrates')
         do i = 1, size(contact%node)
            associate (node => contact%node(i))
               problem = ''
               if (deck%names%is_loose(node)) problem = 'belongs to no element'
               if (.not. any(.not. model%fixed(1:2, node) .and. abs(normal) > parallel)) &
                  problem = 'is supported in this direction already'
               if (stopped_in(node) > 0) problem = 'has a stop of this card already, from '// &
                  deck%source%line_words(stopped_in(node))
               stopped_in(node) = deck%at%line_at
               if (problem == '') cycle
               call deck%wrong('node or set', node_words(model%mesh, node)//' '//problem)
            end associate
            exit
         end do
         model%contact = [model%contact, contact]
      end subroutine read_stops
   end subroutine read_gap_cards

   !> Unit vector at an angle [degrees]; exact along the axes.
   pure function direction(angle) result(d)
      real(wp), intent(in) :: angle
      real(wp) :: d(2)
      d = [cos(angle * degree), sin(angle * degree)]
      where (abs(d) < epsilon(d) * max(abs(angle), 1.0_wp)) d = 0.0_wp
      where (abs(d) > 1.0_wp - epsilon(d)) d = sign(1.0_wp, d)
   end function direction
end module read_supports

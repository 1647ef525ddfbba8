!> Reads *RELEASE: element ends that are partly released from a node. They get their own node, which is tied to the first one in the
!> components that are not released.
module read_releases
   use kinds, only: wp
   use model, only: model_t, release_t, joint_spring_t, same_component
   use checked_deck, only: checked_deck_t
   use deck_names, only: take_node_sets, copy_node, node_words
   use read_supports, only: read_dofs
   implicit none
   private
   public :: read_release_cards

   !> Components that the lines of a *RELEASE card release, and the spring in the joint.
   type :: joint_t
      logical :: free(3) = .false.                      !! true for components that are released
      real(wp) :: stiffness = 0.0_wp                    !! stiffness of a spring in the released components; 0: none
      integer :: set = 0                                !! node set to which the new nodes are added; 0: none
   end type joint_t

contains

   !> Reads the releases. They divide chains of elements: cards that need whole chains must be read before.
   subroutine read_release_cards(deck, model)
      type(checked_deck_t), intent(inout) :: deck       !! in: contains mesh; out: also the new nodes
      type(model_t), intent(inout) :: model             !! out: with new nodes, ties, joint_spring and release
      type(joint_t) :: joint
      logical, allocatable :: released(:, :)            ! (2, elements) true: an earlier line releases this end
      integer, allocatable :: nodes(:), elements(:)
      integer :: i
      allocate (released(2, model%mesh%n_elements), source=.false.)
      do while (deck%next_card('RELEASE'))
         joint%set = 0
         if (deck%given('NSET')) call deck%names%node%begin_set(deck%text('NSET'), joint%set)
         do while (deck%next_line())
            nodes = deck%nodes('node or set')
            elements = [integer ::]
            if (deck%given('element or set')) elements = deck%elements('element or set')
            joint%stiffness = deck%real('stiffness')
            call read_free(joint%free)
            if (deck%names%mesh_incomplete .or. .not. any(joint%free)) cycle
            do i = 1, size(nodes)
               if (.not. deck%given('element or set')) then
                  call release_all(nodes(i))
               else if (size(elements) > 0) then
                  call release(nodes(i), ends_of(model, elements, nodes(i)))
               end if
            end do
         end do
      end do
      if (size(model%release) > 0) call take_node_sets(deck%names, model%node_set)

   contains

      !> Reads the components that a line releases. If they are invalid, an error is added and none is released.
      subroutine read_free(free)
         logical, intent(out) :: free(3)
         call read_dofs(deck, free)
         if (.not. all(free)) return
         call deck%wrong('dof', 'nothing would hold the ends to the node')
         free = .false.
      end subroutine read_free

      !> Releases all element ends at a node except the first one, each by a node of its own.
      subroutine release_all(node)
         integer, intent(in) :: node
         logical :: chosen(2, model%mesh%n_elements)
         integer :: e, side, n
         n = 0
         do e = 1, model%mesh%n_elements
            do side = 1, 2
               if (model%mesh%node(side, e) /= node) cycle
               n = n + 1
               if (n == 1) cycle
               chosen = .false.
               chosen(side, e) = .true.
               call release(node, chosen)
            end do
         end do
         if (n < 2) call deck%wrong('node or set', node_words(model%mesh, node)//' has '// &
            trim(merge('one element ', 'no element  ', n == 1))//'; a joint needs a second one')
      end subroutine release_all

      !> Gives the chosen element ends at a node a new common node, by which they remain connected to each other.
      subroutine release(node, chosen)
         integer, intent(in) :: node
         logical, intent(in) :: chosen(:, :)
         character(:), allocatable :: problem
         type(release_t) :: new
         integer :: i
         problem = ''
         if (all(chosen .eqv. (model%mesh%node == node))) problem = 'all ends at '//node_words(model%mesh, node)// &
            ' would be released from it, and none stay: a joint needs a second element (an end that a support lets turn is PINNED)'
         if (.not. any(chosen)) then
            problem = 'no end of these elements is at '//node_words(model%mesh, node)
            if (any(released)) problem = problem//', or it is released already'
         end if
         if (problem /= '') then
            call deck%wrong('node or set', problem)
            return
         end if
         call copy_node(deck%names, model, node)
         new = release_t(node=node, own=model%mesh%n_nodes, free=joint%free)
         where (chosen) model%mesh%node = new%own
         released = released .or. chosen
         model%release = [model%release, new]
         call deck%names%node%append(joint%set, [new%own])
         do i = 1, 3
            if (.not. joint%free(i)) then
               model%tie = [model%tie, same_component(new%own, i, node)]
            else if (joint%stiffness > 0.0_wp) then
               model%joint_spring = [model%joint_spring, joint_spring_t([node, new%own], i, joint%stiffness)]
            end if
         end do
      end subroutine release
   end subroutine read_release_cards

   !> (end, element) true: the element end is at the node and belongs to one of the given elements.
   pure function ends_of(model, elements, node) result(chosen)
      type(model_t), intent(in) :: model
      integer, intent(in) :: elements(:), node
      logical :: chosen(2, model%mesh%n_elements)
      chosen = .false.
      chosen(:, elements) = model%mesh%node(:, elements) == node
   end function ends_of
end module read_releases

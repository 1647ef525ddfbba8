!> Reads *BOUNDARY in the model part (fixed degrees of freedom; in a step the card prescribes their values), *SPRING, and *GAP
!> (one-sided supports). Stops and springs with a force law become candidates for a line obstacle, which represents all of them on a
!> card.
module read_supports
   use kinds, only: wp, parallel, degree
   use text, only: to_text
   use model, only: model_t, contact_t, joint_spring_t, tie_t
   use obstacle_types, only: obstacle_t, obstacle_line, obstacle_circle
   use item_values, only: component_dof
   use checked_deck, only: checked_deck_t, node_words, copy_node
   implicit none
   private
   public :: read_support_cards, read_spring_cards, read_gap_cards, read_dofs

   !> (x, y, rotation; words) true: ENCASTRE, PINNED, XSYMM or YSYMM fixes the component.
   logical, parameter :: dofs_of_word(3, 4) = reshape([.true., .true., .true., .true., .true., .false., &
      .true., .false., .true., .false., .true., .true.], [3, 4])

contains

   !> Reads the supports.
   subroutine read_support_cards(deck, model)
      type(checked_deck_t), intent(inout) :: deck       !! contains the mesh
      type(model_t), intent(inout) :: model             !! out: `fixed` is set
      integer, allocatable :: nodes(:)
      logical :: dofs(3)
      integer :: i
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

   !> Reads the linear springs. A node of a spring is a part of the structure even if it belongs to no element: a rigid body without
   !> mass. The check of the supports (support_check) reports its motions that nothing prevents.
   subroutine read_spring_cards(deck, model)
      type(checked_deck_t), intent(inout) :: deck       !! contains the mesh
      type(model_t), intent(inout) :: model             !! in: contains the supports; out: also spring and joint_spring
      character(:), allocatable :: problem
      integer, allocatable :: nodes(:)
      integer :: dof, i
      integer :: other                                  ! second node; 0: the ground
      do while (deck%next_card('SPRING'))
         if (.not. is_linear_spring(deck)) cycle
         do while (deck%next_line())
            nodes = deck%nodes('node or set')
            dof = deck%integer('dof')
            other = 0
            if (deck%given('second node')) then
               other = deck%node('second node')
               if (other == 0) cycle
            end if
            do i = 1, size(nodes)
               problem = ''
               if (other == 0) then
                  if (model%fixed(dof, nodes(i))) problem = 'is supported in this degree of freedom already'
               else if (all(model%fixed(dof, [nodes(i), other]))) then
                  problem = 'is supported in this degree of freedom, and the second node, too'
               else if (nodes(i) == other) then
                  problem = 'is the second node, too'
               end if
               if (problem /= '') then
                  call deck%wrong('node or set', node_words(model%mesh, nodes(i))//' '//problem)
                  exit
               end if
               deck%names%connected(pack([nodes(i), other], [.true., other > 0])) = .true.
               if (other == 0) then
                  model%spring(dof, nodes(i)) = model%spring(dof, nodes(i)) + deck%real('stiffness')
               else
                  model%joint_spring = [model%joint_spring, joint_spring_t([nodes(i), other], dof, deck%real('stiffness'))]
               end if
            end do
         end do
      end do
   end subroutine read_spring_cards

   !> Components in a range of degrees of freedom, or for a word of *BOUNDARY. If they are invalid, an error is added and none is
   !> true.
   subroutine read_dofs(deck, dofs)
      type(checked_deck_t), intent(inout) :: deck !! deck, with the position at a line that has the fields dof and last dof
      logical, intent(out) :: dofs(3)  !! (x, y, rotation) true: the component is in the range
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

   !> Reads the one-sided supports and the springs with a force law: each card becomes an obstacle, each data line a contact.
   !>
   !> Both are the same: a force law for one relative motion; two-sided for *SPRING, one-sided for *GAP.
   subroutine read_gap_cards(deck, model)
      type(checked_deck_t), intent(inout) :: deck !! in: with mesh and laws; out: names of the cards are added to those of obstacles
      type(model_t), intent(inout) :: model !! in: with supports, obstacles and contacts; out: with new obstacles and contacts, and
      !! with nodes and ties for relative motions
      type(obstacle_t) :: obstacle                      ! obstacle of the present card
      real(wp) :: normal(2)                             ! unit vector of the obstacle's force
      integer, allocatable :: held_in(:)                ! (nodes) line of the deck that names the node on this card; 0: none
      call read_point_laws('GAP')
      call read_point_laws('SPRING')

   contains

      !> Reads the cards of one keyword.
      subroutine read_point_laws(keyword)
         character(*), intent(in) :: keyword
         do while (deck%next_card(keyword))
            if (is_linear_spring(deck)) cycle
            if (.not. deck%defines(deck%names%obstacle, deck%text('NAME'))) cycle
            obstacle = obstacle_t(name=deck%text('NAME'))
            obstacle%kind = obstacle_line
            obstacle%at_nodes = .true.
            obstacle%bilateral = keyword == 'SPRING'
            normal = direction(deck%real('DIRECTION'))
            if (deck%given('ROTATION')) normal = [merge(-1.0_wp, 1.0_wp, deck%word('ROTATION') == 'CLOCKWISE'), 0.0_wp]
            if (count([deck%given('ROTATION'), deck%given('DIRECTION'), deck%given('MEMBER')]) > 1) call deck%wrong_card( &
               'a card acts on the ROTATION, in a DIRECTION, or as a MEMBER')
            if (deck%given('MEMBER')) normal = 1.0_wp   ! a member acts in x and y; place_member sets its direction
            obstacle%point = reshape([0.0_wp, 0.0_wp, normal(2), -normal(1)], [2, 2])
            obstacle%rigid = .not. deck%given('LAW')
            if (deck%given('LAW')) obstacle%law = deck%named('LAW', deck%names%law, 'foundation law')
            if (keyword == 'GAP') then
               if (deck%given('STIFFNESS') .and. deck%given('LAW')) call deck%wrong('LAW', 'a stop has either STIFFNESS or LAW')
               obstacle%rigid = obstacle%rigid .and. .not. deck%given('STIFFNESS')
               obstacle%modulus = deck%real('STIFFNESS')
            end if
            model%obstacle = [model%obstacle, obstacle]
            held_in = spread(0, 1, model%mesh%n_nodes)
            do while (deck%next_line())
               call read_nodes()
               if (deck%given('MEMBER')) call place_member(model%obstacle(size(model%obstacle)))
            end do
         end do
      end subroutine read_point_laws

      !> Makes the obstacle of a member: a circle about the second node that passes through the first node. If the first node is
      !> inside the circle, the member is slack; if outside, it is longer than at the start and pulls.
      subroutine place_member(member)
         type(obstacle_t), intent(inout) :: member
         integer, allocatable :: nodes(:)
         integer :: other
         if (size(model%contact) == 0 .or. .not. deck%given('second node')) then
            call deck%wrong('node or set', 'a member needs a second node')
            return
         end if
         nodes = model%contact(size(model%contact))%node
         other = deck%node('second node')
         if (other == 0 .or. member%kind == obstacle_circle .or. size(nodes) /= 1) then
            call deck%wrong('node or set', 'a card with MEMBER has one line, and one node on it')
            return
         end if
         member%kind = obstacle_circle
         member%centre = model%mesh%x(:, other)
         member%radius = norm2(model%mesh%x(:, nodes(1)) - member%centre)
         member%inside = .true.
         if (.not. member%bilateral) member%inside = deck%word('MEMBER') == 'PULL'
         if (member%radius <= 0.0_wp) call deck%wrong('second node', 'a member between nodes at one place has no direction')
      end subroutine place_member

      !> Reads a data line: node or set, clearance (*GAP), second node. The card connects the second node to the
      !> structure, as a spring does: it may be a node without elements.
      subroutine read_nodes()
         type(contact_t) :: contact
         character(:), allocatable :: problem
         integer :: other, new, i
         logical :: free(3), acts(3)                    ! (x, y, rotation) the supports permit, the card acts on the motion
         acts = [abs(normal) > parallel, .false.]
         if (deck%given('ROTATION')) acts = [.false., .false., .true.]
         contact%obstacle = size(model%obstacle)
         if (.not. obstacle%bilateral) contact%gap = deck%real('clearance')
         contact%node = deck%nodes('node or set')
         if (contact%gap < 0.0_wp .and. deck%names%pushed_out%find(obstacle%name) == 0) call deck%wrong('clearance', &
            'a clearance below zero needs *CONTACT INTERFERENCE, SHRINK in a step, which pushes out what penetrates')
         other = 0
         if (deck%given('second node')) then
            other = deck%node('second node')
            if (other == 0) return
            deck%names%connected(other) = .true.
         end if
         do i = 1, size(contact%node)
            associate (node => contact%node(i))
               problem = ''
               if (deck%names%is_loose(node)) problem = 'belongs to no element'
               free = .not. model%fixed(:, node)
               if (other > 0) free = free .or. .not. model%fixed(:, other)
               if (.not. any(free .and. acts)) problem = 'is supported in this direction already'
               if (held_in(node) > 0) problem = 'is on this card already, from '//deck%source%line_words(held_in(node))
               if (other == node) problem = 'is the second node, too'
               held_in(node) = deck%at%line_at
               if (problem /= '') then
                  call deck%wrong('node or set', node_words(model%mesh, node)//' '//problem)
                  exit
               end if
               if (other > 0 .or. deck%given('ROTATION')) then
                  call make_relative(deck, model, node, other, obstacle%rigid, new)
                  node = new
               end if
            end associate
         end do
         model%contact = [model%contact, contact]
         deck%names%contact_origin = [deck%names%contact_origin, deck%at]
      end subroutine read_nodes
   end subroutine read_gap_cards

   !> True for a *SPRING without a law.
   logical function is_linear_spring(deck)
      type(checked_deck_t), intent(in) :: deck          !! deck, with the position at a card *SPRING or *GAP
      is_linear_spring = deck%at%keyword == 'SPRING' .and. .not. deck%given('LAW')
   end function is_linear_spring

   !> Adds a node whose displacement is that of a node relative to another node, or whose displacement x is the relative rotation.
   !>
   !> A stop or spring between this node and the ground acts between both nodes, with opposite forces. The displacement of the new
   !> node is tied to both nodes. But a rigid stop eliminates a displacement of its node, which must then be an unknown: in this
   !> case one of the two nodes is tied to the other one and the new node; if possible the first one, so that a step may move the
   !> second one.
   subroutine make_relative(deck, model, node, other, rigid, new)
      type(checked_deck_t), intent(inout) :: deck !! deck, with the position at the line that joins the nodes; out: names%tie_origin
      !! is extended
      type(model_t), intent(inout) :: model             !! out: with one more node (the last one), its supports and its ties
      integer, intent(in) :: node, other                !! the two nodes; other = 0: the ground
      logical, intent(in) :: rigid                      !! true: a rigid stop acts on the relative motion
      integer, intent(out) :: new                       !! index of the new node
      integer :: k, part
      call copy_node(deck%names, model, node)
      new = model%mesh%n_nodes
      model%relative = reshape([model%relative, new, node, other], [3, size(model%relative, 2) + 1])
      model%fixed(:, new) = .true.
      do k = 1, 2
         part = k
         if (deck%given('ROTATION')) part = 3
         if (part == 3 .and. k == 2) exit
         model%fixed(k, new) = .false.
         if (.not. rigid) then
            call follow(new, k, [node, other], [part, part], [1.0_wp, -1.0_wp])
         else if (may_follow(node)) then
            call follow(node, part, [new, other], [k, part], [1.0_wp, 1.0_wp])
         else if (may_follow(other)) then
            call follow(other, part, [node, new], [part, k], [1.0_wp, -1.0_wp])
         else
            model%fixed(k, new) = .true.
         end if
      end do

   contains

      !> True if component `part` of a node may be tied.
      logical function may_follow(node)
         integer, intent(in) :: node
         may_follow = node > 0
         if (may_follow) may_follow = .not. (model%fixed(part, node) .or. &
            & any(model%tie%node == node .and. model%tie%component == part))
      end function may_follow

      subroutine follow(node, component, of, parts, factor)
         integer, intent(in) :: node, component
         integer, intent(in) :: of(2), parts(2)         ! nodes and components to which it is tied; 0: the ground
         real(wp), intent(in) :: factor(2)
         model%tie = [model%tie, tie_t(node, component, pack(of, of > 0), pack(parts, of > 0), pack(factor, of > 0))]
         deck%names%tie_origin = [deck%names%tie_origin, deck%at]
      end subroutine follow
   end subroutine make_relative

   !> Unit vector at an angle [degrees]; exact along the axes.
   pure function direction(angle) result(d)
      real(wp), intent(in) :: angle
      real(wp) :: d(2)
      d = [cos(angle * degree), sin(angle * degree)]
      where (abs(d) < epsilon(d) * max(abs(angle), 1.0_wp)) d = 0.0_wp
      where (abs(d) > 1.0_wp - epsilon(d)) d = sign(1.0_wp, d)
   end function direction
end module read_supports

!> Checks that supports, springs and obstacles in contact prevent rigid motion of every part of the structure at the start.
!>
!> The check is geometric. The factored tangent cannot be used, because for a long rod its rounding error is as large as the effect
!> of a missing support.
module support_check
   use kinds, only: wp, parallel
   use text, only: to_text, rounded
   use problem, only: problem_t, touching_gap
   use tied_nodes, only: turned_arm
   use small_dense, only: find_dependent_row
   use obstacle_pose, only: pose_t, about_pivot
   use rod_state, only: state_t, node_position, pose_of, chain_gap, candidate_gap
   implicit none
   private
   public :: movable_part

contains

   !> Message that names a part that can move as a rigid body; '' if no part can. Each element, and each group of elements that
   !> share nodes, is taken as rigid (a part). Three independent constraints fix one part; parts connected by joints need three
   !> times as many constraints as there are parts. A part counts as movable if only forces support it, or if its resistance is of
   !> second order.
   function movable_part(problem, state) result(part)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state       !! state at the start, with its contact set
      character(:), allocatable :: part
      !> Constraints of one group of parts:
      type :: gram_t
         real(wp), allocatable :: of(:, :)     ! sum of row * row^T over all constraints of the group
      end type gram_t
      type(gram_t), allocatable :: gram(:)     ! (groups)
      type(pose_t) :: pose
      integer, allocatable :: member(:), group(:), place(:)
      real(wp), allocatable :: free(:)         ! motion without resistance: in x, in y, rotation times size, of each part
      real(wp) :: gap, normal(2), bend, arm(2), value(2)
      integer :: node, c, i, k, loose
      member = parts(problem)
      call group_parts(problem, member, group, place)
      allocate (gram(maxval(group)))
      do k = 1, size(gram)
         i = 3 * count(group == k)
         allocate (gram(k)%of(i, i), source=0.0_wp)
      end do
      associate (fixed => problem%model%fixed)
         do node = 1, problem%model%mesh%n_nodes
            do i = 1, 3
               if (fixed(i, node) .or. problem%model%spring(i, node) > 0.0_wp) call add([node], motion(i))
            end do
         end do
      end associate
      do c = 1, problem%candidates%n
         if (.not. state%active(c)) cycle
         call candidate_gap(problem, state, c, gap, normal, bend)
         associate (carrier => problem%model%obstacle(problem%candidates%obstacle(c))%carrier)
            if (carrier == 0) call add([problem%candidates%node(c)], [normal, 0.0_wp])
            pose = pose_of(problem, state, problem%candidates%obstacle(c))
            if (carrier > 0) call add([problem%candidates%node(c), carrier], [normal, 0.0_wp, &
               & -about_pivot(pose%arm(node_position(state, problem%candidates%node(c))), normal)])
         end associate
      end do
      ! A foundation in contact resists motion in both directions, as an active candidate does.
      do c = 1, problem%ground%chain%n
         call chain_gap(problem, state, problem%ground%chain, c, gap, normal, bend)
         if (problem%ground%chain%bilateral(c) .or. gap <= touching_gap(problem)) &
            & call add([problem%ground%chain%node(c)], [normal, 0.0_wp])
      end do
      do c = 1, size(problem%model%joint_spring)
         associate (spring => problem%model%joint_spring(c))
            call add(spring%node, [motion(spring%component), -motion(spring%component)])
         end associate
      end do
      do c = 1, size(problem%model%tie)
         associate (tie => problem%model%tie(c))
            if (tie%turner == 0) then
               call add([tie%node, tie%of], [motion(tie%component), [(-tie%factor(k) * motion(tie%part(k)), k=1, size(tie%of))]])
            else
               arm = turned_arm(tie, state%u(3, tie%turner)) / problem%size
               value = [-arm(2), arm(1)]
               call add([tie%node, tie%of, tie%turner], [motion(tie%component), [(-tie%factor(k) * motion(tie%part(k)), k=1, &
                  & size(tie%of))], [0.0_wp, 0.0_wp, -value(tie%component)]])
            end if
         end associate
      end do
      part = ''
      do k = 1, size(gram)
         free = gram(k)%of(:, 1)
         call find_dependent_row(gram(k)%of, loose, free)
         if (loose == 0) cycle
         ! The message names the first node of the part that can move.
         node = findloc(group(member) == k .and. place(member) == (loose + 2) / 3, .true., 1)
         if (.not. any(problem%model%mesh%node == node)) then
            part = 'node '//to_text(problem%model%mesh%node_label(node))//' belongs to no element and can move or turn without '// &
               & 'resistance (*BOUNDARY holds it)'
            return
         end if
         part = 'the part with node '//to_text(problem%model%mesh%node_label(node))//' can move '
         if (count(group == k) == 1) then
            part = part//'as a rigid body'//motion_words(free, problem%size)
         else
            part = part//'without resistance: it and what is joined to it are a mechanism'
         end if
         return
      end do

   contains

      !> Unit vector of a displacement component (1, 2) or of the rotation (3).
      pure function motion(component) result(direction)
         integer, intent(in) :: component
         real(wp) :: direction(3)
         direction = 0.0_wp
         direction(component) = 1.0_wp
      end function motion

      !> Adds the constraint that the sum of `direction` times the motions of some nodes is zero.
      subroutine add(nodes, direction)
         integer, intent(in) :: nodes(:)
         real(wp), intent(in) :: direction(:) !! (3 * number of nodes) coefficients of the motion in x, in y, and of the rotation
         !! times the structure's size
         real(wp) :: x(2), row(3 * maxval(place)), share(3)
         integer :: i, at, k
         k = group(member(nodes(1)))
         row = 0.0_wp
         do i = 1, size(nodes)
            x = node_position(state, nodes(i)) / problem%size
            share = direction(3 * i - 2:3 * i)
            share(3) = share(3) + x(1) * share(2) - x(2) * share(1)
            at = 3 * place(member(nodes(i)))
            row(at - 2:at) = row(at - 2:at) + share
         end do
         associate (sums => gram(k)%of)
            do i = 1, size(sums, 1)
               if (abs(row(i)) > 0.0_wp) sums(:, i) = sums(:, i) + row(:size(sums, 1)) * row(i)
            end do
         end associate
      end subroutine add
   end function movable_part

   !> Words for a rigid-body motion: its direction, or the place about which the structure turns; '' if the motion is zero.
   function motion_words(free, length) result(words)
      real(wp), intent(in) :: free(3)          !! translation in x and y of the place at the origin, rotation times length
      real(wp), intent(in) :: length           !! size of the structure
      character(:), allocatable :: words
      real(wp) :: share(3), place(2)
      words = ''
      if (.not. any(abs(free) > 0.0_wp)) return
      share = free / maxval(abs(free))
      where (abs(share) <= parallel) share = 0.0_wp
      if (abs(share(3)) > 0.0_wp) then
         place = length / share(3) * [-share(2), share(1)]
         ! Removes the minus sign of a negative zero, which the message would show.
         where (.not. abs(place) > 0.0_wp) place = 0.0_wp
         words = ', turning about '//pair(place(1), place(2))
      else if (.not. abs(share(2)) > 0.0_wp) then
         words = ' in x'
      else if (.not. abs(share(1)) > 0.0_wp) then
         words = ' in y'
      else
         words = ' along '//pair(share(1), share(2))
      end if

   contains

      !> Two numbers in brackets, to three digits.
      function pair(x, y) result(text)
         real(wp), intent(in) :: x, y
         character(:), allocatable :: text
         text = '('//rounded(x)//', '//rounded(y)//')'
      end function pair
   end function motion_words

   !> Finds the groups of parts that joints connect, and the index of each part in its group.
   subroutine group_parts(problem, member, group, place)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: member(:)                   !! (nodes) index of the part to which the node belongs
      integer, allocatable, intent(out) :: group(:), place(:) !! (parts) group of each part; index of the part in its group; both
      !! from 1
      integer :: c, i, n
      group = [(i, i=1, maxval(member))]
      do c = 1, size(problem%model%joint_spring)
         call join(problem%model%joint_spring(c)%node)
      end do
      do c = 1, size(problem%model%tie)
         associate (tie => problem%model%tie(c))
            call join([tie%node, tie%of, merge(tie%turner, tie%node, tie%turner > 0)])
         end associate
      end do
      do c = 1, size(problem%ties%follows)
         if (problem%ties%has_blocks(c)) call join([c, problem%ties%of(problem%ties%first(c):problem%ties%first(c + 1) - 1)])
      end do
      allocate (place(size(group)))
      n = 0
      do i = 1, size(group)
         if (group(i) == i) then
            n = n + 1
            where (group(i:) == i) group(i:) = -n
         end if
         place(i) = count(group(:i) == group(i))
      end do
      group = -group

   contains

      !> Merges the groups of some nodes into the group with the lowest index.
      subroutine join(nodes)
         integer, intent(in) :: nodes(:)
         integer :: to, j, from
         to = minval(group(member(nodes)))
         do j = 1, size(nodes)
            from = group(member(nodes(j)))
            if (from /= to) where (group == from) group = to
         end do
      end subroutine join
   end subroutine group_parts

   !> Index of the connected part to which each node belongs, from 1.
   function parts(problem) result(member)
      type(problem_t), intent(in) :: problem
      integer, allocatable :: member(:)
      integer :: e, i, a, b, n
      ! Union-find: every node points to a lower node of its part, and the lowest node to itself.
      n = problem%model%mesh%n_nodes
      member = [(i, i=1, n)]
      do e = 1, problem%model%mesh%n_elements
         a = root(problem%model%mesh%node(1, e))
         b = root(problem%model%mesh%node(2, e))
         member(max(a, b)) = min(a, b)
      end do
      do i = 1, n
         member(i) = root(i)
      end do
      b = 0
      do i = 1, n
         if (member(i) == i) then
            b = b + 1
            member(i) = -b
         else
            member(i) = member(member(i))
         end if
      end do
      member = -member

   contains

      !> Lowest node of the part of a node; shortens the chain of pointers to this node.
      integer function root(node)
         integer, intent(in) :: node
         root = node
         do while (member(root) /= root)
            member(root) = member(member(root))
            root = member(root)
         end do
      end function root
   end function parts
end module support_check

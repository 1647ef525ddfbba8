!> Whether supports, springs and touching obstacles hold every part of the structure against rigid motion at the start.
!>
!> Asked of geometry, not of the factored tangent: rounding in a long rod's tangent is as large as a missing support.
module support_check
   use kinds, only: wp
   use text, only: to_text
   use problem, only: problem_t
   use rod_state, only: state_t, node_position, chain_gap, candidate_gap
   implicit none
   private
   public :: unheld_part

contains

   !> Names a part that can move as a rigid body; '' when all are held. Joints between rods are rigid, so three
   !> independent constraints on displacements or rotation hold a part.
   function unheld_part(problem, state) result(part)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state       !! the start, its contact set included
      character(:), allocatable :: part
      integer, allocatable :: member(:)
      real(wp), allocatable :: gram(:, :, :)
      real(wp) :: gap, normal(2), bend
      integer :: node, c, k
      member = parts(problem)
      allocate (gram(3, 3, maxval(member)), source=0.0_wp)
      associate (fixed => problem%model%fixed)
         do node = 1, problem%model%mesh%n_nodes
            if (fixed(1, node) .or. problem%spring(1, node) > 0.0_wp) call add(node, [1.0_wp, 0.0_wp], 0.0_wp)
            if (fixed(2, node) .or. problem%spring(2, node) > 0.0_wp) call add(node, [0.0_wp, 1.0_wp], 0.0_wp)
            if (fixed(3, node) .or. problem%spring(3, node) > 0.0_wp) call add(node, [0.0_wp, 0.0_wp], 1.0_wp)
         end do
      end associate
      do c = 1, problem%candidates%n
         if (.not. state%active(c)) cycle
         call candidate_gap(problem, state, c, gap, normal, bend)
         call add(problem%candidates%node(c), normal, 0.0_wp)
      end do
      ! A foundation resists where it touches; no sign counts, as for the candidates.
      do c = 1, problem%ground%chain%n
         call chain_gap(problem, state, problem%ground%chain, c, gap, normal, bend)
         if (problem%ground%chain%bilateral(c) .or. gap <= 1.0e-10_wp * problem%size) &
            & call add(problem%ground%chain%node(c), normal, 0.0_wp)
      end do
      part = ''
      do k = 1, size(gram, 3)
         if (rank(gram(:, :, k)) == 3) cycle
         part = 'the part with node '//to_text(problem%model%mesh%node_label(findloc_part(k)))// &
            & ' can move as a rigid body'
         return
      end do

   contains

      !> Adds the constraint "motion along `direction` plus `turn` times rotation vanishes" of a node.
      subroutine add(at, direction, turn)
         integer, intent(in) :: at
         real(wp), intent(in) :: direction(2), turn
         real(wp) :: x(2), row(3)
         integer :: i
         x = node_position(state, at) / problem%size
         row = [direction, turn + x(1) * direction(2) - x(2) * direction(1)]
         do i = 1, 3
            gram(:, i, member(at)) = gram(:, i, member(at)) + row * row(i)
         end do
      end subroutine add

      !> First node of a part.
      integer function findloc_part(number)
         integer, intent(in) :: number
         do findloc_part = 1, size(member)
            if (member(findloc_part) == number) return
         end do
      end function findloc_part
   end function unheld_part

   !> Rank of a symmetric positive semi-definite 3 x 3 matrix by elimination with diagonal pivots.
   pure integer function rank(matrix)
      real(wp), intent(in) :: matrix(3, 3)
      real(wp), parameter :: tolerance = 1.0e-12_wp !! squares of direction cosines: angles of 1e-6 count as parallel
      real(wp) :: a(3, 3), scale
      logical :: used(3)
      integer :: step, p, i
      a = matrix
      scale = a(1, 1) + a(2, 2) + a(3, 3)
      used = .false.
      rank = 0
      do step = 1, 3
         p = 0
         do i = 1, 3
            if (used(i)) cycle
            if (p == 0) p = i
            if (a(i, i) > a(p, p)) p = i
         end do
         if (.not. a(p, p) > tolerance * scale) return
         used(p) = .true.
         rank = rank + 1
         do i = 1, 3
            if (.not. used(i)) a(i, :) = a(i, :) - a(i, p) / a(p, p) * a(p, :)
         end do
      end do
   end function rank

   !> Number of the connected part that each node belongs to, from 1.
   function parts(problem) result(member)
      type(problem_t), intent(in) :: problem
      integer, allocatable :: member(:)
      integer :: e, i, a, b, n
      ! Union of sets: every node points to a lower one of its part, the lowest to itself.
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

      !> The lowest node of a part, shortening the way to it.
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

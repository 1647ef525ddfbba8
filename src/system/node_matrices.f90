!> Stiffness matrices of a few nodes each: springs, loads that follow the structure, contact, rigid links. Together with the element
!> matrices they are the tangent. Each is stated once, and then both added to the band matrix and multiplied by vectors.
module node_matrices
   use kinds, only: wp
   use problem, only: problem_t
   use tied_nodes, only: node_unknowns, spread_force, add_matrix
   use band_matrix, only: band_t
   implicit none
   private
   public :: node_matrix_t, node_matrices_t, add_node_matrices, apply_node_matrices, combined

   integer, parameter :: most_nodes = 3        !! largest number of nodes of a matrix

   !> A symmetric matrix of one or more nodes.
   type :: node_matrix_t
      integer :: n = 0                         !! number of nodes
      integer :: node(most_nodes) = 0
      logical :: relative = .false.            !! true: the unknowns are displacements relative to a carried obstacle
      real(wp) :: k(3 * most_nodes, 3 * most_nodes) = 0.0_wp !! (3 n, 3 n) the matrix in node axes; for tied nodes in global axes
   end type node_matrix_t

   !> A list of such matrices.
   type :: node_matrices_t
      integer :: n = 0
      type(node_matrix_t), allocatable :: list(:) !! the first n entries are in use
   contains
      procedure :: clear
      procedure :: append
   end type node_matrices_t

contains

   !> Removes all matrices.
   pure subroutine clear(self)
      class(node_matrices_t), intent(inout) :: self
      self%n = 0
   end subroutine clear

   !> Appends a matrix.
   pure subroutine append(self, nodes, k, relative)
      class(node_matrices_t), intent(inout) :: self
      integer, intent(in) :: nodes(:)          !! one to three nodes
      real(wp), intent(in) :: k(:, :)          !! (3 * number of nodes, the same) symmetric matrix, see node_matrix_t
      logical, intent(in), optional :: relative !! see node_matrix_t; default: false
      type(node_matrix_t), allocatable :: more(:)
      if (.not. allocated(self%list)) allocate (self%list(4))
      if (self%n == size(self%list)) then
         allocate (more(2 * self%n))
         more(:self%n) = self%list
         call move_alloc(more, self%list)
      end if
      self%n = self%n + 1
      associate (new => self%list(self%n))
         new%n = size(nodes)
         new%node(:new%n) = nodes
         new%k(:3 * new%n, :3 * new%n) = k
         new%relative = .false.
         if (present(relative)) new%relative = relative
      end associate
   end subroutine append

   !> Adds all matrices to a band matrix.
   pure subroutine add_node_matrices(problem, tie_block, slip_block, matrices, band)
      type(problem_t), intent(in) :: problem
      real(wp), intent(in) :: tie_block(:, :, :), slip_block(:, :, :) !! (3, 3, ties) see system_t
      type(node_matrices_t), intent(in) :: matrices
      type(band_t), intent(inout) :: band
      integer :: i
      do i = 1, matrices%n
         associate (matrix => matrices%list(i))
            if (matrix%relative) then
               call add_matrix(problem, slip_block, matrix%node(:matrix%n), matrix%k, band)
            else
               call add_matrix(problem, tie_block, matrix%node(:matrix%n), matrix%k, band)
            end if
         end associate
      end do
   end subroutine add_node_matrices

   !> Adds the products of all matrices with a vector x to y, and x^T times these products to `form`.
   pure subroutine apply_node_matrices(problem, tie_block, slip_block, matrices, x, y, form)
      type(problem_t), intent(in) :: problem
      real(wp), intent(in) :: tie_block(:, :, :), slip_block(:, :, :) !! (3, 3, ties) see system_t
      type(node_matrices_t), intent(in) :: matrices
      real(wp), intent(in) :: x(:)             !! (n) node axes
      real(wp), intent(inout) :: y(:), form    !! (n) products, and x^T y; in/out: these products are added
      integer :: i
      do i = 1, matrices%n
         if (matrices%list(i)%relative) then
            call apply_matrix(problem, slip_block, matrices%list(i), x, y, form)
         else
            call apply_matrix(problem, tie_block, matrices%list(i), x, y, form)
         end if
      end do
   end subroutine apply_node_matrices

   !> Adds the product of one matrix with a vector x to y, and x^T times this product to `form`.
   pure subroutine apply_matrix(problem, block, matrix, x, y, form)
      type(problem_t), intent(in) :: problem
      real(wp), intent(in) :: block(:, :, :)
      type(node_matrix_t), intent(in) :: matrix
      real(wp), intent(in) :: x(:)
      real(wp), intent(inout) :: y(:), form
      real(wp) :: moved(3 * matrix%n), force(3 * matrix%n)
      integer :: i
      do i = 1, matrix%n
         moved(3 * i - 2:3 * i) = node_unknowns(problem, block, matrix%node(i), x)
      end do
      force = matmul(matrix%k(:3 * matrix%n, :3 * matrix%n), moved)
      do i = 1, matrix%n
         call spread_force(problem, block, matrix%node(i), force(3 * i - 2:3 * i), y)
      end do
      form = form + dot_product(moved, force)
   end subroutine apply_matrix

   !> The sum of two lists, each times a factor. Both have matrices of the same nodes in the same order.
   pure type(node_matrices_t) function combined(factor, one, other_factor, other) result(sum)
      real(wp), intent(in) :: factor, other_factor
      type(node_matrices_t), intent(in) :: one, other
      integer :: i
      sum = one
      do i = 1, one%n
         sum%list(i)%k = factor * one%list(i)%k + other_factor * other%list(i)%k
      end do
   end function combined
end module node_matrices

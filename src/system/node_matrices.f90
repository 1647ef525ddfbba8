!> Stiffness matrices of a few nodes each: springs, loads that follow the structure, contact, rigid links. The tangent is their sum
!> with the element matrices. Each matrix is stored once, and then both added to the band matrix and multiplied by vectors.
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
      integer :: first = 1, last = 0           !! range of the matrix's entries in component `entry` of the list
   end type node_matrix_t

   !> A list of symmetric matrices. A matrix of k nodes is (3 k, 3 k), in node axes; rows of tied nodes (nodes whose displacements
   !> follow from those of other nodes) are in global axes.
   type :: node_matrices_t
      integer :: n = 0
      type(node_matrix_t), allocatable :: list(:) !! list of matrices; the first n are in use
      integer :: n_entries = 0
      real(wp), allocatable :: entry(:)        !! the entries of all matrices, one after the other; the first n_entries are in use
   contains
      procedure :: clear
      procedure :: append
   end type node_matrices_t

contains

   !> Removes all matrices.
   pure subroutine clear(self)
      class(node_matrices_t), intent(inout) :: self
      self%n = 0
      self%n_entries = 0
   end subroutine clear

   !> Appends a matrix.
   pure subroutine append(self, nodes, k, relative)
      class(node_matrices_t), intent(inout) :: self
      integer, intent(in) :: nodes(:)          !! one to three nodes
      real(wp), intent(in) :: k(:, :)          !! (3 n, 3 n) symmetric matrix of the n nodes, in the axes of node_matrices_t
      logical, intent(in), optional :: relative !! see node_matrix_t; default: false
      type(node_matrix_t) :: new
      integer :: column
      if (.not. allocated(self%list)) allocate (self%list(4))
      if (.not. allocated(self%entry)) allocate (self%entry(36), source=0.0_wp)
      if (self%n == size(self%list)) self%list = [self%list, self%list] ! the length of the array is doubled
      do while (self%n_entries + size(k) > size(self%entry))
         self%entry = [self%entry, self%entry]
      end do
      new%n = size(nodes)
      new%node(:new%n) = nodes
      if (present(relative)) new%relative = relative
      new%first = self%n_entries + 1
      new%last = self%n_entries + size(k)
      self%n = self%n + 1
      self%list(self%n) = new
      do column = 1, size(k, 2)
         self%entry(self%n_entries + 1:self%n_entries + size(k, 1)) = k(:, column)
         self%n_entries = self%n_entries + size(k, 1)
      end do
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
               call add_entries(problem, slip_block, matrix%node(:matrix%n), matrices%entry(matrix%first:matrix%last), band)
            else
               call add_entries(problem, tie_block, matrix%node(:matrix%n), matrices%entry(matrix%first:matrix%last), band)
            end if
         end associate
      end do
   end subroutine add_node_matrices

   !> Adds one matrix, given by its entries column by column, to a band matrix.
   pure subroutine add_entries(problem, block, nodes, k, band)
      type(problem_t), intent(in) :: problem
      real(wp), intent(in) :: block(:, :, :)
      integer, intent(in) :: nodes(:)
      real(wp), intent(in) :: k(3 * size(nodes), 3 * size(nodes))
      type(band_t), intent(inout) :: band
      call add_matrix(problem, block, nodes, k, band)
   end subroutine add_entries

   !> Adds the products of all matrices with a vector x to y, and x^T times these products to `form`.
   pure subroutine apply_node_matrices(problem, tie_block, slip_block, matrices, x, y, form)
      type(problem_t), intent(in) :: problem
      real(wp), intent(in) :: tie_block(:, :, :), slip_block(:, :, :) !! (3, 3, ties) see system_t
      type(node_matrices_t), intent(in) :: matrices
      real(wp), intent(in) :: x(:)             !! (n) node axes
      real(wp), intent(inout) :: y(:), form    !! (n) products, and x^T y; in/out: these products are added
      integer :: i
      do i = 1, matrices%n
         associate (matrix => matrices%list(i))
            if (matrix%relative) then
               call apply_matrix(problem, slip_block, matrix%node(:matrix%n), matrices%entry(matrix%first:matrix%last), x, y, form)
            else
               call apply_matrix(problem, tie_block, matrix%node(:matrix%n), matrices%entry(matrix%first:matrix%last), x, y, form)
            end if
         end associate
      end do
   end subroutine apply_node_matrices

   !> Adds the product of one matrix with a vector x to y, and x^T times this product to `form`.
   pure subroutine apply_matrix(problem, block, nodes, k, x, y, form)
      type(problem_t), intent(in) :: problem
      real(wp), intent(in) :: block(:, :, :)
      integer, intent(in) :: nodes(:)
      real(wp), intent(in) :: k(3 * size(nodes), 3 * size(nodes)), x(:)
      real(wp), intent(inout) :: y(:), form
      real(wp) :: moved(3 * size(nodes)), force(3 * size(nodes))
      integer :: i
      do i = 1, size(nodes)
         moved(3 * i - 2:3 * i) = node_unknowns(problem, block, nodes(i), x)
      end do
      force = matmul(k, moved)
      do i = 1, size(nodes)
         call spread_force(problem, block, nodes(i), force(3 * i - 2:3 * i), y)
      end do
      form = form + dot_product(moved, force)
   end subroutine apply_matrix

   !> The sum of two lists, each times a factor. The two lists have matrices of the same nodes in the same order.
   pure type(node_matrices_t) function combined(factor, one, other_factor, other) result(sum)
      real(wp), intent(in) :: factor, other_factor
      type(node_matrices_t), intent(in) :: one, other
      integer :: i
      sum = one
      do i = 1, one%n_entries
         sum%entry(i) = factor * one%entry(i) + other_factor * other%entry(i)
      end do
   end function combined
end module node_matrices

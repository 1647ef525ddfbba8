!> Resultants of the loads of each step: sum of the forces and moment about the origin.
module load_sums
   use kinds, only: wp
   use problem, only: problem_t, copy_problem
   use rod_state, only: state_t, new_state, node_position
   use node_loads, only: node_push_t, dead_node_load, node_pushes
   use rod_load_sum, only: load_on_rod
   implicit none
   private
   public :: step_load_sums

   real(wp), parameter :: negligible = 1.0e-12_wp !! a resultant below this part of the sum of absolute values counts as zero

contains

   !> Resultants for each step: force in x and y, and moment about the origin (> 0 anticlockwise) of the step's own loads at load
   !> factor 1 on the stress-free structure. Thermal strains and prescribed displacements of supports or obstacles are not included.
   function step_load_sums(given) result(total)
      type(problem_t), intent(in) :: given         !! problem on the deck's mesh
      real(wp) :: total(3, size(given%model%step))
      type(problem_t) :: problem
      type(state_t) :: state
      type(node_push_t), allocatable :: push(:)
      real(wp) :: force(3), rate(3), size_of(3), reach
      integer :: k, e, i, node
      total = 0.0_wp
      if (size(given%model%step) == 0) return
      call copy_problem(given, problem)
      state = new_state(problem)
      state%load_factor = 1.0_wp
      reach = maxval(norm2(problem%model%mesh%x, 1))
      do k = 1, size(problem%model%step)
         problem%step = k
         size_of = 0.0_wp
         associate (load => problem%model%step(k)%load)
            load%strain = 0.0_wp
            load%curvature = 0.0_wp
         end associate
         do e = 1, problem%model%mesh%n_elements
            call take(load_on_rod(problem, state, e, [0.0_wp, 0.0_wp]))
         end do
         do node = 1, problem%model%mesh%n_nodes
            call dead_node_load(problem, state, node, force, rate)
            call add(node, force)
         end do
         push = node_pushes(problem, state)
         do i = 1, size(push)
            call add(push(i)%node, push(i)%force)
         end do
         ! Sums that cancel except for rounding are set to zero.
         where (abs(total(:, k)) <= negligible * size_of) total(:, k) = 0.0_wp
      end do

   contains

      !> Adds a force and a couple at a node.
      subroutine add(at, f)
         integer, intent(in) :: at
         real(wp), intent(in) :: f(3)
         real(wp) :: x(2)
         x = node_position(state, at)
         call take([f(1:2), f(3) + x(1) * f(2) - x(2) * f(1)])
      end subroutine add

      !> Adds a force and its moment about the origin.
      subroutine take(f)
         real(wp), intent(in) :: f(3)
         total(:, k) = total(:, k) + f
         size_of = size_of + abs(f)
         size_of(3) = size_of(3) + reach * sum(abs(f(1:2)))
      end subroutine take
   end function step_load_sums
end module load_sums

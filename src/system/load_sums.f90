!> Resultants of the loads of each step: sum of the forces and moment about the origin. Loads on elements are summed directly from
!> their definition.
module load_sums
   use kinds, only: wp
   use problem, only: problem_t, copy_problem
   use rod_state, only: state_t, new_state, node_position, element_load
   use node_loads, only: node_push_t, dead_node_load, node_pushes
   use element_families, only: collocates
   use gauss_tableau, only: max_stages
   use rod_load, only: ge_load_t, line_at_stage
   use ge_in_state, only: ge_at
   use ge_stages, only: ge_directions
   use conforming_span, only: conforming_state_t, conforming_forces
   implicit none
   private
   public :: step_load_sums, load_on_rod

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

   !> Resultant force (x, y) of the loads on an element, and their moment about a point.
   function load_on_rod(problem, state, e, middle) result(total)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: e
      real(wp), intent(in) :: middle(2)        !! the point
      real(wp) :: total(3), x(2, 2), place(2, max_stages), direction(2, max_stages), line(2), rate(2)
      type(ge_load_t) :: load
      integer :: i, s
      load = element_load(problem, state, e)
      total = 0.0_wp
      if (.not. allocated(load%more) .and. all(abs([load%line, load%pressure, load%gradient]) <= 0.0_wp)) return
      do i = 1, 2
         x(:, i) = node_position(state, problem%model%mesh%node(i, e)) - middle
      end do
      s = problem%model%mesh%stages(e)
      associate (g => state%geometry%element(e), tab => problem%tableau(max(s, 1)))
         if (.not. collocates(problem%model%mesh%family(e))) then
            call line_at_stage(load, 1, line, rate)
            call add(0.5_wp * (x(:, 1) + x(:, 2)), g%length * line + load%pressure * [x(2, 1) - x(2, 2), x(1, 2) - x(1, 1)])
            return
         end if
         if (problem%conforms(e) > 0) then
            place(:, :s) = conforming_places(problem, state, e, tab%c(:s)) - spread(middle, 2, s)
         else
            direction = ge_directions(tab, ge_at(problem, state, e))
            direction(:, :s) = g%scale * direction(:, :s)
            place(:, :s) = spread(x(:, 1), 2, s) + g%length * matmul(direction(:, :s), transpose(tab%a(:s, :s)))
         end if
         do i = 1, s
            call line_at_stage(load, i, line, rate)
            if (problem%conforms(e) == 0) line = line + (load%pressure + dot_product(load%gradient, place(:, i) - x(:, 1))) * &
               & [-direction(2, i), direction(1, i)]
            call add(place(:, i), g%length * tab%b(i) * line)
         end do
      end associate
      ! The resultant of the pressure on a conforming element depends only on the positions of the ends.
      if (problem%conforms(e) > 0) total = total + load%pressure * [x(2, 1) - x(2, 2), x(1, 2) - x(1, 1), &
         & 0.5_wp * (dot_product(x(:, 2), x(:, 2)) - dot_product(x(:, 1), x(:, 1)))]

   contains

      !> Adds a force and its moment about `middle`; `place` is measured from `middle`.
      subroutine add(place, force)
         real(wp), intent(in) :: place(2), force(2)
         total = total + [force, place(1) * force(2) - place(2) * force(1)]
      end subroutine add
   end function load_on_rod

   !> Deformed positions of points of a conforming element. They have their own procedure, because its work arrays take time to set
   !> up.
   pure function conforming_places(problem, state, e, tau) result(place)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: e
      real(wp), intent(in) :: tau(:)           !! places in the element, 0 to 1 of its stress-free length
      real(wp) :: place(2, size(tau)), local(3)
      type(conforming_state_t) :: kept
      integer :: i
      do i = 1, size(tau)
         call conforming_forces(problem, state, e, tau(i), local, place(:, i), kept=kept)
      end do
   end function conforming_places
end module load_sums

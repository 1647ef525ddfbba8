!> Small structures for the tests of elements, contact and the linearised equations, and Newton's method for them.
!>
!> Unless a test changes it: EA = 100, EI = 1, shear-rigid, no support, no load, no obstacle, one step.
module model_fixture
   use kinds, only: wp
   use model, only: model_t, curve_t, imperfection_t, family_ge, family_ul2, shape_sine, new_load, empty_lists
   use obstacle_types, only: obstacle_circle
   use problem, only: problem_t
   use rod_layout, only: layout_t
   use remeshed_model, only: division_t
   use rod_state, only: state_t
   use linear_system, only: system_t
   use bordered_system, only: linearise, set_path_row, linear_functional, solve_bordered, apply_increment
   use reference_curve, only: curve_point, measure_curves
   use random_numbers, only: random_t, new_random, next_random
   implicit none
   private
   public :: chain_model, line_of, arc_of, bend_sine, add_circle, add_line, solve_at_load, random_values, cross, divided

contains

   !> A straight curve from a point in a direction.
   pure type(curve_t) function line_of(origin, angle, length) result(curve)
      real(wp), intent(in) :: origin(2), angle, length
      curve%origin = origin
      curve%angle = angle
      curve%length = length
   end function line_of

   !> An arc about the origin from polar angle `from` over `sweep` [rad], positive anticlockwise.
   pure type(curve_t) function arc_of(radius, from, sweep) result(curve)
      real(wp), intent(in) :: radius, from, sweep
      real(wp), parameter :: quarter = 1.570796326794896619_wp
      curve%origin = radius * [cos(from), sin(from)]
      curve%angle = from + sign(quarter, sweep)
      curve%curvature = sign(1.0_wp / radius, sweep)
      curve%length = radius * abs(sweep)
   end function arc_of

   !> Equal elements along a curve; node i is the i-th along it, with label 10 i.
   function chain_model(curve, n, stages, closed) result(model)
      type(curve_t), intent(in) :: curve
      integer, intent(in) :: n                    !! elements
      integer, intent(in) :: stages               !! of GE elements
      logical, intent(in), optional :: closed     !! the last element ends at the first node
      type(model_t) :: model
      type(imperfection_t) :: none(0)
      real(wp) :: angle, speed
      integer :: i
      logical :: ring
      ring = .false.
      if (present(closed)) ring = closed
      model%title = ''
      model%job = ''
      associate (mesh => model%mesh)
         mesh%n_elements = n
         mesh%n_nodes = n + 1
         if (ring) mesh%n_nodes = n
         mesh%node_label = [(10 * i, i=1, mesh%n_nodes)]
         mesh%element_label = [(i, i=1, n)]
         allocate (mesh%x(2, mesh%n_nodes), mesh%node(2, n), mesh%s(2, n))
         do i = 1, n
            mesh%s(:, i) = curve%length * [i - 1, i] / n
            mesh%node(:, i) = [i, i + 1]
         end do
         if (ring) mesh%node(2, n) = 1
         do i = 1, mesh%n_nodes
            call curve_point(curve, none, curve%length * (i - 1) / n, mesh%x(:, i), angle, speed)
         end do
         mesh%x_nominal = mesh%x
         mesh%family = [(family_ge, i=1, n)]
         mesh%stages = [(stages, i=1, n)]
         mesh%section = [(1, i=1, n)]
         mesh%curve = [(1, i=1, n)]
         mesh%placed = [(.false., i=1, n)]
      end associate
      call empty_lists(model)
      deallocate (model%section)
      allocate (model%section(1), model%node_set(0), model%step(1))
      model%curve = [curve]
      model%section(1)%ea = 100.0_wp
      model%section(1)%ei = 1.0_wp
      model%step(1)%load = new_load(model%mesh%n_nodes, n, 0)
      allocate (model%step(1)%stop(0), model%step(1)%locate(0), model%step(1)%turning(0), model%step(1)%branch(0), &
         & model%step(1)%limit_curve(0), model%step(1)%mode_offset(0))
   end function chain_model

   !> Gives an open chain one sine imperfection and moves its nodes.
   subroutine bend_sine(model, amplitude, half_waves)
      type(model_t), intent(inout) :: model
      real(wp), intent(in) :: amplitude, half_waves
      real(wp) :: angle, speed
      integer :: e
      deallocate (model%imperfection)
      allocate (model%imperfection(1))
      model%imperfection(1)%shape = shape_sine
      model%imperfection(1)%length = model%curve(1)%length
      model%imperfection(1)%amplitude = [amplitude]
      model%imperfection(1)%half_waves = [half_waves]
      model%imperfection(1)%phase = [0.0_wp]
      model%curve(1)%imperfection = 1
      call measure_curves(model%curve, model%imperfection)
      do e = 1, model%mesh%n_elements
         call curve_point(model%curve(1), model%imperfection, model%mesh%s(1, e), model%mesh%x(:, model%mesh%node(1, e)), &
            & angle, speed)
         call curve_point(model%curve(1), model%imperfection, model%mesh%s(2, e), model%mesh%x(:, model%mesh%node(2, e)), &
            & angle, speed)
      end do
   end subroutine bend_sine

   !> A circle with candidates on it; modulus 0: rigid.
   subroutine add_circle(model, centre, radius, inside, modulus, node)
      type(model_t), intent(inout) :: model
      real(wp), intent(in) :: centre(2), radius, modulus
      logical, intent(in) :: inside
      integer, intent(in) :: node(:)
      call add_contact(model, modulus, node)
      associate (obstacle => model%obstacle(size(model%obstacle)))
         obstacle%kind = obstacle_circle
         obstacle%inside = inside
         obstacle%centre = centre
         obstacle%radius = radius
      end associate
   end subroutine add_circle

   !> A line, its free side on the left, with candidates on it; modulus 0: rigid.
   subroutine add_line(model, first, second, modulus, node)
      type(model_t), intent(inout) :: model
      real(wp), intent(in) :: first(2), second(2), modulus
      integer, intent(in) :: node(:)
      call add_contact(model, modulus, node)
      associate (obstacle => model%obstacle(size(model%obstacle)))
         obstacle%point = reshape([first, second], [2, 2])
      end associate
   end subroutine add_line

   !> One more obstacle, and the contact with it.
   subroutine add_contact(model, modulus, node)
      type(model_t), intent(inout) :: model
      real(wp), intent(in) :: modulus
      integer, intent(in) :: node(:)
      type(model_t) :: old
      integer :: n, s
      n = size(model%obstacle)
      old = model
      deallocate (model%obstacle, model%contact)
      allocate (model%obstacle(n + 1), model%contact(n + 1))
      model%obstacle(:n) = old%obstacle
      model%contact(:n) = old%contact
      model%obstacle(n + 1)%rigid = .not. modulus > 0.0_wp
      model%obstacle(n + 1)%modulus = modulus
      model%contact(n + 1)%obstacle = n + 1
      model%contact(n + 1)%node = node
      do s = 1, size(model%step)
         model%step(s)%load%motion = reshape([model%step(s)%load%motion, 0.0_wp, 0.0_wp], [2, n + 1])
         model%step(s)%load%closing = [model%step(s)%load%closing, 0.0_wp]
         model%step(s)%load%resolved = [model%step(s)%load%resolved, 0.0_wp]
      end do
   end subroutine add_contact

   !> Newton's method at a given load factor, contact set held, `increments` equal steps from the state's own load factor.
   subroutine solve_at_load(problem, state, system, load_factor, increments, ok, tolerance)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(inout) :: state
      type(system_t), intent(inout) :: system     !! assembled and factored at the solution
      real(wp), intent(in) :: load_factor
      integer, intent(in) :: increments
      logical, intent(out) :: ok                  !! the residual fell below the tolerance in every increment
      real(wp), intent(in), optional :: tolerance !! relative; 1e-12 when absent, which only stored forces (GE) can meet
      type(state_t) :: base
      real(wp) :: x(problem%n_unknowns), y, row(3, size(state%u, 2)), start, target, enough
      integer :: i, iteration, e
      enough = 1.0e-12_wp
      if (present(tolerance)) enough = tolerance
      row = 0.0_wp
      x = 0.0_wp
      start = state%load_factor
      do i = 1, increments
         base = state
         target = start + (load_factor - start) * i / increments
         do iteration = 1, 30
            call linearise(problem, state, base, system)
            ok = system%ok
            if (.not. ok) return
            ok = iteration > 1 .and. system%force_residual <= enough .and. system%defect_residual <= 1.0e-14_wp
            if (ok) exit
            call set_path_row(system, linear_functional(problem, system, row, 1.0_wp))
            call solve_bordered(system, -system%residual, system%value, target - state%load_factor, x, y, ok)
            if (.not. ok) return
            call apply_increment(problem, system, x, y, state)
            ok = .false.
         end do
         if (.not. ok) return
         do e = 1, problem%model%mesh%n_elements
            if (problem%model%mesh%family(e) == family_ul2) state%z(:3, e) = system%op(:3, 1, e)
         end do
      end do
   end subroutine solve_at_load

   !> Numbers uniform between -1 and 1, the same on every machine.
   function random_values(seed, n) result(values)
      integer, intent(in) :: seed, n
      real(wp) :: values(n)
      type(random_t) :: generator
      integer :: i
      generator = new_random(seed)
      do i = 1, n
         call next_random(generator, values(i))
      end do
      values = 2.0_wp * values - 1.0_wp
   end function random_values

   !> Every element cut in `parts`; nodes inside moved by up to `transverse_distance` of an element, to and fro.
   function divided(layout, parts, transverse_distance) result(division)
      type(layout_t), intent(in) :: layout
      integer, intent(in) :: parts
      real(wp), intent(in) :: transverse_distance
      type(division_t) :: division(size(layout%rod_segment))
      real(wp) :: part
      integer :: j, i, n, k
      do j = 1, size(division)
         associate (at => layout%rod_segment(j)%at)
            n = parts * (size(at) - 1)
            allocate (division(j)%at(n + 1))
            do i = 0, n
               k = min(i / parts, size(at) - 2)
               part = real(i - parts * k, wp) / parts
               division(j)%at(i + 1) = at(k + 1) + part * (at(k + 2) - at(k + 1))
               if (i > 0 .and. i < n) division(j)%at(i + 1) = division(j)%at(i + 1) + &
                  & transverse_distance * (at(k + 2) - at(k + 1)) / parts * merge(1.0_wp, -0.7_wp, modulo(i, 2) == 0)
            end do
            division(j)%at(n + 1) = layout%rod_segment(j)%length
         end associate
      end do
   end function divided

   !> The third component of a x b.
   pure real(wp) function cross(a, b)
      real(wp), intent(in) :: a(2), b(2)
      cross = a(1) * b(2) - a(2) * b(1)
   end function cross
end module model_fixture

!> Geometrically exact elements GE2 to GE8, as a kind of rod_element_t.
module ge_rod
   use kinds, only: wp
   use problem, only: problem_t
   use rod_state, only: state_t, node_position
   use ge_in_state, only: ge_at
   use rod_profile, only: home_angle
   use rod_element, only: rod_element_t
   use element_foundation, only: foundation_forces
   use inner_forces, only: inner_forces_t
   use gauss_tableau, only: max_stages, raised_values
   use rod_load, only: acts, line_at_stage, line_before
   use ge_data, only: ge_data_t
   use ge_element, only: ge_evaluate, ge_columns
   use ge_stages, only: ge_directions, ge_direction_rates
   use ge_fields, only: ge_end_forces, ge_between, ge_rotation
   implicit none
   private
   public :: ge_rod_t

   !> The geometrically exact elements.
   type, extends(rod_element_t) :: ge_rod_t
   contains
      procedure :: evaluate
      procedure :: end_forces
      procedure :: local_forces
      procedure :: stress_stiffness
      procedure :: load_sum
      procedure :: finer_unknowns
   end type ge_rod_t

contains

   !> Implements rod_element_t%evaluate, where the arguments are described.
   subroutine evaluate(self, problem, state, base, e, f, raw, k, fl, op, defect, ok, inner, shift)
      class(ge_rod_t), intent(in) :: self
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(state_t), intent(in) :: base
      integer, intent(in) :: e
      real(wp), intent(out) :: f(6), raw(6), k(6, 6), fl(6), op(:, :), defect(3)
      logical, intent(out) :: ok
      type(inner_forces_t), intent(inout) :: inner
      real(wp), intent(out) :: shift(6, 2)
      real(wp) :: internal(2)
      call foundation_forces(problem, state, e, inner)
      call ge_evaluate(problem%tableau(problem%model%mesh%stages(e)), ge_at(problem, state, e), inner, f, raw, k, shift, fl, op, &
         & internal, ok)
      defect = [internal(1), 0.0_wp, internal(2)]
   end subroutine evaluate

   !> Implements rod_element_t%end_forces, where the arguments are described.
   subroutine end_forces(self, problem, state, e, first, second)
      class(ge_rod_t), intent(in) :: self
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: e
      real(wp), intent(out) :: first(3), second(3)
      type(inner_forces_t) :: inner
      call foundation_forces(problem, state, e, inner)
      call ge_end_forces(problem%tableau(problem%model%mesh%stages(e)), ge_at(problem, state, e), first, second, inner)
   end subroutine end_forces

   !> Implements rod_element_t%local_forces; the error is O(h^(s+1)) for s stages.
   function local_forces(self, problem, state, e, tau) result(local)
      class(ge_rod_t), intent(in) :: self
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: e
      real(wp), intent(in) :: tau(:)
      real(wp) :: local(3, size(tau))
      real(wp) :: rho(2, max_stages), span(2), resultant(3), angle
      type(ge_data_t) :: element
      integer :: i
      element = ge_at(problem, state, e)
      associate (tab => problem%tableau(problem%model%mesh%stages(e)))
         rho = ge_directions(tab, element)
         do i = 1, size(tau)
            call ge_between(tab, element, rho, tau(i), span, resultant)
            angle = home_angle(problem, element%g, e, tau(i)) + ge_rotation(tab, element, tau(i))
            local(:, i) = [cos(angle) * resultant(1) + sin(angle) * resultant(2), &
               & cos(angle) * resultant(2) - sin(angle) * resultant(1), resultant(3)]
         end do
      end associate
   end function local_forces

   !> Implements rod_element_t%load_sum, where the arguments are described.
   function load_sum(self, problem, state, e, middle) result(total)
      class(ge_rod_t), intent(in) :: self
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: e
      real(wp), intent(in) :: middle(2)
      real(wp) :: total(3)
      real(wp) :: x(2), position(2), direction(2, max_stages), force(2), line(2), rate(2)
      type(ge_data_t) :: element
      integer :: i, s
      element = ge_at(problem, state, e)
      total = 0.0_wp
      if (.not. acts(element%load)) return
      x = node_position(state, problem%model%mesh%node(1, e)) - middle
      s = problem%model%mesh%stages(e)
      associate (h => element%g%length, tab => problem%tableau(s), load => element%load)
         direction = ge_directions(tab, element)
         direction(:, :s) = element%g%scale * direction(:, :s)
         do i = 1, s
            position = x + h * matmul(direction(:, :s), tab%a(i, :s))
            call line_at_stage(load, i, line, rate)
            force = h * tab%b(i) * (line + (load%pressure + dot_product(load%gradient, position - x)) * &
               & [-direction(2, i), direction(1, i)])
            total = total + [force, position(1) * force(2) - position(2) * force(1)]
         end do
      end associate
   end function load_sum

   !> Implements rod_element_t%finer_unknowns, by the collocation polynomials of the section forces.
   function finer_unknowns(self, problem, state, finer, e) result(z)
      class(ge_rod_t), intent(in) :: self
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(problem_t), intent(in) :: finer
      integer, intent(in) :: e
      real(wp) :: z(finer%z_size(e))
      integer :: s
      s = problem%model%mesh%stages(e)
      associate (from => problem%tableau(s), old => state%z(:problem%z_size(e), e))
         z(1:3) = old(1:3)
         z(4:4 + s) = raised_values(from, old(3), old(4:3 + s))
         if (size(z) == 4 + s) return
         z(5 + s:5 + 3 * s:2) = raised_values(from, old(1), old(4 + s:2 + 3 * s:2))
         z(6 + s:6 + 3 * s:2) = raised_values(from, old(2), old(5 + s:3 + 3 * s:2))
      end associate
   end function finer_unknowns

   !> Change of the element's tangent, internal unknowns eliminated, by the stresses of a change `factor` of the load factor. For
   !> factor 0 its derivative, by central differences of sixth order in n h^2/EI, with the section force n and the element's length
   !> h.
   subroutine stress_stiffness(self, problem, state, du, dz, e, factor, k, shift)
      class(ge_rod_t), intent(in) :: self
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      real(wp), intent(in) :: du(6), dz(:)
      integer, intent(in) :: e
      real(wp), intent(in) :: factor
      real(wp), intent(out) :: k(6, 6), shift(6, 2)
      ! Sixth-order difference: (64 D(e/4) - 20 D(e/2) + D(e)) / 45 with D(e) = (K(e) - K(-e)) / 2e and the tangent K(e) under e
      ! times the stresses.
      real(wp), parameter :: sides(6) = [1.0_wp, -1.0_wp, 0.5_wp, -0.5_wp, 0.25_wp, -0.25_wp]
      real(wp), parameter :: weights(6) = [0.5_wp, -0.5_wp, -20.0_wp, 20.0_wp, 128.0_wp, -128.0_wp] / 45.0_wp
      real(wp), parameter :: small = 0.3_wp    !! largest magnitude of n h^2/EI in the difference
      type(ge_data_t) :: element
      real(wp) :: force(2, max_stages), step, largest, line(2), rate(2)
      type(inner_forces_t) :: inner, pressed
      integer :: i, s, z
      element = ge_at(problem, state, e)
      s = problem%model%mesh%stages(e)
      z = element%unknowns
      k = 0.0_wp
      shift = 0.0_wp
      associate (g => element%g, tab => problem%tableau(s), load => element%load, flexible => element%compliance)
         do i = 1, s
            if (z > 3 + s) then
               force(:, i) = dz(2 + s + 2 * i:3 + s + 2 * i)
            else
               call line_before(tab, load, i, line, rate)
               force(:, i) = dz(1:2) - g%length * rate
            end if
         end do
         largest = maxval(abs(force(:, :s))) * g%length**2 * flexible%bending
         largest = max(largest, (abs(load%pressure_rate) + norm2(load%gradient_rate) * g%length) * g%length**3 * flexible%bending)
         call foundation_forces(problem, state, e, inner)
      end associate
      if (.not. largest > 0.0_wp) return
      if (abs(factor) > 0.0_wp) then
         call add(factor, 1.0_wp)
         call add(0.0_wp, -1.0_wp)
      else
         step = small / largest
         do i = 1, size(sides)
            call add(sides(i) * step, weights(i) / step)
         end do
      end if

   contains

      !> Adds, times a weight, the tangent (internal unknowns eliminated) under the stresses of a part of the load change.
      subroutine add(part_of_load, weight)
         real(wp), intent(in) :: part_of_load, weight
         type(ge_data_t) :: shifted
         real(wp) :: f(6), raw(6), part(6, 6), fl(6), op(size(dz), ge_columns), defect(2), moved(6, 2)
         logical :: ok
         shifted = element
         shifted%load%pressure = element%load%pressure + part_of_load * element%load%pressure_rate
         shifted%load%gradient = element%load%gradient + part_of_load * element%load%gradient_rate
         pressed = inner
         if (inner%n > 0) call press(part_of_load)
         call ge_evaluate(problem%tableau(s), shifted, pressed, f, raw, part, moved, fl, op, defect, ok, &
            & more_force=part_of_load * force(:, :s))
         k = k + weight * part
         shift = shift + weight * moved
      end subroutine add

      !> Adds the geometric stiffness of a curved foundation surface under the pressure of a part of the load change.
      subroutine press(part_of_load)
         real(wp), intent(in) :: part_of_load
         real(wp) :: along(2), d(2), rho(2, max_stages), change
         integer :: q
         rho = ge_direction_rates(problem%tableau(s), element, du, dz(:z), 1.0_wp)
         associate (g => element%g)
            do q = 1, inner%n
               d = du(1:2) + g%length * g%scale * matmul(rho(:, :s), inner%basis(:s, q))
               along = [inner%normal(2, q), -inner%normal(1, q)]
               change = part_of_load * inner%bend(q) * inner%spring(q) * (inner%approach(q) - dot_product(inner%normal(:, q), d))
               pressed%sway(:, 1, q) = inner%sway(:, 1, q) - change * along * along(1)
               pressed%sway(:, 2, q) = inner%sway(:, 2, q) - change * along * along(2)
            end do
         end associate
      end subroutine press
   end subroutine stress_stiffness
end module ge_rod

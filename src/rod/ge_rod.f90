!> Geometrically exact elements GE2 to GE8, as a kind of rod_element_t.
module ge_rod
   use kinds, only: wp
   use problem, only: problem_t
   use rod_state, only: state_t, node_position, element_displacement, element_compliance, element_load
   use rod_profile, only: home_angle
   use rod_element, only: rod_element_t
   use element_foundation, only: foundation_forces
   use inner_forces, only: inner_forces_t
   use gauss_tableau, only: max_stages, raised_values
   use rod_load, only: ge_load_t, acts, line_at_stage
   use ge_element, only: ge_evaluate
   use ge_stages, only: ge_directions
   use ge_fields, only: ge_end_forces, ge_interior
   use ge_stress_stiffness, only: ge_stress
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

   !> See rod_element.
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
      associate (g => state%geometry%element(e))
         call ge_evaluate(problem%tableau(problem%model%mesh%stages(e)), g%length, g%scale, g%tangent, &
            & element_compliance(problem, state, e), element_load(problem, state, e), element_displacement(problem, state, e), &
            & state%z(:problem%z_size(e), e), inner, f, raw, k, shift, fl, op, internal, ok)
      end associate
      defect = [internal(1), 0.0_wp, internal(2)]
   end subroutine evaluate

   !> See rod_element.
   subroutine end_forces(self, problem, state, e, first, second)
      class(ge_rod_t), intent(in) :: self
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: e
      real(wp), intent(out) :: first(3), second(3)
      type(inner_forces_t) :: inner
      call foundation_forces(problem, state, e, inner)
      associate (g => state%geometry%element(e))
         call ge_end_forces(problem%tableau(problem%model%mesh%stages(e)), g%length, g%scale, g%tangent, &
            & element_compliance(problem, state, e), &
            & element_load(problem, state, e), element_displacement(problem, state, e), state%z(:problem%z_size(e), e), first, &
            & second, inner)
      end associate
   end subroutine end_forces

   !> See rod_element; error O(h^(s+1)) for s stages.
   function local_forces(self, problem, state, e, tau) result(local)
      class(ge_rod_t), intent(in) :: self
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: e
      real(wp), intent(in) :: tau
      real(wp) :: local(3)
      real(wp) :: span(2), rotation, resultant(3), angle
      associate (g => state%geometry%element(e))
         call ge_interior(problem%tableau(problem%model%mesh%stages(e)), g%length, g%scale, g%tangent, &
            & element_compliance(problem, state, e), &
            & element_load(problem, state, e), element_displacement(problem, state, e), state%z(:problem%z_size(e), e), tau, &
            & span, rotation, resultant)
      end associate
      angle = home_angle(problem, state%geometry%element(e), e, tau) + rotation
      local = [cos(angle) * resultant(1) + sin(angle) * resultant(2), cos(angle) * resultant(2) - sin(angle) * resultant(1), &
         & resultant(3)]
   end function local_forces

   !> See rod_element.
   subroutine stress_stiffness(self, problem, state, du, dz, e, factor, k, shift)
      class(ge_rod_t), intent(in) :: self
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      real(wp), intent(in) :: du(6), dz(:)
      integer, intent(in) :: e
      real(wp), intent(in) :: factor
      real(wp), intent(out) :: k(6, 6), shift(6, 2)
      call ge_stress(problem, state, du, dz, e, factor, k, shift)
   end subroutine stress_stiffness

   !> See rod_element.
   function load_sum(self, problem, state, e, middle) result(total)
      class(ge_rod_t), intent(in) :: self
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: e
      real(wp), intent(in) :: middle(2)
      real(wp) :: total(3)
      real(wp) :: x(2), position(2), direction(2, max_stages), force(2), line(2), rate(2)
      type(ge_load_t) :: load
      integer :: i, s
      load = element_load(problem, state, e)
      total = 0.0_wp
      if (.not. acts(load)) return
      x = node_position(state, problem%model%mesh%node(1, e)) - middle
      s = problem%model%mesh%stages(e)
      associate (g => state%geometry%element(e), h => state%geometry%element(e)%length, tab => problem%tableau(s))
         call ge_directions(tab, h, g%tangent, element_compliance(problem, state, e), load, &
            & element_displacement(problem, state, e), state%z(:problem%z_size(e), e), direction)
         direction(:, :s) = g%scale * direction(:, :s)
         do i = 1, s
            position = x + h * matmul(direction(:, :s), tab%a(i, :s))
            call line_at_stage(load, i, line, rate)
            force = h * tab%b(i) * (line + (load%pressure + dot_product(load%gradient, position - x)) * &
               & [-direction(2, i), direction(1, i)])
            total = total + [force, position(1) * force(2) - position(2) * force(1)]
         end do
      end associate
   end function load_sum

   !> See rod_element: the collocation polynomials of the section forces.
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
end module ge_rod

!> Conforming elements of line contacts, as a kind of rod_element_t.
module conforming_rod
   use kinds, only: wp
   use problem, only: problem_t
   use rod_state, only: state_t, node_position, element_load
   use rod_element, only: rod_element_t
   use element_foundation, only: foundation_forces
   use inner_forces, only: inner_forces_t
   use gauss_tableau, only: raised_values
   use rod_load, only: ge_load_t, acts, line_at_stage
   use conforming_span, only: evaluate_conforming, conforming_state_t, conforming_forces, conforming_resultant
   implicit none
   private
   public :: conforming_rod_t

   !> The conforming elements of line contacts.
   type, extends(rod_element_t) :: conforming_rod_t
   contains
      procedure :: evaluate
      procedure :: end_forces
      procedure :: local_forces
      procedure :: stress_stiffness
      procedure :: load_sum
      procedure :: finer_unknowns
   end type conforming_rod_t

contains

   !> Implements rod_element_t%evaluate, where the arguments are described.
   subroutine evaluate(self, problem, state, base, e, f, raw, k, fl, op, defect, ok, inner, shift)
      class(conforming_rod_t), intent(in) :: self
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(state_t), intent(in) :: base
      integer, intent(in) :: e
      real(wp), intent(out) :: f(6), raw(6), k(6, 6), fl(6), op(:, :), defect(3)
      logical, intent(out) :: ok
      type(inner_forces_t), intent(inout) :: inner
      real(wp), intent(out) :: shift(6, 2)
      real(wp) :: internal(2)
      shift = 0.0_wp
      call foundation_forces(problem, state, e, inner)
      call evaluate_conforming(problem, state, e, inner, f, raw, k, fl, op, internal, ok)
      defect = [0.0_wp, internal]
   end subroutine evaluate

   !> Implements rod_element_t%end_forces, where the arguments are described.
   subroutine end_forces(self, problem, state, e, first, second)
      class(conforming_rod_t), intent(in) :: self
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: e
      real(wp), intent(out) :: first(3), second(3)
      type(conforming_state_t) :: kept
      type(inner_forces_t) :: inner
      call foundation_forces(problem, state, e, inner)
      call conforming_resultant(problem, state, e, 0.0_wp, kept, first)
      call conforming_resultant(problem, state, e, 1.0_wp, kept, second, inner)
   end subroutine end_forces

   !> Implements rod_element_t%local_forces, where the arguments are described.
   function local_forces(self, problem, state, e, tau) result(local)
      class(conforming_rod_t), intent(in) :: self
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: e
      real(wp), intent(in) :: tau(:)
      real(wp) :: local(3, size(tau))
      type(conforming_state_t) :: kept
      integer :: i
      do i = 1, size(tau)
         call conforming_forces(problem, state, e, tau(i), local(:, i), kept=kept)
      end do
   end function local_forces

   !> Implements rod_element_t%stress_stiffness. The result is zero: on an obstacle of constant curvature all strains are linear in
   !> the displacements.
   subroutine stress_stiffness(self, problem, state, du, dz, e, factor, k, shift)
      class(conforming_rod_t), intent(in) :: self
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      real(wp), intent(in) :: du(6), dz(:)
      integer, intent(in) :: e
      real(wp), intent(in) :: factor
      real(wp), intent(out) :: k(6, 6), shift(6, 2)
      k = 0.0_wp
      shift = 0.0_wp
   end subroutine stress_stiffness

   !> Implements rod_element_t%load_sum, where the arguments are described.
   function load_sum(self, problem, state, e, middle) result(total)
      class(conforming_rod_t), intent(in) :: self
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: e
      real(wp), intent(in) :: middle(2)
      real(wp) :: total(3)
      real(wp) :: x(2, 2), position(2), force(2), local(3), line(2), rate(2)
      type(ge_load_t) :: load
      type(conforming_state_t) :: kept
      integer :: i, s
      load = element_load(problem, state, e)
      total = 0.0_wp
      if (.not. acts(load)) return
      do i = 1, 2
         x(:, i) = node_position(state, problem%model%mesh%node(i, e)) - middle
      end do
      s = problem%model%mesh%stages(e)
      associate (h => state%geometry%element(e)%length)
         do i = 1, s
            call conforming_forces(problem, state, e, problem%tableau(s)%c(i), local, position, kept=kept)
            position = position - middle
            call line_at_stage(load, i, line, rate)
            force = h * problem%tableau(s)%b(i) * line
            total = total + [force, position(1) * force(2) - position(2) * force(1)]
         end do
      end associate
      ! The resultant of the pressure depends only on the positions of the ends.
      total = total + load%pressure * [x(2, 1) - x(2, 2), x(1, 2) - x(1, 1), &
         & 0.5_wp * (dot_product(x(:, 2), x(:, 2)) - dot_product(x(:, 1), x(:, 1)))]
   end function load_sum

   !> Implements rod_element_t%finer_unknowns, by the collocation polynomials of force and position.
   function finer_unknowns(self, problem, state, finer, e) result(z)
      class(conforming_rod_t), intent(in) :: self
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(problem_t), intent(in) :: finer
      integer, intent(in) :: e
      real(wp) :: z(finer%z_size(e))
      integer :: s
      s = problem%model%mesh%stages(e)
      associate (from => problem%tableau(s), old => state%z(:problem%z_size(e), e))
         z(1) = old(1)
         z(2:2 + s) = raised_values(from, old(1), old(2:1 + s))
         z(3 + s:3 + 2 * s) = raised_values(from, 0.0_wp, old(2 + s:1 + 2 * s))
      end associate
   end function finer_unknowns
end module conforming_rod

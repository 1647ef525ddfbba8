!> The straight updated-Lagrangian element of Silveira & Goncalves (2001), as a kind of rod_element_t.
module ul2_rod
   use kinds, only: wp
   use problem, only: problem_t
   use rod_state, only: state_t, node_position, element_displacement, element_load
   use rod_element, only: rod_element_t
   use inner_forces, only: inner_forces_t, clear_forces
   use rod_load, only: ge_load_t, acts, line_at_stage
   use ul2_element, only: ul2_evaluate, ul2_forces, ul2_stress_stiffness, ul2_heat_scale
   implicit none
   private
   public :: ul2_rod_t

   !> The element UL2.
   type, extends(rod_element_t) :: ul2_rod_t
   contains
      procedure :: evaluate
      procedure :: end_forces
      procedure :: local_forces
      procedure :: stress_stiffness
      procedure :: load_sum
      procedure :: finer_unknowns
      procedure :: takes_increments
      procedure :: force_scale
      procedure :: force_noise
   end type ul2_rod_t

contains

   !> Implements rod_element_t%evaluate, where the arguments are described.
   subroutine evaluate(self, problem, state, base, e, f, raw, k, fl, op, defect, ok, inner, shift)
      class(ul2_rod_t), intent(in) :: self
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(state_t), intent(in) :: base
      integer, intent(in) :: e
      real(wp), intent(out) :: f(6), raw(6), k(6, 6), fl(6), op(:, :), defect(3)
      logical, intent(out) :: ok
      type(inner_forces_t), intent(inout) :: inner
      real(wp), intent(out) :: shift(6, 2)
      associate (g => state%geometry%element(e))
         call ul2_evaluate(g%length, g%chord, 1.0_wp / problem%compliance(e)%axial, 1.0_wp / problem%compliance(e)%bending, &
            & element_load(problem, state, e), element_displacement(problem, state, e), &
            & element_displacement(problem, base, e), base%z(:3, e), f, k, fl, op(:3, 1))
      end associate
      raw = f
      defect = 0.0_wp
      shift = 0.0_wp
      call clear_forces(inner)
      ok = .true.
   end subroutine evaluate

   !> Implements rod_element_t%end_forces, where the arguments are described.
   subroutine end_forces(self, problem, state, e, first, second)
      class(ul2_rod_t), intent(in) :: self
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: e
      real(wp), intent(out) :: first(3), second(3)
      real(wp) :: u(6), d(2), l, shear, half(2), force(3), line(2), rate(2)
      type(ge_load_t) :: load
      u = element_displacement(problem, state, e)
      d = state%geometry%element(e)%chord + u(4:5) - u(1:2)
      l = norm2(d)
      d = d / l
      load = element_load(problem, state, e)
      force = ul2_forces(1.0_wp / problem%compliance(e)%axial, 1.0_wp / problem%compliance(e)%bending, load, &
         & state%z(:3, e))
      shear = -(force(2) + force(3)) / l
      first = [force(1) * d(1) - shear * d(2), force(1) * d(2) + shear * d(1), -force(2)]
      second = [first(1:2), force(3)]
      ! The loads of this element are lumped: half of them acts between each end and its node.
      call line_at_stage(load, 1, line, rate)
      half = 0.5_wp * (state%geometry%element(e)%length * line + load%pressure * l * [-d(2), d(1)])
      first(1:2) = first(1:2) + half
      second(1:2) = second(1:2) - half
   end subroutine end_forces

   !> Implements rod_element_t%local_forces; the section forces vary linearly between the ends.
   function local_forces(self, problem, state, e, tau) result(local)
      class(ul2_rod_t), intent(in) :: self
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: e
      real(wp), intent(in) :: tau(:)
      real(wp) :: local(3, size(tau))
      real(wp) :: ends(3, 2), part(3, 2), angle
      integer :: side, i
      call self%end_forces(problem, state, e, ends(:, 1), ends(:, 2))
      do side = 1, 2
         angle = state%geometry%element(e)%end_angle(side) + state%u(3, problem%model%mesh%node(side, e))
         part(1, side) = cos(angle) * ends(1, side) + sin(angle) * ends(2, side)
         part(2, side) = cos(angle) * ends(2, side) - sin(angle) * ends(1, side)
         part(3, side) = ends(3, side)
      end do
      do i = 1, size(tau)
         local(:, i) = part(:, 1) + tau(i) * (part(:, 2) - part(:, 1))
      end do
   end function local_forces

   !> Implements rod_element_t%stress_stiffness, where the arguments are described.
   subroutine stress_stiffness(self, problem, state, du, dz, e, factor, k, shift)
      class(ul2_rod_t), intent(in) :: self
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      real(wp), intent(in) :: du(6), dz(:)
      integer, intent(in) :: e
      real(wp), intent(in) :: factor
      real(wp), intent(out) :: k(6, 6), shift(6, 2)
      associate (g => state%geometry%element(e))
         call ul2_stress_stiffness(g%length, g%chord, 1.0_wp / problem%compliance(e)%axial, element_load(problem, state, e), &
            & element_displacement(problem, state, e), du, k)
      end associate
      if (abs(factor) > 0.0_wp) k = factor * k
      shift = 0.0_wp
   end subroutine stress_stiffness

   !> Implements rod_element_t%load_sum, where the arguments are described.
   function load_sum(self, problem, state, e, middle) result(total)
      class(ul2_rod_t), intent(in) :: self
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: e
      real(wp), intent(in) :: middle(2)
      real(wp) :: total(3)
      real(wp) :: x(2, 2), force(2), position(2), line(2), rate(2)
      type(ge_load_t) :: load
      integer :: i
      load = element_load(problem, state, e)
      total = 0.0_wp
      if (.not. acts(load)) return
      do i = 1, 2
         x(:, i) = node_position(state, problem%model%mesh%node(i, e)) - middle
      end do
      associate (h => state%geometry%element(e)%length)
         call line_at_stage(load, 1, line, rate)
         force = h * line + load%pressure * [x(2, 1) - x(2, 2), x(1, 2) - x(1, 1)]
      end associate
      position = 0.5_wp * (x(:, 1) + x(:, 2))
      total = [force, position(1) * force(2) - position(2) * force(1)]
   end function load_sum

   !> Implements rod_element_t%finer_unknowns: the element is the same in the enriched problem.
   function finer_unknowns(self, problem, state, finer, e) result(z)
      class(ul2_rod_t), intent(in) :: self
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(problem_t), intent(in) :: finer
      integer, intent(in) :: e
      real(wp) :: z(finer%z_size(e))
      z = state%z(:problem%z_size(e), e)
   end function finer_unknowns

   !> Implements rod_element_t%takes_increments. False: the forces follow from displacements, and the operator gives their new
   !> values.
   pure logical function takes_increments(self)
      class(ul2_rod_t), intent(in) :: self
      takes_increments = .false.
   end function takes_increments

   !> Implements rod_element_t%force_scale: the force that would suppress the thermal strain.
   function force_scale(self, problem, state, e) result(scale)
      class(ul2_rod_t), intent(in) :: self
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: e
      real(wp) :: scale
      type(ge_load_t) :: load
      load = element_load(problem, state, e)
      scale = ul2_heat_scale * abs(load%strain) / problem%compliance(e)%axial
   end function force_scale

   !> Implements rod_element_t%force_noise: the element computes N and M from displacements.
   function force_noise(self, problem, state, e, moved) result(noise)
      class(ul2_rod_t), intent(in) :: self
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: e
      real(wp), intent(in) :: moved
      real(wp) :: noise
      associate (h => state%geometry%element(e)%length, flexible => problem%compliance(e))
         noise = max(moved / (flexible%axial * h), moved * 12.0_wp / (flexible%bending * h**3))
      end associate
   end function force_noise
end module ul2_rod

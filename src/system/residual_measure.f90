!> Residual of the equilibrium equations at a state, and the part of it that may be rounding.
module residual_measure
   use kinds, only: wp
   use problem, only: problem_t, moments_as_forces
   use rod_state, only: state_t, element_load
   use node_loads, only: node_push_t, node_pushes
   use rod_load, only: ge_load_t, largest_line
   use rod_equations, only: cancelling_force, displaced_force
   use system_type, only: system_t
   use node_axes, only: spread_element
   implicit none
   private
   public :: measure_residual, worst_round_off

   real(wp), parameter :: worst_round_off = 1.0e-6_wp !! a residual above this bound is not accepted as rounding

contains

   !> Measures the residual of the free unknowns, computed from the stored end forces: over the largest force; for moments over the
   !> largest force times the structure's size.
   subroutine measure_residual(problem, state, system)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(inout) :: system
      real(wp) :: worst, scale, noise, moved, carried, more(6)
      type(ge_load_t) :: load
      type(node_push_t), allocatable :: push(:)
      integer :: e, i
      system%raw = system%residual
      scale = problem%force_floor
      do e = 1, problem%model%mesh%n_elements
         more = system%eraw(:, e) - system%ef(:, e)
         call spread_element(problem, system, e, more, system%raw)
         scale = max(scale, maxval(abs(system%eraw(1:2, e))), maxval(abs(system%eraw(4:5, e))), &
            & abs(system%eraw(3, e)) / problem%size, abs(system%eraw(6, e)) / problem%size)
         scale = max(scale, cancelling_force(problem, state, e))
      end do
      scale = max(scale, maxval(abs(state%reaction), mask=state%active))
      scale = max(scale, maxval(problem%model%spring(1:2, :) * abs(state%u(1:2, :))), &
         & maxval(problem%model%spring(3, :) * abs(state%u(3, :))) / problem%size)
      do e = 1, size(problem%model%joint_spring)
         associate (spring => problem%model%joint_spring(e))
            scale = max(scale, spring%stiffness * maxval(abs(state%u(spring%component, spring%node))) / &
               & merge(problem%size, 1.0_wp, spring%component == 3))
         end associate
      end do
      ! Loads of several steps may cancel; their sum has the rounding errors of all of them.
      associate (rate => problem%model%step(problem%step)%load)
         scale = max(scale, maxval(abs(problem%constant%node_force(1:2, :))), &
            & abs(state%load_factor) * maxval(abs(rate%node_force(1:2, :))))
      end associate
      push = node_pushes(problem, state)
      do i = 1, size(push)
         scale = max(scale, norm2(push(i)%force(1:2)))
      end do
      if (problem%has_spans()) then
         ! An obstacle may balance a load without any section force in the rods.
         carried = 0.0_wp
         do e = 1, problem%model%mesh%n_elements
            if (problem%conforms(e) == 0) cycle
            load = element_load(problem, state, e)
            carried = carried + (norm2(largest_line(load)) + abs(load%pressure)) * state%geometry%element(e)%length
         end do
         scale = max(scale, carried)
      end if
      if (any(problem%ground%founded)) then
         ! A foundation may balance a load without any section force in the rods.
         do e = 1, problem%model%mesh%n_elements
            load = element_load(problem, state, e)
            scale = max(scale, maxval(largest_line(load)) * state%geometry%element(e)%length)
         end do
      end if
      worst = maxval(abs(merge(0.0_wp, moments_as_forces(problem, system%raw), system%fixed)))
      system%force_scale = scale
      ! UL2 elements compute N from displacements, and foundations their reaction from a gap. The rounding error of the force is
      ! that of the displacement or gap, times the stiffness.
      moved = max(maxval(abs(state%u(1:2, :))), maxval(abs(state%u(3, :))) * problem%size)
      system%gap_error = 2.0_wp * epsilon(noise) * merge(moved, problem%size, problem%resting)
      noise = maxval([problem%ground%stiffest, system%spring]) * merge(moved, problem%size, problem%resting)
      system%gap_noise = 2.0_wp * epsilon(noise) * noise / scale
      noise = max(noise, moved * maxval(problem%model%spring(1:2, :)), moved * maxval(problem%model%spring(3, :)) / problem%size**2)
      do e = 1, size(problem%model%joint_spring)
         associate (spring => problem%model%joint_spring(e))
            noise = max(noise, moved * spring%stiffness / merge(problem%size**2, 1.0_wp, spring%component == 3))
         end associate
      end do
      do e = 1, problem%model%mesh%n_elements
         noise = max(noise, displaced_force(problem, state, e, moved))
      end do
      system%round_off = min(2.0_wp * epsilon(noise) * noise / scale, worst_round_off)
      system%force_residual = worst / scale
   end subroutine measure_residual
end module residual_measure

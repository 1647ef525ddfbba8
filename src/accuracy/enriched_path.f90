!> Points on the path of the enriched problem, next to a point of the (original) problem's path.
module enriched_path
   use kinds, only: wp
   use model, only: quantity_reaction, method_displacement
   use problem, only: problem_t, moments_as_forces
   use rod_state, only: state_t
   use linear_system, only: system_t, new_system, assemble, to_global
   use converged_state, only: keep_couples
   use bordered_system, only: linearise, factor_system, apply_increment
   use contact_set, only: contact_step_t, solve_contact_step
   use touchdown_points, only: move_touchdown_points, touchdown_travel
   use path_control, only: control_t, control_row, follow_nodes
   use state_transfer, only: kept_t
   use path_continuity, only: path_tangent_t, path_tangent_at
   use state_functional, only: functional_t
   use reaction_functional, only: new_support_functional
   use monitors, only: monitor_values
   use displacement_functional, only: watched_displacement
   use enriched_problem, only: enriched_problem_t, provide_finer_problem, new_finer_state
   use place_functional, only: places_at, places_after
   use null_directions, only: new_null_directions, leave_out
   implicit none
   private
   public :: enriched_path_t, enriched_point_t, new_finer_path, start_point, next_point, values_beside, no_convergence

   character(*), parameter :: no_convergence = 'elements of a higher order do not converge from here' !! reason why there is no
   !! error bar if Newton's method fails for a point

   !> The path of the enriched problem next to a point of the original problem's path.
   type :: enriched_path_t
      type(problem_t), pointer :: problem => null() !! the enriched problem
      type(state_t) :: base                      !! the original problem's point, transferred to the enriched problem
      type(control_t) :: control !! path constraint that the points satisfy; its increment is measured from the original problem's
      !! point
      real(wp) :: away = 0.0_wp !! monitored displacement that the constraint prescribes: its value at the original problem's point
      !! minus its value in `base`. The two values differ if the monitored point is inside an element, where the polynomials have
      !! different orders
      type(path_tangent_t) :: heading                 !! path tangent of the original problem
      integer, allocatable :: ends(:) !! candidates of the touchdown points whose positions get error bars, see place_functional
      real(wp), allocatable :: modes(:, :) !! (unknowns, multiplicity) null vectors of a bifurcation at the point. They are taken
      !! out of Newton steps, and of tangents at limit points, because components along them are rounding
      logical :: at_limit = .false. !! true: the point is a limit point. `modes` does not contain the null vector of the limit point
   end type enriched_path_t

   !> A point of the enriched problem's path.
   type :: enriched_point_t
      type(state_t) :: state
      type(system_t), allocatable :: system      !! factored at the point
      type(path_tangent_t) :: heading            !! path tangent at the point
      real(wp), allocatable :: value(:)          !! load factor, monitors, and positions of touchdown points at the point
      logical :: ok = .false.                    !! false: Newton's method failed, and the other components are undefined
   end type enriched_point_t

   !> Number of Newton steps to a point. Two suffice, because the start is in error by the mesh error only, or by a tangent step
   !> over a small part of an increment. The last step also removes rounding, to which displacements at limit points are sensitive.
   integer, parameter :: steps = 2

   real(wp), parameter :: left = 0.01_wp !! part of the first residual that may remain after a Newton step; such a remainder changes
   !! an error estimate by a hundredth
   real(wp), parameter :: straight = 1.0e-3_wp !! [rad] largest rotation in a Newton step after which no second step is made; the
   !! relative error of the step is up to ten times this rotation; with values from 1E-4 to 0.01 every deck in input has the same
   !! results
   real(wp), parameter :: near = 1.0e-7_wp !! largest movement of touchdown points in a Newton step, over the length of the span,
   !! after which no second step is made; such a movement changes the thrust of a stiff rod by the relative amount of 100 times this
   !! value

contains

   !> Prepares the path of the enriched problem next to a converged point of the original problem.
   subroutine new_finer_path(problem, finer, state, control, heading, ends, path)
      type(problem_t), intent(in) :: problem
      type(enriched_problem_t), intent(inout), target :: finer !! enriched problem; the path contains a pointer to it and must not
      !! outlive it
      type(state_t), intent(in) :: state
      type(control_t), intent(in) :: control !! path constraint; its component `tangent` must be set if its method uses the tangent
      type(path_tangent_t), intent(in) :: heading     !! path tangent at `state`
      integer, intent(in) :: ends(:)             !! candidates of the touchdown points whose positions are among the computed values
      type(enriched_path_t), intent(out) :: path
      call provide_finer_problem(problem, finer)
      path%problem => finer%problem
      call new_finer_state(problem, state, finer%problem, path%base, finer%geometry)
      finer%geometry = path%base%geometry
      path%control = control
      if (control%method == method_displacement) path%away = watched_displacement(problem, state, control%monitor) - &
         & watched_displacement(finer%problem, path%base, control%monitor)
      path%heading = heading
      path%ends = ends
   end subroutine new_finer_path

   !> Linearises the enriched problem at the original problem's point, from which Newton's method starts.
   subroutine start_point(path, finer, point)
      type(enriched_path_t), intent(in) :: path
      type(enriched_problem_t), intent(inout) :: finer !! enriched problem of the path; its component `system`, memory for the
      !! equations, is moved to the point
      type(enriched_point_t), intent(out) :: point
      point%state = path%base
      call move_alloc(finer%system, point%system)
      if (.not. allocated(point%system)) point%system = new_system(path%problem)
      call linearise(path%problem, point%state, point%state, point%system)
      call keep_couples(path%problem, point%system, point%state)
      point%ok = point%system%ok
   end subroutine start_point

   !> Moves `point` along the path of the enriched problem to the point at which the prescribed quantity has changed by `increment`.
   subroutine next_point(path, increment, point)
      type(enriched_path_t), intent(in) :: path
      real(wp), intent(in) :: increment !! change of the quantity that path%control prescribes, from the original problem's point
      type(enriched_point_t), intent(inout) :: point
      type(contact_step_t) :: step
      integer :: k
      associate (problem => path%problem)
         do k = 1, steps
            if (.not. point%ok) return
            call solve_step(path, increment, point, step)
            if (.not. point%ok) return
            call add_step(path, step, point)
            call linearise(problem, point%state, point%state, point%system)
            call keep_couples(problem, point%system, point%state)
            point%ok = point%system%ok
         end do
         if (.not. point%ok) return
         point%value = values_at(path, point)
         if (path%at_limit) call leave_out(problem, path%modes, directions_of(path, point%system), point%system%tangent)
         point%heading = path_tangent_at(problem, point%system, path%heading%u, path%heading%load)
      end associate
   end subroutine next_point

   !> Computes point%value at the point of the enriched problem that satisfies the path constraint with increment zero, with as few
   !> operations as possible. Afterwards point%system is undefined.
   !>
   !> Only rotations of cross sections and movements of touchdown points make the equations nonlinear. The error of a Newton step is
   !> of the second order in both. If both are small, no residual is computed after the step.
   subroutine values_beside(path, point)
      type(enriched_path_t), intent(in) :: path
      type(enriched_point_t), intent(inout) :: point !! in: start of Newton's method, from start_point; out: the state and the
      !! values, but not the system
      type(contact_step_t) :: step
      type(state_t) :: ahead
      real(wp) :: first
      if (.not. point%ok) return
      call solve_step(path, 0.0_wp, point, step)
      if (.not. point%ok) return
      associate (problem => path%problem)
         ahead = point%state
         call apply_increment(problem, point%system, step%x, step%y, ahead)
         ahead%reaction = step%reaction
         if (is_short(problem, point, step, ahead)) then
            point%value = [ahead%load_factor, monitor_values(problem, ahead, point%system) + support_changes(problem, &
               & point%system, step), places_after(problem, point%state, ahead, path%ends)]
            point%state = ahead
            return
         end if
         first = out_of_balance(problem, point%system)
         call add_step(path, step, point)
         call assemble(problem, point%state, point%state, point%system)
         point%ok = point%system%ok
         if (.not. point%ok) return
         if (out_of_balance(problem, point%system) > left * first) then
            call factor_system(point%system)
            call solve_step(path, 0.0_wp, point, step)
            if (.not. point%ok) return
            call add_step(path, step, point)
            call assemble(problem, point%state, point%state, point%system)
            point%ok = point%system%ok
            if (.not. point%ok) return
         end if
         point%value = values_at(path, point)
      end associate
   end subroutine values_beside

   !> Load factor, monitors and positions of touchdown points at a point.
   function values_at(path, point) result(value)
      type(enriched_path_t), intent(in) :: path
      type(enriched_point_t), intent(in) :: point
      real(wp), allocatable :: value(:)
      value = [point%state%load_factor, monitor_values(path%problem, point%state, point%system), &
         & places_at(path%problem, point%state, path%ends)]
   end function values_at

   !> True if the Newton step is so short that a second step would hardly change the values.
   logical function is_short(problem, point, step, ahead)
      type(problem_t), intent(in) :: problem
      type(enriched_point_t), intent(in) :: point   !! start of the step
      type(contact_step_t), intent(in) :: step
      type(state_t), intent(in) :: ahead         !! state at the end of the step, without the movement of touchdown points
      is_short = turns_little(problem, point%system, step)
      if (is_short .and. problem%has_spans()) is_short = touchdown_travel(problem, point%state, ahead) <= near
   end function is_short

   !> True if the rotations in the step are small and the structure has no foundation. (A foundation also makes the equations
   !> nonlinear.)
   pure logical function turns_little(problem, system, step) result(little)
      type(problem_t), intent(in) :: problem
      type(system_t), intent(in) :: system       !! provides the axes of the nodes
      type(contact_step_t), intent(in) :: step
      real(wp) :: moved(3)
      integer :: node
      little = .false.
      if (any(problem%ground%founded)) return
      do node = 1, problem%model%mesh%n_nodes
         moved = to_global(problem, system, step%x, node)
         if (abs(moved(3)) > straight) return
      end do
      little = .true.
   end function turns_little

   !> Change of the monitored support reactions by a step, from the equations at the start of the step.
   function support_changes(problem, system, step) result(change)
      type(problem_t), intent(in) :: problem
      type(system_t), intent(in) :: system
      type(contact_step_t), intent(in) :: step
      real(wp) :: change(size(problem%model%monitor))
      type(functional_t) :: support
      integer :: m
      change = 0.0_wp
      do m = 1, size(change)
         associate (monitor => problem%deck%monitor(m))
            if (monitor%quantity /= quantity_reaction) cycle
            support = new_support_functional(problem, system, m)
            change(m) = monitor%factor * (support%defect + support%change(step%x, step%y))
         end associate
      end do
   end function support_changes

   !> Solves the equations for one Newton step towards the point at which the prescribed quantity has changed by `increment`.
   subroutine solve_step(path, increment, point, step)
      type(enriched_path_t), intent(in) :: path
      real(wp), intent(in) :: increment
      type(enriched_point_t), intent(inout) :: point
      type(contact_step_t), intent(out) :: step
      type(control_t) :: seen
      type(state_t) :: origin
      type(kept_t) :: kept(1)
      real(wp) :: rhs
      seen = path%control
      seen%increment = increment + path%away
      associate (problem => path%problem)
         if (problem%moves_nodes()) then
            origin = path%base
            call follow_nodes(problem, path%base, path%control, point%state, kept, origin, seen)
            call control_row(problem, seen, origin, point%state, point%system, rhs)
         else
            call control_row(problem, seen, path%base, point%state, point%system, rhs)
         end if
         call solve_contact_step(problem, point%state, point%system, rhs, .true., step)
         point%ok = step%ok
         if (.not. point%ok) return
         call leave_out(problem, path%modes, directions_of(path, point%system), step%x)
      end associate
   end subroutine solve_step

   !> Directions along which the components of solutions are arbitrary at a bifurcation, see null_directions. At a limit point the
   !> path tangent is a null vector as well. The path constraint determines the component along the tangent, so that this component
   !> is taken out of the directions.
   function directions_of(path, system) result(direction)
      type(enriched_path_t), intent(in) :: path
      type(system_t), intent(in) :: system       !! factored, with its constraint row
      real(wp), allocatable :: direction(:, :)   !! (unknowns, multiplicity) directions, node axes
      real(wp) :: along
      integer :: k
      direction = new_null_directions(path%problem, system, path%modes)
      if (.not. path%at_limit) return
      along = dot_product(system%path_row, system%tangent)
      do k = 1, size(direction, 2)
         if (abs(along) > 0.0_wp) direction(:, k) = direction(:, k) - system%tangent * (dot_product(system%path_row, &
            & direction(:, k)) / along)
      end do
   end function directions_of

   !> Adds a Newton step to the state of the point, and moves the touchdown points; point%system remains that at the start of the
   !> step.
   subroutine add_step(path, step, point)
      type(enriched_path_t), intent(in) :: path
      type(contact_step_t), intent(in) :: step
      type(enriched_point_t), intent(inout) :: point
      type(state_t) :: before
      associate (problem => path%problem)
         if (problem%moves_nodes()) before = point%state
         call apply_increment(problem, point%system, step%x, step%y, point%state)
         point%state%reaction = step%reaction
         if (problem%moves_nodes()) call move_touchdown_points(problem, before, point%state)
      end associate
   end subroutine add_step

   !> Norm of the residual of the free unknowns; moments are divided by the size of the structure.
   pure real(wp) function out_of_balance(problem, system)
      type(problem_t), intent(in) :: problem
      type(system_t), intent(in) :: system
      out_of_balance = norm2(merge(0.0_wp, moments_as_forces(problem, system%residual), system%fixed))
   end function out_of_balance
end module enriched_path

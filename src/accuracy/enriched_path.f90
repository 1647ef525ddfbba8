!> Points of the path that the finer problem has, next to a point of the problem's own path.
module enriched_path
   use kinds, only: wp
   use model, only: quantity_reaction, method_displacement
   use problem, only: problem_t, dof
   use rod_state, only: state_t
   use linear_system, only: system_t, new_system, assemble, to_global
   use bordered_system, only: linearise, factor_system, apply_increment, held_force_change
   use contact_set, only: contact_step_t, solve_contact_step
   use touchdown_points, only: move_touchdown_points, touchdown_travel
   use path_control, only: control_t, control_row, follow_nodes
   use path_continuity, only: path_tangent_t, path_tangent_at
   use monitors, only: monitor_values
   use monitor_rows, only: watched_displacement
   use enriched_problem, only: enriched_problem_t, provide_finer_problem, new_finer_state
   use contact_places, only: places_at, places_after
   use null_directions, only: new_null_directions, leave_out
   implicit none
   private
   public :: enriched_path_t, enriched_point_t, new_finer_path, start_point, next_point, values_beside

   type :: enriched_path_t
      type(problem_t), pointer :: problem => null() !! the finer one
      type(state_t) :: base                      !! the problem's own point
      type(control_t) :: control                 !! what tells points apart: its increment counts from the problem's own point
      real(wp) :: away = 0.0_wp                  !! of the base from that: inside an element a monitor is what the polynomials of
      !! its order make of it
      type(path_tangent_t) :: heading                 !! tangent of the problem's own path
      integer, allocatable :: ends(:)            !! touchdown points whose places count, see contact_places
      real(wp), allocatable :: modes(:, :)       !! (unknowns, multiplicity) at a bifurcation: null vectors, along which the path
      !! does not go
   end type enriched_path_t

   type :: enriched_point_t
      type(state_t) :: state
      type(system_t), allocatable :: system      !! factored there
      type(path_tangent_t) :: heading
      real(wp), allocatable :: value(:)          !! load factor, monitors, places
      logical :: ok = .false.                    !! false: Newton's method does not get there; nothing else means anything
   end type enriched_point_t

   !> Newton steps to a point, from a guess as good as the mesh, or as a tangent of a small part of an increment. The last one
   !> takes away rounding, too, which displacements at limit points feel.
   integer, parameter :: steps = 2

   real(wp), parameter :: left = 0.01_wp      !! of what is out of balance: a hundredth of an estimate, far less than its bar
   real(wp), parameter :: straight = 1.0e-3_wp !! [rad] a step leaves one to ten times what it turns nodes by of that
   real(wp), parameter :: near = 1.0e-7_wp    !! of a span that its ends go by: thrust of stiff rods feels a hundred times more

contains

   !> The finer path next to a converged point.
   subroutine new_finer_path(problem, finer, state, control, heading, ends, path)
      type(problem_t), intent(in) :: problem
      type(enriched_problem_t), intent(inout), target :: finer !! the path is one of it, and no longer than the target lasts
      type(state_t), intent(in) :: state
      type(control_t), intent(in) :: control     !! its tangent set where its method wants one
      type(path_tangent_t), intent(in) :: heading     !! tangent there
      integer, intent(in) :: ends(:)             !! touchdown points whose places count
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

   !> The finer problem linearised at the problem's own point: where Newton's method starts.
   subroutine start_point(path, finer, point)
      type(enriched_path_t), intent(in) :: path
      type(enriched_problem_t), intent(inout) :: finer !! that of the path: its storage for equations becomes the point's
      type(enriched_point_t), intent(out) :: point
      point%state = path%base
      call move_alloc(finer%system, point%system)
      if (.not. allocated(point%system)) point%system = new_system(path%problem)
      call linearise(path%problem, point%state, point%state, point%system)
      point%ok = point%system%ok
   end subroutine start_point

   !> From a point, or the start, to the one at the control's increment.
   subroutine next_point(path, increment, point)
      type(enriched_path_t), intent(in) :: path
      real(wp), intent(in) :: increment
      type(enriched_point_t), intent(inout) :: point
      type(contact_step_t) :: step
      integer :: k
      associate (problem => path%problem)
         do k = 1, steps
            if (.not. point%ok) return
            call solve_step(path, increment, point, step)
            if (.not. point%ok) return
            call go(path, step, point)
            call linearise(problem, point%state, point%state, point%system)
            point%ok = point%system%ok
         end do
         if (.not. point%ok) return
         point%value = values_at(path, point)
         point%heading = path_tangent_at(problem, point%system, path%heading%u, path%heading%load)
      end associate
   end subroutine next_point

   !> Values of the point next to the start, with no more of it than they take; point%system is of no use afterwards.
   !>
   !> What a step of Newton's method leaves is of second order. All that is not linear is what sections turn by, and how far
   !> touchdown points go; a step that moves these little needs no look at its end.
   subroutine values_beside(path, point)
      type(enriched_path_t), intent(in) :: path
      type(enriched_point_t), intent(inout) :: point !! the start
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
            return
         end if
         first = out_of_balance(problem, point%system)
         call go(path, step, point)
         call assemble(problem, point%state, point%state, point%system)
         point%ok = point%system%ok
         if (.not. point%ok) return
         if (out_of_balance(problem, point%system) > left * first) then
            call factor_system(point%system)
            call solve_step(path, 0.0_wp, point, step)
            if (.not. point%ok) return
            call go(path, step, point)
            call assemble(problem, point%state, point%state, point%system)
            point%ok = point%system%ok
            if (.not. point%ok) return
         end if
         point%value = values_at(path, point)
      end associate
   end subroutine values_beside

   !> Load factor, monitors and places at a point.
   function values_at(path, point) result(value)
      type(enriched_path_t), intent(in) :: path
      type(enriched_point_t), intent(in) :: point
      real(wp), allocatable :: value(:)
      value = [point%state%load_factor, monitor_values(path%problem, point%state, point%system), &
         & places_at(path%problem, point%state, path%ends)]
   end function values_at

   !> True where a second step would find next to nothing to do.
   logical function is_short(problem, point, step, ahead)
      type(problem_t), intent(in) :: problem
      type(enriched_point_t), intent(in) :: point   !! where the step begins
      type(contact_step_t), intent(in) :: step
      type(state_t), intent(in) :: ahead         !! and where it ends, touchdown points left where they are
      is_short = turns_little(problem, point%system, step)
      if (is_short .and. problem%has_spans()) is_short = touchdown_travel(problem, point%state, ahead) <= near
   end function is_short

   !> True for a step that leaves little where nodes stay. With foundations their contact is more than what turns.
   pure logical function turns_little(problem, system, step) result(little)
      type(problem_t), intent(in) :: problem
      type(system_t), intent(in) :: system       !! gives the axes
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

   !> What a step changes of reactions of supports, which monitors take from the equations where it began.
   function support_changes(problem, system, step) result(change)
      type(problem_t), intent(in) :: problem
      type(system_t), intent(in) :: system
      type(contact_step_t), intent(in) :: step
      real(wp) :: change(size(problem%model%monitor))
      integer :: m, i, d, node
      change = 0.0_wp
      do m = 1, size(change)
         associate (monitor => problem%deck%monitor(m))
            if (monitor%quantity /= quantity_reaction) cycle
            do i = 1, size(monitor%node)
               node = problem%mesh_node(monitor%node(i))
               if (node == 0) cycle
               if (.not. problem%model%fixed(monitor%component, node)) cycle
               d = dof(problem, node, monitor%component)
               change(m) = change(m) + monitor%factor * (system%residual(d) - system%raw(d) + &
                  & held_force_change(system, d, step%x, step%y))
            end do
         end associate
      end do
   end function support_changes

   !> One step of Newton's method towards the point at the control's increment.
   subroutine solve_step(path, increment, point, step)
      type(enriched_path_t), intent(in) :: path
      real(wp), intent(in) :: increment
      type(enriched_point_t), intent(inout) :: point
      type(contact_step_t), intent(out) :: step
      type(control_t) :: seen
      type(state_t) :: origin
      real(wp) :: rhs
      seen = path%control
      seen%increment = increment + path%away
      associate (problem => path%problem)
         if (problem%moves_nodes()) then
            origin = path%base
            call follow_nodes(problem, path%base, path%control, point%state, origin, seen)
            call control_row(problem, seen, origin, point%state, point%system, rhs)
         else
            call control_row(problem, seen, path%base, point%state, point%system, rhs)
         end if
         call solve_contact_step(problem, point%state, point%system, rhs, .true., step)
         point%ok = step%ok
         if (.not. point%ok .or. size(path%modes, 2) == 0) return
         call leave_out(problem, path%modes, new_null_directions(problem, point%system, path%modes), step%x)
      end associate
   end subroutine solve_step

   !> Goes there; the equations are still those of the point before.
   subroutine go(path, step, point)
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
   end subroutine go

   !> The size of what is out of balance at the free unknowns: forces, and moments over the structure's size.
   pure real(wp) function out_of_balance(problem, system)
      type(problem_t), intent(in) :: problem
      type(system_t), intent(in) :: system
      integer :: node
      out_of_balance = 0.0_wp
      do node = 1, problem%model%mesh%n_nodes
         associate (d => dof(problem, node, 1))
            out_of_balance = out_of_balance + sum(system%residual(d:d + 1)**2, mask=.not. system%fixed(d:d + 1))
            if (.not. system%fixed(d + 2)) out_of_balance = out_of_balance + (system%residual(d + 2) / problem%size)**2
         end associate
      end do
      out_of_balance = sqrt(out_of_balance)
   end function out_of_balance
end module enriched_path

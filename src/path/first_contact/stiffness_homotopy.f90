!> First point of a path on foundations that are too stiff for the elements to detect contact. The point is found on softer
!> foundations, where the ends of contact give the mesh its interface points; the stiffness then grows to the deck's value.
!>
!> With interface points at the ends of contact Newton's method converges for any stiffness, but it needs a first guess of the ends.
!> Between a soft and a rigid foundation the ends move by a finite distance, proportional to the fourth root of the flexibility.
module stiffness_homotopy
   use kinds, only: wp
   use problem, only: problem_t, copy_problem
   use rod_state, only: state_t, new_state
   use linear_system, only: system_t, new_system
   use bordered_system, only: linearise
   use span_problem, only: new_span_problem
   use span_division, only: looking_demand
   use span_candidates, only: present_contact_spans
   use contact_spans, only: contact_span_t
   use ground_mark, only: cut_t
   use ground_cuts, only: find_cuts, marked
   use ground_segments, only: assign_segments, followed_part
   use state_transfer, only: carried, carried_field
   use path_control, only: control_t, is_arc_length
   use path_point, only: path_point_t, point_at, move_to
   use path_state, only: path_state_t, forget_mesh
   use corrector, only: increment_t, take_increment, correct
   use tangent_rounding, only: path_stiffness
   use force_law, only: segment_slope
   implicit none
   private
   public :: is_stiff_start, take_stiff_start, check_start

   ! Factors by which the stiffness grows in a step. The factor is squared after a success; after a failure its square root is
   ! taken.
   real(wp), parameter :: first_growth = 1.0e2_wp !! first factor: the boundary layers beside interface points become a third as
   !! long (100^(-1/4))
   real(wp), parameter :: least_growth = 1.1_wp !! smallest factor: with a smaller one, after six failures in a row (100^(1/64)),
   !! the search ends, because the layers hardly change
   integer, parameter :: most_tries = 3 !! largest number of softer foundations tried at the beginning; also the largest number of
   !! meshes at one stiffness, made until every interface point has a node

   !> Equilibrium at the end of the path's first increment, on foundations with a part of the deck's stiffness.
   type :: homotopy_point_t
      type(problem_t) :: problem
      type(state_t) :: state
      real(wp) :: part = 1.0_wp                  !! stiffness of the foundations, as a share of the deck's stiffness
   end type homotopy_point_t

contains

   !> Copies a homotopy point. A procedure, because the compiler would expand the copies of all components at each assignment.
   pure subroutine copy_homotopy_point(from, to)
      type(homotopy_point_t), intent(in) :: from
      type(homotopy_point_t), intent(inout) :: to
      to = from
   end subroutine copy_homotopy_point

   !> True if the run is at the start of a path on foundations that are too stiff for the elements to detect contact.
   logical function is_stiff_start(problem, run)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(in) :: run
      is_stiff_start = run%fresh .and. .not. is_arc_length(run%control%method)
      if (is_stiff_start) is_stiff_start = followed_part(problem) < 1.0_wp
   end function is_stiff_start

   !> Stiffness along the path at the stress-free start, for the check of supports. If elements are too long to follow their
   !> foundations, the signs of their tangent are rounding only; the tangent on softer foundations is then used.
   subroutine check_start(problem, system, stiffness, rounding)
      type(problem_t), intent(in) :: problem
      type(system_t), intent(inout) :: system !! in: factored at the start; out: with the count of negative pivots of the tangent
      !! that was used
      real(wp), intent(out) :: stiffness, rounding !! stiffness along the path and the rounding error of this stiffness, computed by
      !! path_stiffness
      type(problem_t) :: soft
      type(state_t) :: start
      type(system_t) :: other
      type(contact_span_t) :: none(0)
      if (.not. followed_part(problem) < 1.0_wp .or. problem%is_sampled()) then
         start = new_state(problem)
         call path_stiffness(problem, start, system, stiffness, rounding)
      else
         soft = new_span_problem(softened(problem, problem, followed_part(problem)), none)
         start = new_state(soft)
         other = new_system(soft)
         call linearise(soft, start, start, other)
         call path_stiffness(soft, start, other, stiffness, rounding)
         system%negative_pivots = other%negative_pivots
      end if
   end subroutine check_start

   !> Makes the first increment from a start on stiff foundations.
   subroutine take_stiff_start(problem, run, trial, report, taken)
      type(problem_t), intent(inout) :: problem    !! out: on the mesh of `trial`
      type(path_state_t), intent(inout) :: run     !! the run; out: its last accepted point is transferred to the mesh of `trial`
      type(path_point_t), intent(inout) :: trial   !! the point that was found, else the run's last point
      type(increment_t), intent(out) :: report
      logical, intent(out) :: taken                !! false: no point was found; problem and run are then unchanged
      type(homotopy_point_t) :: here, sound, next
      type(state_t) :: start
      type(system_t) :: system
      type(cut_t), allocatable :: cut(:)
      type(contact_span_t) :: none(0)
      real(wp) :: growth
      integer :: tries
      taken = .false.
      trial = run%last
      here%part = followed_part(problem)
      here%problem = softened(problem, problem, here%part)
      here%problem%demand = looking_demand(problem, here%part**(-0.25_wp))
      here%problem = new_span_problem(here%problem, none)
      here%part = min(1.0_wp, here%part * followed_part(here%problem))
      do tries = 1, most_tries
         here%problem = new_span_problem(softened(here%problem, problem, here%part), none)
         start = new_state(here%problem)
         system = new_system(here%problem)
         call linearise(here%problem, start, start, system)
         call take_increment(here%problem, start, run%control, here%state, system, report)
         if (report%converged) exit
         here%part = here%part / first_growth
      end do
      if (.not. report%converged) return
      call copy_homotopy_point(here, sound)
      growth = first_growth
      tries = 0
      do
         cut = find_cuts(here%problem, here%state)
         next%part = here%part
         if (marked(here%problem, here%state, cut) .or. tries > most_tries) then
            if (here%part >= 1.0_wp) exit
            if (here%part > sound%part) growth = growth**2
            call copy_homotopy_point(here, sound)
            tries = 0
            next%part = min(1.0_wp, here%part * growth)
            call stiffen(problem, cut, (here%part / next%part)**0.25_wp)
         end if
         tries = tries + 1
         next%problem = new_span_problem(softened(here%problem, problem, next%part), &
            & present_contact_spans(here%problem, here%state), here%state, cut)
         call solve_at_stiffness(run%control, here, next, system, report)
         if (report%converged) then
            call copy_homotopy_point(next, here)
         else
            call copy_homotopy_point(sound, here)
            if (here%part >= 1.0_wp) exit
            growth = sqrt(growth)
            tries = 0
            if (growth < least_growth) return
         end if
      end do
      start = carried(problem, run%last%state, here%problem)
      call assign_segments(here%problem, start, carried=.true.)
      run%last%tangent%u = carried_field(problem, run%last%state, run%last%tangent%u, here%problem, start)
      call forget_mesh(run)
      call copy_problem(here%problem, problem)
      run%last%system = new_system(problem)
      call move_to(problem, start, run%last)
      trial = point_at(problem, here%state)
      taken = trial%system%ok
   end subroutine take_stiff_start

   !> Finds the equilibrium on the mesh and with the stiffness of `next`, starting from the state at the stiffness of `here`.
   subroutine solve_at_stiffness(control, here, next, system, report)
      type(control_t), intent(in) :: control
      type(homotopy_point_t), intent(in) :: here
      type(homotopy_point_t), intent(inout) :: next          !! in: its problem and part are given; out: also its state
      type(system_t), intent(out) :: system
      type(increment_t), intent(out) :: report
      type(control_t) :: hold
      type(state_t) :: guess
      hold = control
      hold%increment = 0.0_wp
      next%state = carried(here%problem, here%state, next%problem)
      call assign_segments(next%problem, next%state, carried=.true.)
      guess = next%state
      system = new_system(next%problem)
      call correct(next%problem, guess, hold, .true., next%state, system, report)
   end subroutine solve_at_stiffness

   !> Predicts the ends of contact on a stiffer foundation, from the theory of beams on elastic foundations. Beside an end all
   !> lengths scale with the boundary layer. Far from the end the rod behaves as on a rigid foundation, with its touchdown point at
   !> sqrt(2) layer lengths from the end.
   subroutine stiffen(problem, cut, ratio)
      type(problem_t), intent(in) :: problem
      type(cut_t), intent(inout) :: cut(:)         !! interface points, sorted along the rod; moved on return
      real(wp), intent(in) :: ratio !! length of the boundary layer on the stiffer foundation over that on the softer one
      real(wp), parameter :: beside = 10.0_wp !! number of layer lengths beyond which the effect of an end has decayed, to exp(-10)
      real(wp) :: free(size(cut)), at(size(cut)), way
      integer :: i, j, side, nearest
      at = cut%at
      ! Ends of contact near each other move with the one among them that lies beside the longest free span.
      do i = 1, size(cut)
         side = merge(1, 2, cut(i)%layer(2) > 0.0_wp)
         free(i) = huge(free)
         j = i + 2 * side - 3
         if (j >= 1 .and. j <= size(cut)) then
            if (cut(j)%rod_segment == cut(i)%rod_segment) free(i) = abs(at(j) - at(i))
         end if
      end do
      do i = 1, size(cut)
         nearest = i
         do j = 1, size(cut)
            if (cut(j)%rod_segment /= cut(i)%rod_segment .or. abs(at(j) - at(i)) > beside * maxval(cut(j)%layer)) cycle
            if (free(j) > free(nearest)) nearest = j
         end do
         associate (first => cut(nearest))
            way = sqrt(2.0_wp) * (1.0_wp - ratio) * (first%layer(2) - first%layer(1))
            if (.not. cut(i)%at_end) cut(i)%at = at(nearest) + way + ratio * (at(i) - at(nearest))
         end associate
      end do
      ! If an end would leave its rod segment or pass the next end, the ends are too close for this prediction: none is moved.
      do i = 1, size(cut)
         associate (length => problem%layout%rod_segment(cut(i)%rod_segment)%length)
            if (.not. cut(i)%at_end .and. (cut(i)%at <= 0.0_wp .or. cut(i)%at >= length)) cut%at = at
         end associate
      end do
      do i = 2, size(cut)
         if (cut(i)%rod_segment == cut(i - 1)%rod_segment .and. cut(i)%at <= cut(i - 1)%at .and. .not. (cut(i)%at_end .or. &
            & cut(i - 1)%at_end)) cut%at = at
      end do
      do side = 1, 2
         cut%layer(side) = ratio * cut%layer(side)
      end do
   end subroutine stiffen

   !> Problem of the same deck, with the stiffness of all tensionless foundations reduced to a part. With less than the full
   !> stiffness the corners (kinks) of force laws are removed as well, because the first point lies on the first straight piece of
   !> each law.
   function softened(problem, whole, part) result(soft)
      type(problem_t), intent(in) :: problem       !! problem on any mesh
      type(problem_t), intent(in) :: whole         !! problem with the deck's stiffness
      real(wp), intent(in) :: part
      type(problem_t) :: soft                      !! its deck is changed; its mesh must be made anew
      integer :: o
      call copy_problem(problem, soft)
      soft%deck%obstacle = whole%deck%obstacle
      if (part >= 1.0_wp) return
      do o = 1, size(whole%deck%obstacle)
         associate (obstacle => whole%deck%obstacle(o), mine => soft%deck%obstacle(o))
            if (obstacle%bilateral) cycle
            if (obstacle%law == 0) then
               mine%modulus = part * obstacle%modulus
            else
               mine%modulus = part * obstacle%width * segment_slope(whole%deck%law(obstacle%law), 1)
               mine%law = 0
            end if
         end associate
      end do
   end function softened
end module stiffness_homotopy

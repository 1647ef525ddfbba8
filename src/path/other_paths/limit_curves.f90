!> Limit points in two parameters: the limit load as a function of a foundation, a gap, an imperfection or a stiffness.
!>
!> Near a limit point the equilibria for all values of the parameter form a surface with two coordinates: the arc length a from the
!> last limit point along its path tangent, and the parameter p. (The corrector finds the equilibrium for any a and p.) The limit
!> points are the zeros of h(a, p), the load rate along the path. These zeros form a curve in the plane (a, p). The curve is
!> followed by steps along it and a search normal to each step, so that it may turn back in the parameter.
module limit_curves
   use problem, only: copy_problem
   use kinds, only: wp
   use text, only: to_text
   use errors, only: error_t
   use model, only: step_t
   use linear_system, only: new_system
   use bordered_system, only: linearise
   use archive, only: archive_t, archive_reset
   use checkpoint, only: saved_run_t, on_curve, clear_end, change_steps
   use critical_points, only: critical_points_t
   use path_outcome, only: outcome_t, must_end, cut_short, note_trouble
   use span_tests, only: spans_hold
   use second_parameter, only: present_value
   use limit_search, only: curve_trace_t, trial_t, set_follower_tangent, scale_rate, evaluate_rate, search, as_coordinate, &
      & as_value, small_drop
   use monitors, only: monitor_values
   use error_bar, only: error_bars_t
   use limit_mesh, only: bars_here, refine_limit_point, renew_marks, make_rigid
   use error_report, only: note_curve_bar
   use path_record, only: recorder_t, limit_point_t
   use run_archive, only: exchange_critical_points_t, exchange_curve_trace_t, exchange_outcome_t
   implicit none
   private
   public :: follow_limit_curves

   integer, parameter :: max_cuts = 12 !! largest number of halvings of a step along the curve; with values from 6 to 24 every deck
   !! in input has the same results
   real(wp), parameter :: farthest = 0.5_wp !! a zero is rejected if its distance from the predicted position exceeds this part of
   !! the step
   real(wp), parameter :: sharpest = 0.7_wp !! smallest cosine of the angle between two successive steps; with values from 0.07 to
   !! 0.7 every deck in input has the same results
   real(wp), parameter :: easy = 5.0_wp             !! largest number of evaluations in a search after which the step still grows
   real(wp), parameter :: first_step = 0.1_wp       !! first step along the curve over the increment of the deck
   real(wp), parameter :: first_distance = 1.0e-3_wp !! arc length of the first move along the path, with which the load rate is
   !! scaled

contains

   !> Follows all limit curves of a step. Failures are appended to outcome%trouble.
   subroutine follow_limit_curves(step, own, frame, saved, recorder, outcome)
      type(step_t), intent(in) :: step
      type(critical_points_t), intent(inout) :: own        !! critical points of the step's own path
      type(archive_t), intent(inout) :: frame !! frame with which the checkpoints of all curves begin (see module checkpoint)
      type(saved_run_t), intent(inout) :: saved          !! restart; on_curve: the restart continues a limit curve
      class(recorder_t), intent(inout) :: recorder
      type(outcome_t), intent(inout) :: outcome            !! why: set only if the results cannot be written or the run must end
      type(curve_trace_t) :: trace
      character(:), allocatable :: trouble
      integer :: k, first
      first = 1
      if (saved%kind == on_curve) then
         call restore_trace()
         first = trace%number
      end if
      do k = first, size(step%limit_curve)
         if (allocated(trouble)) deallocate (trouble)
         if (saved%kind /= on_curve) call begin_curve(k, trace, trouble)
         saved%kind = 0
         if (.not. (allocated(trouble) .or. allocated(outcome%why))) &
            & call follow_curve(step, own, trace, frame, recorder, trouble, outcome)
         if (allocated(outcome%why)) return
         if (allocated(trouble)) call note_trouble(outcome, 'limit curve '//trim(step%limit_curve(k)%name)//': '//trouble)
      end do

   contains

      !> Begins a limit curve: records the limit point of the path as its first one.
      subroutine begin_curve(number, trace, trouble)
         integer, intent(in) :: number                  ! index into step%limit_curve
         type(curve_trace_t), intent(out) :: trace
         character(:), allocatable, intent(out) :: trouble ! reason why the curve cannot begin
         type(trial_t) :: trial
         type(error_bars_t), allocatable :: bars
         integer, allocatable :: limit_points(:)           ! their indices in the list of critical points
         integer :: i

         associate (curve => step%limit_curve(number), follower => trace%follower)
            limit_points = pack([(i, i=1, size(own%list))], own%list%label == 'LP' .and. .not. own%list%corner)
            if (size(limit_points) < curve%limit_point) then
               trouble = 'the path has '//to_text(size(limit_points))//' limit point(s), not '//to_text(curve%limit_point)
               if (any(own%list%corner)) trouble = trouble//'; those at corners of the path do not count: no rate is zero there'
               return
            end if
            i = limit_points(curve%limit_point)
            trace%number = number
            call copy_problem(own%list(i)%problem, follower%base)
            follower%state = own%list(i)%state
            call copy_problem(follower%base, follower%problem)
            follower%curve = curve
            follower%system = new_system(follower%base)
            follower%coordinate = as_coordinate(curve, present_value(follower%base, curve))
            trace%start = follower%coordinate
            follower%unit(2) = abs(curve%increment)
            ! Unit of the arc length a. For the first step it is a length over which the path is curved, later the change of a in
            ! one step along the curve.
            follower%unit(1) = first_distance
            call set_follower_tangent(follower, own%list(i)%direction, own%list(i)%direction_load)
            if (.not. follower%system%ok) then
               trouble = 'the tangent at the limit point is singular'
               return
            end if
            call scale_rate(follower, trial)
            call evaluate_rate(follower, [0.0_wp, 0.0_wp], trial)
            if (.not. trial%report%converged) then
               trouble = trial%report%message
               return
            end if
            call refine_limit_point(follower, step, bars)
            call report(step, trace, trial, '  ', .false., bars, recorder, outcome)
            trace%points = 1
            trace%way = [0.0_wp, sign(1.0_wp, curve%increment)]
            ! At the first point the change of a in one step along the curve is not known yet.
            trace%distance = first_step
            trace%turned_at = follower%coordinate
         end associate
      end subroutine begin_curve

      !> Restores a run on a limit curve from a checkpoint whose frame has been read.
      subroutine restore_trace()
         call exchange_trace(saved%archive, own, trace, outcome)
         call clear_end(outcome)
         if (.not. saved%changed) return
         call change_steps(saved%steps, trace%follower%base)
         call change_steps(saved%steps, trace%follower%problem)
      end subroutine restore_trace
   end subroutine follow_limit_curves

   !> Follows one limit curve from the limit point reached by `trace`. Passes checkpoints to the recorder at limit points.
   subroutine follow_curve(step, own, trace, frame, recorder, trouble, outcome)
      type(step_t), intent(in) :: step
      type(critical_points_t), intent(inout) :: own
      type(curve_trace_t), intent(inout) :: trace
      type(archive_t), intent(inout) :: frame
      class(recorder_t), intent(inout) :: recorder
      character(:), allocatable, intent(out) :: trouble !! reason why the curve ends before the last value of its parameter
      type(outcome_t), intent(inout) :: outcome
      type(trial_t) :: trial
      type(error_bars_t), allocatable :: bars
      real(wp) :: place(2), last, largest, target
      integer :: searches
      logical :: final, exact

      final = .false.
      associate (curve => step%limit_curve(trace%number), follower => trace%follower, points => trace%points, cuts => trace%cuts, &
         & way => trace%way, distance => trace%distance)
         last = as_coordinate(curve, curve%last)
         largest = max(curve%largest / abs(curve%increment), 1.0_wp)
         do while (points < curve%max_points)
            if (cut_short(outcome)) return
            call save_trace(must_end(outcome))
            if (allocated(outcome%why)) return
            place = distance * way
            call shorten_to_values(place, exact, final)
            call search_near(place, merge([1.0_wp, 0.0_wp], [way(2), -way(1)], exact .or. points == 1))
            if (trial%report%converged .and. .not. exact) then
               call shorten_to_values(place, exact, final)
               ! The search has passed a requested value of the parameter and is repeated at exactly this value.
               if (exact) call search_near(place, [1.0_wp, 0.0_wp])
            end if
            if (trial%report%converged) then
               call add_point()
               if (allocated(trouble) .or. allocated(outcome%why)) return
               if (final) exit
               if (searches < easy) distance = min(1.5_wp * distance, largest / max(abs(way(2)), 0.1_wp))
               if (searches > 2 * easy) distance = 0.5_wp * distance
            else
               cuts = cuts + 1
               distance = 0.5_wp * distance
               if (cuts > max_cuts) then
                  trouble = 'no further limit point beyond parameter '// &
                     & to_text(as_value(curve, follower%coordinate))//': '//trial%report%message
                  return
               end if
            end if
         end do
         if (.not. final) then
            trouble = 'the allowed number of points was used up before the last value'
         else if (curve%to_rigid) then
            call add_rigid_point()
         end if
      end associate

   contains

      !> Takes the trial of the search as the next limit point of the curve, refines its mesh and reports it.
      subroutine add_point()
         character(2) :: label
         logical :: turned
         associate (curve => step%limit_curve(trace%number), follower => trace%follower, way => trace%way)
            if (trial%problem%has_spans()) then
               if (.not. spans_hold(trial%problem, trial%state, follower%system%force_scale)) then
                  trouble = 'its contacts change beyond parameter '//to_text(as_value(curve, follower%coordinate))
                  return
               end if
            end if
            trace%cuts = 0
            trace%points = trace%points + 1
            turned = place(2) * way(2) < 0.0_wp
            if (norm2(place) > 0.0_wp) way = place / norm2(place)
            follower%coordinate = follower%coordinate + place(2) * follower%unit(2)
            call accept_trial()
            if (.not. follower%system%ok) then
               trouble = 'the tangent at a limit point is singular'
               return
            end if
            if (exact) follower%coordinate = target
            call refine_limit_point(follower, step, bars)
            label = merge('TP', '  ', turned)
            if (exact) label = 'UZ'
            if (final .and. .not. curve%to_rigid) label = 'EP'
            call report(step, trace, trial, label, .false., bars, recorder, outcome)
            if (final .or. allocated(outcome%why)) return
            if (turned .and. .not. exact) trace%turned_at = as_value(curve, follower%coordinate)
            if ((follower%coordinate - trace%start) * sign(1.0_wp, last - trace%start) < 0.0_wp) then
               trouble = 'it turned back near '//to_text(trace%turned_at)//' and is now before its start: it never reaches the '// &
                  & 'last value'
            end if
         end associate
      end subroutine add_point

      !> Ends a curve whose parameter is a stiffness: searches the limit point of the rigid obstacle and reports it.
      subroutine add_rigid_point()
         real(wp), allocatable :: direction(:, :)
         logical :: ok
         associate (curve => step%limit_curve(trace%number), follower => trace%follower)
            direction = follower%control%tangent
            call make_rigid(curve, follower%problem, follower%state, direction, ok)
            call copy_problem(follower%problem, follower%base)
            follower%system = new_system(follower%problem)
            if (.not. ok) then
               trouble = 'no equilibrium was found on the mesh that the rigid obstacle is to have'
               return
            end if
            call set_follower_tangent(follower, direction, 0.0_wp)
            place = 0.0_wp
            call search(follower, step, place, [1.0_wp, 0.0_wp], trial, searches)
            if (.not. trial%report%converged) then
               trouble = 'no limit point was found with the obstacle rigid: '//trial%report%message
               return
            end if
            call accept_trial()
            if (follower%problem%has_spans()) then
               if (.not. spans_hold(follower%problem, follower%state, follower%system%force_scale)) then
                  trouble = 'where the rigid obstacle touches is not where the foundation pushed'
                  return
               end if
               call refine_limit_point(follower, step, bars)
            end if
            call report(step, trace, trial, 'EP', .true., bars, recorder, outcome)
         end associate
      end subroutine add_rigid_point

      !> Searches near a predicted position for the zero of h, the load rate (module header). A zero farther from the prediction
      !> belongs to another limit point, or to the part of the curve that is known already.
      subroutine search_near(at, normal)
         real(wp), intent(inout) :: at(2)
         real(wp), intent(in) :: normal(2)
         real(wp) :: predicted(2)
         predicted = at
         call search(trace%follower, step, at, normal, trial, searches)
         if (.not. trial%report%converged .or. trace%points == 1) return
         if (norm2(at - predicted) <= farthest * norm2(predicted) .and. &
            & (trace%points == 2 .or. exact .or. dot_product(at, trace%way) >= sharpest * norm2(at))) return
         trial%report%converged = .false.
         trial%report%message = 'the curve turns too sharply, or ends'
      end subroutine search_near

      !> Shortens a step so that it ends at the last value of the parameter, or at the first requested value that it would pass.
      subroutine shorten_to_values(at, shortened, is_last)
         real(wp), intent(inout) :: at(2)
         logical, intent(out) :: shortened, is_last
         real(wp) :: reached, value
         integer :: j, n
         shortened = .false.
         is_last = .false.
         associate (values => step%limit_curve(trace%number)%at)
            n = size(values)
            do j = 1, n + 1
               value = last
               if (j <= n) value = as_coordinate(step%limit_curve(trace%number), values(j))
               reached = trace%follower%coordinate + at(2) * trace%follower%unit(2)
               if (j == n + 1) then
                  ! A step that ends beyond the last value is shortened without exception.
                  if ((reached - last) * (last - trace%start) < 0.0_wp) cycle
               else
                  if ((value - trace%follower%coordinate) * at(2) <= 1.0e-9_wp * abs(at(2)) .or. &
                     & (reached - value) * at(2) < 0.0_wp) cycle
               end if
               at = at * ((value - trace%follower%coordinate) / (at(2) * trace%follower%unit(2)))
               target = value
               shortened = .true.
               is_last = j == n + 1
            end do
         end associate
      end subroutine shorten_to_values

      !> Accepts the trial of the search as the last limit point of the curve.
      subroutine accept_trial()
         real(wp), allocatable :: direction(:, :)
         real(wp) :: unit
         direction = trace%follower%control%tangent
         call copy_problem(trial%problem, trace%follower%problem)
         trace%follower%state = trial%state
         call renew_marks(trace%follower%base, trace%follower%problem, trace%follower%state, direction, trace%follower%system%ok)
         if (.not. trace%follower%system%ok) return
         trace%follower%system = new_system(trace%follower%problem)
         call linearise(trace%follower%problem, trace%follower%state, trace%follower%state, trace%follower%system)
         call set_follower_tangent(trace%follower, direction, 0.0_wp)
         ! The unit of arc length is the length over which the load falls by a hundredth. The direction of the step is converted to
         ! the new unit. Near a turning point of the curve, where the slope vanishes, the unit is not changed.
         if (abs(trial%slope) > 0.0_wp .and. abs(trace%way(1)) < 0.3_wp) then
            unit = sqrt(2.0_wp * small_drop * abs(trace%follower%state%load_factor) * trace%follower%unit(1) / abs(trial%slope))
            unit = min(max(unit, 0.5_wp * trace%follower%unit(1)), 2.0_wp * trace%follower%unit(1))
            trace%way(1) = trace%way(1) * trace%follower%unit(1) / unit
            trace%way = trace%way / norm2(trace%way)
            trace%follower%unit(1) = unit
         end if
      end subroutine accept_trial

      !> Stores a checkpoint and passes it to the recorder, if the recorder requests a checkpoint.
      subroutine save_trace(now)
         logical, intent(in) :: now                       ! true: stored even if the recorder does not request a checkpoint
         type(error_t), allocatable :: error
         integer :: n
         if (frame%n == 0 .or. .not. (now .or. recorder%wants_state())) return
         n = frame%n
         call exchange_trace(frame, own, trace, outcome)
         call recorder%state(frame%words(:frame%n), error)
         call archive_reset(frame, n)
         if (allocated(error) .and. .not. allocated(outcome%why)) outcome%why = error%message
      end subroutine save_trace
   end subroutine follow_curve

   !> Passes the last limit point to the recorder, unless the run was cut short.
   subroutine report(step, trace, trial, label, rigid, bars, recorder, outcome)
      type(step_t), intent(in) :: step
      type(curve_trace_t), intent(in) :: trace
      type(trial_t), intent(in) :: trial             !! evaluation of h with which the limit point was found
      character(2), intent(in) :: label
      logical, intent(in) :: rigid
      type(error_bars_t), allocatable, intent(inout) :: bars !! error bars of the limit point; in: not allocated: unknown; out: not
      !! allocated
      class(recorder_t), intent(inout) :: recorder
      type(outcome_t), intent(inout) :: outcome
      type(limit_point_t) :: point
      type(error_t), allocatable :: error
      if (cut_short(outcome)) return
      associate (follower => trace%follower, curve => step%limit_curve(trace%number))
         point%step = follower%base%step
         point%curve = trace%number
         point%parameter = as_value(curve, follower%coordinate)
         point%rigid = rigid
         point%load_factor = follower%state%load_factor
         point%iterations = trial%iterations
         point%residual = trial%report%residual
         point%load_rate = abs(trial%rate) / follower%rate_scale
         point%monitor = monitor_values(follower%problem, follower%state, follower%system)
         point%label = label
         if (step%error_bars) then
            if (.not. allocated(bars)) call bars_here(follower, bars)
            call move_alloc(bars, point%bars)
            call note_curve_bar(follower%problem, point, trim(curve%name), step, outcome%accuracy)
         end if
         call recorder%take(point, error)
         if (allocated(error)) outcome%why = error%message
      end associate
   end subroutine report

   !> Stores or reads the part of the checkpoint after the frame.
   subroutine exchange_trace(a, own, trace, outcome)
      type(archive_t), intent(inout) :: a
      type(critical_points_t), intent(inout) :: own
      type(curve_trace_t), intent(inout) :: trace
      type(outcome_t), intent(inout) :: outcome
      call exchange_critical_points_t(a, own)
      call exchange_curve_trace_t(a, trace)
      call exchange_outcome_t(a, outcome)
   end subroutine exchange_trace
end module limit_curves

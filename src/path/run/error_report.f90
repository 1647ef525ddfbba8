!> Decides which points of a path get discretisation error bars, calls the estimator for their kind, and stores the largest bar,
!> with a message if a bar is wider than the deck allows.
module error_report
   use kinds, only: wp
   use text, only: to_text
   use model, only: step_t, method_linearised
   use problem, only: problem_t
   use rod_state, only: state_t
   use state_transfer, only: find_point, carried_field
   use path_control, only: control_t, path_length, prescribed_change
   use path_continuity, only: path_tangent_t, path_tangent_at
   use monitors, only: monitor_values
   use linear_system, only: system_t, new_system
   use bordered_system, only: linearise
   use force_free_contact, only: remove_force_free_lines
   use test_kinds, only: span_test_t, test_force
   use span_tests, only: run_span_tests
   use contact_labels, only: is_contact_label
   use path_events, only: event_t, event_limit, event_bifurcation, event_contact, event_release
   use path_point, only: path_point_t
   use path_state, only: path_state_t
   use enriched_problem, only: enriched_problem_t
   use error_bar, only: error_bar_t, error_bars_t, no_error_bars, shifted_error_bar, allowed_part, lacks_bound, bar_of
   use path_errors, only: point_errors, event_errors
   use located_zero, only: zero_t, new_zero
   use null_directions, only: tangent_without
   use mesh_request, only: excess
   use node_contact_functional, only: is_stop
   use error_text, only: bar_text
   use path_record, only: buckling_t, limit_point_t, accuracy_t, place_t, note_worst, check_error_bar
   use columns, only: brief, scientific
   use timing, only: timing_start, timing_stop, phase_accuracy
   implicit none
   private
   public :: bars_at_event, bars_at_point, bars_at_contact_start, note_load, tolerance_at, note_buckling_bars, &
      & note_curve_bar, bars_on_curve, note_error

   character(*), parameter :: hidden = 'lines without pressure beside others hide what lets go', &
      & at_nodes = 'contact at nodes begins and ends with the nodes of the mesh', &
      & kinks = 'the load turns at a corner of the path, where no rate is zero', &
      & waves = 'elements too coarse for the gap between their nodes tell where contact with a foundation changes'

contains

   !> Computes the error bars of an event located between the last accepted point and a trial. For a detachment the estimator uses
   !> the reduced problem, that is, the structure without the elements of force-free line contacts.
   subroutine bars_at_event(problem, step, run, trial, event, point, bars, keeps_mesh)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(inout) :: run   !! state of the run; its stored enriched problem is used again and updated
      type(path_point_t), intent(in) :: trial
      type(event_t), intent(in) :: event
      type(path_point_t), intent(in) :: point    !! the located event as a point of the path
      type(error_bars_t), allocatable, intent(out) :: bars !! error bars; not allocated: the deck requests no error bars
      logical, intent(in) :: keeps_mesh          !! true: the mesh is not refined because of these bars
      type(zero_t) :: zero
      type(error_bars_t) :: of_rate              ! error bars of the zero of the load rate
      if (.not. step%error_bars) return
      allocate (bars)
      call timing_start(phase_accuracy)
      if (event%kind == event_release) then
         call bars_at_release()
      else if (event%corner .and. .not. at_law_of_stop(problem, event)) then
         bars = no_error_bars(size(problem%model%monitor), kinks)
      else if (is_at_mesh_nodes(problem, event)) then
         bars = no_error_bars(size(problem%model%monitor), at_nodes)
      else if (event%jumps) then
         ! An eigenvalue jumps from one sign to the other where the line contact vanishes, so that the free spans buckle there. The
         ! event is at this place, at the load of `point`.
         call point_errors(problem, run%mesh%enriched, point%state, point%system, control_t(method=method_linearised), &
            & point%tangent, bars, places=.true., keeps_mesh=keeps_mesh)
         ! The numbers of negative pivots before and behind the event depend on the mesh and are not compared. Only the sign of the
         ! load rate behind the event is compared.
         bars%missed = 0
         call new_zero(problem, event_t(kind=event_limit), point%state, point%system, zero)
         call errors_at_zero(point%tangent, of_rate)
         bars%turned = of_rate%turned
         bars%unsure = bars%turned
      else if (event%prescribed) then
         call point_errors(problem, run%mesh%enriched, point%state, point%system, prescribed_change(event%monitor, 0.0_wp), &
            & point%tangent, bars, places=.true., keeps_mesh=keeps_mesh)
      else if (event%meets) then
         ! At a bifurcation where the load of this path has an extremum, the error bars are computed on the path that crosses there,
         ! because an eigenvalue passes through zero along that path.
         call new_zero(problem, as_bifurcation(event), point%state, point%system, zero)
         call errors_at_zero(tangent_without(problem, point%system, zero%modes), bars)
      else
         call new_zero(problem, event, point%state, point%system, zero)
         call errors_at_zero(point%tangent, bars)
         ! On a stiff foundation a coarse mesh given by the deck causes small contact changes that finer meshes do not have. Such a
         ! change has no error bar.
         if (event%kind == event_contact .and. bars%load%estimated .and. .not. bars%load%bounded .and. &
            & .not. any(problem%layout%rod_segment%placed)) bars = no_error_bars(size(problem%model%monitor), waves)
      end if
      call timing_stop(phase_accuracy)

   contains

      !> Error bars of an event at `point`, a zero of its event function along the path with the tangent `on`.
      subroutine errors_at_zero(on, bars)
         type(path_tangent_t), intent(in) :: on
         type(error_bars_t), intent(out) :: bars
         call event_errors(problem, run%mesh%enriched, point%state, point%system, zero, on, length(), rise(), bars, keeps_mesh)
      end subroutine errors_at_zero

      !> Arc length from the last accepted point to the trial.
      real(wp) function length()
         length = path_length(problem, run%last%state, trial%state)
      end function length

      !> Change of the load factor from the last accepted point to the trial.
      pure real(wp) function rise()
         rise = trial%state%load_factor - run%last%state%load_factor
      end function rise

      !> Bars of a detachment: a bifurcation of the reduced problem without force-free line contacts. There are no bars if free
      !> spans on a straight wall, which rotate without energy, make the null vector indistinguishable.
      subroutine bars_at_release()
         type(problem_t) :: free
         type(enriched_problem_t) :: finer
         type(state_t) :: released
         type(system_t) :: loose
         type(path_tangent_t) :: on
         logical :: any_weak
         call remove_force_free_lines(problem, point%state, point%system, free, released, any_weak)
         bars = no_error_bars(size(problem%model%monitor), hidden)
         if (.not. any_weak) return
         loose = new_system(free)
         call linearise(free, released, released, loose)
         ! The system is singular: a solution for its tangent would contain a multiple of the null vector. Instead the known path
         ! tangent is transferred to the reduced problem.
         on = path_tangent_t(carried_field(problem, point%state, point%tangent%u, free, released), point%tangent%load)
         call new_zero(free, as_bifurcation(event), released, loose, zero)
         call event_errors(free, finer, released, loose, zero, on, length(), rise(), bars)
         ! If the program may make another mesh, bars without bounds are kept, too, because they lead to a finer mesh.
         if (any(problem%layout%rod_segment%placed)) return
         if (bars%why /= '' .or. .not. (bars%load%estimated .and. bars%load%bounded)) &
            & bars = no_error_bars(size(problem%model%monitor), hidden)
      end subroutine bars_at_release
   end subroutine bars_at_event

   !> The event as a bifurcation.
   pure type(event_t) function as_bifurcation(event) result(bifurcation)
      type(event_t), intent(in) :: event
      bifurcation = event
      bifurcation%kind = event_bifurcation
   end function as_bifurcation

   !> Computes the error bars of an accepted point. The point is determined either by a test of contact spans that is zero, or by
   !> the constraint of the control.
   subroutine bars_at_point(problem, step, run, point, label, finished, test, bars, wanted, changing, keeps_mesh, ahead)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(inout) :: run !! state of the run; its last point is the previous point of the path, and its stored
      !! enriched problem is used again and updated
      type(path_point_t), intent(in) :: point
      character(*), intent(in) :: label !! label of the point; points with label C+ or C- are listed in the table of critical points
      logical, intent(in) :: finished            !! true: the point is the end of the step
      integer, intent(in) :: test                !! index of the vanishing test in run_span_tests; 0: none
      type(error_bars_t), allocatable, intent(out) :: bars !! error bars; not allocated: the deck requests no error bars at this
      !! point
      logical, intent(in), optional :: wanted    !! true: bars are computed at every point
      logical, intent(in), optional :: changing(:) !! (candidates) true: contact at the node begins or ends at `point`
      logical, intent(in), optional :: keeps_mesh !! true: the mesh is not refined because of these bars
      type(state_t), intent(in), optional :: ahead !! a later equilibrium, present if the vanishing test is zero at the run's last
      !! point itself. The increment to this equilibrium gives arc length and load change of the path
      type(zero_t) :: zero
      type(state_t) :: to                        ! end of the increment that contains the zero
      logical :: everywhere, has_zero
      everywhere = step%bars_everywhere
      if (present(wanted)) everywhere = everywhere .or. wanted
      if (.not. (step%error_bars .and. (label /= '' .or. finished .or. everywhere))) return
      allocate (bars)
      call timing_start(phase_accuracy)
      zero%test = test
      zero%force_scale = scale_on_the_way(run, point)
      if (label /= '' .and. present(changing)) then
         if (only_stops(problem, changing)) then
            allocate (zero%event)
            zero%event = event_t(kind=event_contact, label=label, marked=changing)
         end if
      end if
      has_zero = allocated(zero%event) .or. (test > 0 .and. (label == '' .or. problem%has_spans()))
      if (has_zero) then
         to = point%state
         if (present(ahead)) to = ahead
         call event_errors(problem, run%mesh%enriched, point%state, point%system, zero, point%tangent, path_length(problem, &
            & run%last%state, to), to%load_factor - run%last%state%load_factor, bars)
      else if (label /= '' .and. .not. problem%has_spans()) then
         bars = no_error_bars(size(problem%model%monitor), at_nodes)
      else if (label /= '') then
         bars = no_error_bars(size(problem%model%monitor), 'a whole span lies down here')
      else
         call point_errors(problem, run%mesh%enriched, point%state, point%system, run%control, point%tangent, bars, &
            & places=label /= '' .or. finished .or. step%bars_everywhere, keeps_mesh=keeps_mesh)
      end if
      call timing_stop(phase_accuracy)
   end subroutine bars_at_point

   !> Scale of forces between the run's last point and another point: the larger of the scales at the two points.
   pure real(wp) function scale_on_the_way(run, point) result(scale)
      type(path_state_t), intent(in) :: run
      type(path_point_t), intent(in) :: point    !! system factored
      scale = max(run%last%system%force_scale, point%system%force_scale, tiny(scale))
   end function scale_on_the_way

   !> True if the event is a limit point at a corner of the force law of a stop. A stop is at the same node on all meshes; the zero
   !> of its gap function therefore gives an error bar.
   pure logical function at_law_of_stop(problem, event) result(at)
      type(problem_t), intent(in) :: problem
      type(event_t), intent(in) :: event
      at = event%law%candidate > 0
      if (at) at = is_stop(problem, event%law%candidate)
   end function at_law_of_stop

   !> True if the event is a contact change at nodes whose positions depend on the mesh, so that there is no error bar.
   pure logical function is_at_mesh_nodes(problem, event) result(is)
      type(problem_t), intent(in) :: problem
      type(event_t), intent(in) :: event
      is = event%kind == event_contact .and. event%ground%contact == 0
      if (is) is = .not. only_stops(problem, event%marked)
   end function is_at_mesh_nodes

   !> True if only contacts of stops change. A stop is at the same node on all meshes; the zero of its gap or reaction therefore
   !> gives an error bar.
   pure logical function only_stops(problem, changing)
      type(problem_t), intent(in) :: problem
      logical, intent(in) :: changing(:)         !! (candidates) true: the contact changes
      integer :: c
      only_stops = any(changing)
      do c = 1, size(changing)
         if (changing(c)) only_stops = only_stops .and. is_stop(problem, c)
      end do
   end function only_stops

   !> Computes the error bars of a point at which contact begins. The gap inside a free span is only as accurate as the polynomials
   !> of the elements. The force of the new contact is zero at the same load and depends on nodal values only. The error bars are
   !> therefore computed for the zero of this force.
   subroutine bars_at_contact_start(problem, step, run, point, begun, touched, newest, bars)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(in) :: run
      type(path_point_t), intent(in) :: point
      type(problem_t), intent(in) :: begun       !! the problem that includes the new contact
      type(path_point_t), intent(in) :: touched  !! point of `begun` at the same load, where the force of the new contact is zero
      integer, intent(in) :: newest              !! identity number of the contact span that begins
      type(error_bars_t), allocatable, intent(out) :: bars !! error bars; not allocated: the deck requests none, or contact begins
      !! at a fixed node
      type(enriched_problem_t) :: finer
      type(span_test_t), allocatable :: tests(:)
      type(zero_t) :: zero
      real(wp), allocatable :: here(:), there(:)
      integer :: k, m
      if (.not. step%error_bars) return
      call timing_start(phase_accuracy)
      tests = run_span_tests(begun, touched%state, touched%system%force_scale)
      do k = 1, size(tests)
         if (tests(k)%kind /= test_force) cycle
         if (begun%contact_span(tests(k)%contact_span)%number /= newest) cycle
         if (begun%candidates%moves(tests(k)%candidate)) zero%test = k
      end do
      zero%force_scale = scale_on_the_way(run, touched)
      if (zero%test > 0) then
         allocate (bars)
         call event_errors(begun, finer, touched%state, touched%system, zero, path_tangent_at(begun, &
            & touched%system, 0.0_wp * touched%state%u, point%tangent%load), path_length(problem, run%last%state, point%state), &
            & point%state%load_factor - run%last%state%load_factor, bars)
         if (allocated(bars%share)) bars%share = shares_on(begun, touched%state, bars%share, problem, point%state)
         ! The result has the monitors of the problem without the new contact. The bars are shifted by the difference between the
         ! two problems.
         here = monitor_values(problem, point%state, point%system)
         there = monitor_values(begun, touched%state, touched%system)
         do m = 1, size(bars%monitor)
            bars%monitor(m) = shifted_error_bar(bars%monitor(m), there(m) - here(m))
         end do
      end if
      call timing_stop(phase_accuracy)
   end subroutine bars_at_contact_start

   !> Assigns the error contributions of the elements of one mesh to the elements of another mesh that contain their midpoints.
   function shares_on(from, from_state, share, to, to_state) result(new)
      type(problem_t), intent(in) :: from, to    !! two meshes of the same deck
      type(state_t), intent(in) :: from_state, to_state
      real(wp), intent(in) :: share(:, :)        !! (numbers, elements of `from`) error contributions
      real(wp), allocatable :: new(:, :)
      real(wp) :: tau
      integer :: e, there
      allocate (new(size(share, 1), to%model%mesh%n_elements), source=0.0_wp)
      do e = 1, size(share, 2)
         call find_point(to, to_state, from%rod_segment(e), 0.5_wp * sum(from_state%geometry%element(e)%s) + from%origin(e), &
            & there, tau)
         new(:, there) = new(:, there) + share(:, e)
      end do
   end function shares_on

   !> Computes the error bars of a point of a limit curve by the method for limit points of a path.
   subroutine bars_on_curve(problem, state, system, heading, length, rise, bars)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system       !! factored at `state`
      type(path_tangent_t), intent(in) :: heading     !! path tangent at `state`
      real(wp), intent(in) :: length             !! arc length over which the load factor changes by `rise`
      real(wp), intent(in) :: rise               !! change of the load factor over the arc length `length`
      type(error_bars_t), allocatable, intent(out) :: bars
      type(enriched_problem_t) :: finer
      type(zero_t) :: zero
      allocate (bars)
      call timing_start(phase_accuracy)
      call new_zero(problem, event_t(kind=event_limit), state, system, zero)
      call event_errors(problem, finer, state, system, zero, heading, length, rise, bars)
      call timing_stop(phase_accuracy)
   end subroutine bars_on_curve

   !> Stores the largest absolute load factor of a step, to which relative error bars are related.
   pure subroutine note_load(step, load_factor, accuracy)
      integer, intent(in) :: step                !! index of the step
      real(wp), intent(in) :: load_factor        !! load factor of a point
      type(accuracy_t), intent(inout) :: accuracy
      if (step /= accuracy%load_step) accuracy%load = 0.0_wp
      accuracy%load_step = step
      accuracy%load = max(accuracy%load, abs(load_factor))
   end subroutine note_load

   !> Stores the largest relative error bar of the load factors of a buckling step, and a message about the first bar that is wider
   !> than allowed.
   subroutine note_buckling_bars(buckling, widest, accuracy)
      type(buckling_t), intent(in) :: buckling   !! modes and load factors with their error bars
      real(wp), intent(in) :: widest             !! largest error bar allowed, relative to the load factor
      type(accuracy_t), intent(inout) :: accuracy
      integer :: k
      do k = 1, size(buckling%load_factor)
         associate (bar => buckling%bar(k), factor => buckling%load_factor(k))
            if (bar%estimated) call note_ratio(bar, abs(factor), 'the load factor of buckling mode '//to_text(k)//' is '// &
               & brief(factor), place_t(step=buckling%step, load_factor=factor), widest, accuracy)
         end associate
      end do
   end subroutine note_buckling_bars

   !> Stores the largest relative error bar of a point on a limit curve. Monitors to which the deck applies the tolerance must have
   !> bounded bars.
   subroutine note_curve_bar(problem, point, name, step, accuracy)
      type(problem_t), intent(in) :: problem
      type(limit_point_t), intent(in) :: point   !! point of the curve with its error bars
      character(*), intent(in) :: name           !! name of the curve
      type(step_t), intent(in) :: step
      type(accuracy_t), intent(inout) :: accuracy
      integer :: k
      associate (bar => point%bars%load, factor => point%load_factor)
         if (bar%estimated .and. abs(factor) > 0.0_wp) call note_ratio(bar, abs(factor), 'on the limit curve '//name// &
            & ' at parameter '//brief(point%parameter)//' the load factor is '//brief(factor), &
            & place_t(step=point%step, load_factor=factor), step%widest_bar, accuracy)
      end associate
      do k = 1, size(step%asked_of)
         if (step%asked_of(k) == 0 .or. allocated(accuracy%bar_words)) cycle
         associate (bar => point%bars%monitor(step%asked_of(k)), monitor => problem%deck%monitor(step%asked_of(k)))
            if (lacks_bound(bar, step%widest_bar)) accuracy%bar_words = unbounded_words(trim(monitor%name)// &
               & ' on the limit curve '//name//' at parameter '//brief(point%parameter), bar)
         end associate
      end do
   end subroutine note_curve_bar

   !> Stores the largest relative bar, and a message about the first bar that is wider than the deck allows.
   subroutine note_ratio(bar, size, what, at, widest, accuracy)
      type(error_bar_t), intent(in) :: bar
      real(wp), intent(in) :: size               !! reference value to which the bar is related, > 0
      character(*), intent(in) :: what           !! words for the quantity; the message appends its bar
      type(place_t), intent(in) :: at
      real(wp), intent(in) :: widest
      type(accuracy_t), intent(inout) :: accuracy
      call note_worst(accuracy, check_error_bar, bar%bar / size, at)
      if (allowed_part(bar, widest, size) <= 1.0_wp .or. allocated(accuracy%bar_words)) return
      accuracy%bar_words = coarse_words(what//' '//bar_text(bar), brief(widest)//' of it')
   end subroutine note_ratio

   !> Message for a mesh given by the deck that is too coarse.
   pure function coarse_words(what, allowed) result(words)
      character(*), intent(in) :: what           !! words for the quantity with its bar
      character(*), intent(in) :: allowed
      character(:), allocatable :: words
      words = 'the mesh is too coarse for what was asked: '//what//', and WIDEST on *ACCURACY allows '//allowed// &
         & '; give more elements or a higher order'
   end function coarse_words

   !> Stores the largest relative bar of a critical load, and one message if an error bar of this point is unknown or wider than the
   !> deck allows. On a mesh made for a tolerance all points are checked, on a mesh given by the deck only points with a label. On
   !> both meshes only the numbers to which the deck applies the tolerance are checked.
   !>
   !> At the end of a step the load factor is usually prescribed by the deck: only the monitors can show there that the mesh is too
   !> coarse.
   subroutine note_error(problem, step, bars, sizes, label, at, accuracy)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(error_bars_t), intent(in) :: bars
      real(wp), intent(in) :: sizes(:)           !! (1 + monitors) values to which the errors are related
      character(*), intent(in) :: label          !! label of the critical point; '': none
      type(place_t), intent(in) :: at
      type(accuracy_t), intent(inout) :: accuracy
      character(:), allocatable :: what, there
      type(error_bar_t) :: widest
      real(wp) :: ratio, asked
      integer :: which
      logical :: made, by_value
      if (label /= '' .and. bars%load%estimated .and. accuracy%load > 0.0_wp) &
         & call note_worst(accuracy, check_error_bar, bars%load%bar / accuracy%load, at)
      made = any(problem%layout%rod_segment%placed)
      if (allocated(accuracy%bar_words) .or. .not. (made .or. label /= '')) return
      there = ' at point '//to_text(at%point)//' (load factor '//brief(at%load_factor)//')'
      if (label /= '') there = ' of '//label//there
      ! Points with prescribed values and turning points do not depend on the number of negative pivots.
      by_value = any(label == ['UZ', 'TP'])
      if (bars%missed /= 0 .and. .not. by_value) then
         accuracy%bar_words = 'the mesh is too coarse for the bifurcations'//there//': finer elements have '// &
            & to_text(abs(bars%missed))//trim(merge(' more ', ' fewer', bars%missed > 0))// &
            & ' unstable directions there; give more elements or a higher order'
         return
      end if
      if (bars%unsure .and. (label == 'LP' .or. bars%turned)) then
         accuracy%bar_words = 'the mesh is too coarse to tell whether the load turns'//there//': it errs by more than that '// &
            & 'falls; give more elements or a higher order'
         return
      end if
      if (bars%unsure .and. .not. by_value) then
         accuracy%bar_words = 'the mesh is too coarse for the bifurcations'//there//': it errs by all of an eigenvalue that is '// &
            & 'next to zero there; give more elements or a higher order'
         return
      end if
      if (allocated(bars%may_change) .and. .not. by_value) then
         accuracy%bar_words = 'the mesh is too coarse to tell whether contact begins or ends inside its elements'//there// &
            & '; give more elements or a higher order'
         return
      end if
      if (.not. (bars%load%estimated .or. any(bars%monitor%estimated))) then
         ! The table of critical points shows which points have no estimate on any mesh. Contact changes without a test function are
         ! not reported here, except on foundations from which rods lift off.
         if (.not. (bars%too_coarse .or. (made .and. (any(label == ['LP', 'BP', 'EP']) .or. &
            & (any(.not. problem%ground%chain%bilateral(:problem%ground%chain%n)) .and. is_contact_label(label)))))) return
         accuracy%bar_words = 'it is not known whether the errors'//there//' are within the tolerance: '//bars%why
         return
      end if
      asked = tolerance_at(problem, step, label)
      call excess(bars, sizes, step%asked_of, asked, label /= '', label /= '' .or. step%bars_everywhere, ratio, which)
      if (ratio <= 1.0_wp) then
         if (allocated(bars%place) .and. any(step%asked_of == 0)) call note_places()
         return
      end if
      what = 'the load factor'
      if (which > 0) what = trim(problem%deck%monitor(which)%name)
      widest = bar_of(bars, which)
      if (.not. widest%bounded .and. ratio >= huge(ratio)) then
         accuracy%bar_words = unbounded_words(what//there, widest)
      else if (made) then
         accuracy%bar_words = 'the errors asked for are not reached: the error bar of '//what//there//' is '// &
            & scientific(ratio * asked, 2)//' of its size, TOLERANCE on *ACCURACY allows '//brief(asked)
         if (2.0_wp * widest%rounding > widest%bar) accuracy%bar_words = accuracy%bar_words// &
            & '; rounding does not allow more than '//scientific(2.0_wp * widest%rounding / sizes(1 + which), 1)
      else
         accuracy%bar_words = coarse_words(what//there//' has the error bar '//bar_text(widest), brief(asked)//' of '// &
            & brief(sizes(1 + which)))
      end if

   contains

      !> Adds a message about the first touchdown point whose position has no bounded error.
      subroutine note_places()
         integer :: k
         do k = 1, size(bars%place)
            if (.not. lacks_bound(bars%place(k)%bar, asked)) cycle
            accuracy%bar_words = unbounded_words('where contact ends at '//brief(bars%place(k)%at)//' along its rod'//there, &
               & bars%place(k)%bar)
            return
         end do
      end subroutine note_places
   end subroutine note_error

   !> Message about a number whose error has no bound.
   pure function unbounded_words(what, bar) result(words)
      character(*), intent(in) :: what           !! words for the quantity
      type(error_bar_t), intent(in) :: bar
      character(:), allocatable :: words
      words = 'the error of '//what//' is not known: '//bar_text(bar)//', and no bound; give more elements or a higher order'
   end function unbounded_words

   !> Relative error allowed at a point: the tolerance for which the mesh is made or, on a mesh given by the deck, the largest error
   !> bar that the deck allows.
   pure real(wp) function tolerance_at(problem, step, label) result(asked)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      character(*), intent(in) :: label          !! label of the critical point; '': none
      asked = step%widest_bar
      if (.not. any(problem%layout%rod_segment%placed)) return
      asked = max(step%asked, step%widest_bar)
      if (label == '') asked = step%asked_of_path
   end function tolerance_at
end module error_report

!> Which points of a run have their discretisation errors told, and of what kind they are.
module error_report
   use kinds, only: wp
   use model, only: step_t, method_linearised
   use problem, only: problem_t
   use rod_state, only: state_t
   use state_transfer, only: find_point, carried_field
   use path_control, only: control_t, path_length, holding_value
   use path_continuity, only: path_tangent_t, path_tangent_at
   use monitors, only: monitor_values
   use linear_system, only: system_t, new_system
   use bordered_system, only: linearise
   use force_free_contact, only: remove_force_free_lines
   use test_kinds, only: span_test_t, test_force
   use span_tests, only: run_span_tests
   use path_events, only: event_t, event_limit, event_bifurcation, event_contact, event_release
   use path_state, only: path_state_t
   use enriched_problem, only: enriched_problem_t
   use error_bar, only: error_bar_t, error_bars_t, no_error_bars, shifted_error_bar, allowed_part, lacks_bound
   use path_errors, only: point_errors, event_errors
   use located_zero, only: zero_t, new_zero
   use mesh_request, only: excess
   use stop_forces, only: is_stop
   use error_text, only: bar_text
   use run_accuracy, only: accuracy_t, place_t, note_worst
   use path_record, only: buckling_t, limit_point_t
   use columns, only: whole, brief, scientific
   use timing, only: timing_start, timing_stop, phase_accuracy
   implicit none
   private
   public :: bars_at_event, bars_at_point, bars_at_touch, note_load, asked_at, note_buckling_bars, &
      & note_curve_bar, bars_on_curve, note_error

   character(*), parameter :: hidden = 'lines without pressure beside others hide what lets go', &
      & at_nodes = 'contact at nodes begins and ends with the nodes of the mesh', &
      & waves = 'elements too coarse for the gap between their nodes tell where contact with a foundation changes'

contains

   !> Bars of an event of the path that was located between the run's last point and a trial. Where lines let go their shares are
   !> those of elements without these lines.
   subroutine bars_at_event(problem, step, run, trial, event, place, heading, bars, as_it_is)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(inout) :: run          !! its system is factored at the place
      type(state_t), intent(in) :: trial
      type(event_t), intent(in) :: event
      type(state_t), intent(in) :: place
      type(path_tangent_t), intent(in) :: heading     !! tangent there
      type(error_bars_t), allocatable, intent(out) :: bars !! not allocated: the deck does not want them
      logical, intent(in), optional :: as_it_is  !! no other mesh will be made for their sake
      type(zero_t) :: zero
      if (.not. step%error_bars) return
      allocate (bars)
      call timing_start(phase_accuracy)
      if (event%kind == event_release) then
         call bars_at_release()
      else if (is_at_mesh_nodes(problem, event)) then
         bars = no_error_bars(size(problem%model%monitor), at_nodes)
      else if (event%jumps) then
         ! Free spans buckle: it is where the line is none, at a load that stands.
         call point_errors(problem, run%finer, place, run%system, control_t(method=method_linearised), heading, bars, &
            & places=.true., as_it_is=as_it_is)
         ! Which of both sides a mesh has there tells nothing, but whether the load goes on as it does on this one.
         bars%missed = 0
         bars%turned = load_turns()
         bars%unsure = bars%turned
      else if (event%held) then
         call point_errors(problem, run%finer, place, run%system, holding_value(event%monitor, 0.0_wp), heading, bars, &
            & places=.true., as_it_is=as_it_is)
      else
         call new_zero(problem, event, place, run%system, zero)
         call event_errors(problem, run%finer, place, run%system, zero, heading, path_length(problem, run%state, trial), &
            & trial%load_factor - run%state%load_factor, bars, as_it_is)
         ! On stiff ground a given mesh makes small changes of contact of its own.
         if (event%kind == event_contact .and. bars%load%told .and. .not. bars%load%bounded .and. &
            & .not. any(problem%layout%stretch%placed)) bars = no_error_bars(size(problem%model%monitor), waves)
      end if
      call timing_stop(phase_accuracy)

   contains

      !> True where finer elements have the load change the other way behind the place.
      logical function load_turns() result(turns)
         type(error_bars_t) :: of_rate
         call new_zero(problem, event_t(kind=event_limit), place, run%system, zero)
         call event_errors(problem, run%finer, place, run%system, zero, heading, path_length(problem, run%state, trial), &
            & trial%load_factor - run%state%load_factor, of_rate, as_it_is)
         turns = of_rate%turned
      end function load_turns

      !> Of a bifurcation of the rod without lines that carry no force: there it is one like others, unless free spans on a straight
      !> wall, which turn at no cost, hide its null vector.
      subroutine bars_at_release()
         type(problem_t) :: free
         type(enriched_problem_t) :: finer
         type(state_t) :: released
         type(system_t) :: loose
         type(event_t) :: one
         type(path_tangent_t) :: on
         logical :: any_weak
         call remove_force_free_lines(problem, place, run%system, free, released, any_weak)
         bars = no_error_bars(size(problem%model%monitor), hidden)
         if (.not. any_weak) return
         loose = new_system(free)
         call linearise(free, released, released, loose)
         ! The singular tangent would add a share of its null vector, whatever presses the lines a little.
         on = path_tangent_t(carried_field(problem, place, heading%u, free, released), heading%load)
         one = event
         one%kind = event_bifurcation
         call new_zero(free, one, released, loose, zero)
         call event_errors(free, finer, released, loose, zero, on, path_length(problem, run%state, trial), &
            & trial%load_factor - run%state%load_factor, bars)
         ! Another mesh may tell.
         if (any(problem%layout%stretch%placed)) return
         if (bars%why /= '' .or. .not. (bars%load%told .and. bars%load%bounded)) &
            & bars = no_error_bars(size(problem%model%monitor), hidden)
      end subroutine bars_at_release
   end subroutine bars_at_event

   !> Bars of an accepted point: of one where a test of contact spans is zero, or of any, which the control holds.
   subroutine bars_at_point(problem, step, run, place, heading, label, finished, test, bars, wanted, changing, &
      & as_it_is)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(inout) :: run          !! its system is factored there; its state is the last point
      type(state_t), intent(in) :: place
      type(path_tangent_t), intent(in) :: heading     !! tangent there
      character(*), intent(in) :: label          !! C+ and C- are told in the table of critical points
      logical, intent(in) :: finished            !! and so is the end
      integer, intent(in) :: test                !! number of the test in run_span_tests; 0: none
      type(error_bars_t), allocatable, intent(out) :: bars !! not allocated: the deck does not want them
      logical, intent(in), optional :: wanted    !! at every point
      logical, intent(in), optional :: changing(:) !! (candidates) whose contact at a node begins or ends there
      logical, intent(in), optional :: as_it_is  !! no other mesh will be made for their sake
      type(zero_t) :: zero
      logical :: everywhere
      everywhere = step%bars_everywhere
      if (present(wanted)) everywhere = everywhere .or. wanted
      if (.not. (step%error_bars .and. (label /= '' .or. finished .or. everywhere))) return
      allocate (bars)
      call timing_start(phase_accuracy)
      zero%test = test
      if (label /= '' .and. present(changing)) then
         if (only_stops(problem, changing)) then
            allocate (zero%event)
            zero%event = event_t(kind=event_contact, label=label, marked=changing)
         end if
      end if
      if (allocated(zero%event)) then
         call event_errors(problem, run%finer, place, run%system, zero, heading, path_length(problem, run%state, place), &
            & place%load_factor - run%state%load_factor, bars)
      else if (label /= '' .and. .not. problem%has_spans()) then
         bars = no_error_bars(size(problem%model%monitor), at_nodes)
      else if (label /= '' .and. test == 0) then
         bars = no_error_bars(size(problem%model%monitor), 'a whole span lies down here')
      else if (test > 0) then
         call event_errors(problem, run%finer, place, run%system, zero, heading, path_length(problem, run%state, place), &
            & place%load_factor - run%state%load_factor, bars)
      else
         call point_errors(problem, run%finer, place, run%system, run%control, heading, bars, &
            & places=label /= '' .or. finished .or. step%bars_everywhere, as_it_is=as_it_is)
      end if
      call timing_stop(phase_accuracy)
   end subroutine bars_at_point

   !> True for a change of contact at nodes that another mesh has elsewhere.
   pure logical function is_at_mesh_nodes(problem, event) result(is)
      type(problem_t), intent(in) :: problem
      type(event_t), intent(in) :: event
      is = event%kind == event_contact .and. event%ground%contact == 0
      if (is) is = .not. only_stops(problem, event%marked)
   end function is_at_mesh_nodes

   !> True where contact begins or ends at stops alone, which stand at the same nodes on all meshes: gap and reaction tell.
   pure logical function only_stops(problem, changing)
      type(problem_t), intent(in) :: problem
      logical, intent(in) :: changing(:)         !! (candidates)
      integer :: c
      only_stops = any(changing)
      do c = 1, size(changing)
         if (changing(c)) only_stops = only_stops .and. is_stop(problem, c)
      end do
   end function only_stops

   !> Bars of a point where contact begins. The gap of a free span is known as well as its elements' polynomials only; where the
   !> force of the new contact vanishes the nodes tell.
   subroutine bars_at_touch(problem, step, run, place, heading, begun, touched, bars)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(path_state_t), intent(inout) :: run          !! its system is factored at the place
      type(state_t), intent(in) :: place
      type(path_tangent_t), intent(in) :: heading     !! tangent there
      type(problem_t), intent(in) :: begun       !! the problem with the new contact
      type(path_state_t), intent(in) :: touched         !! at the same load, where the contact carries nothing yet; its system is
      !! factored there
      type(error_bars_t), allocatable, intent(out) :: bars !! not allocated: the deck does not want them, or a node touches first
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
         if (begun%touch(tests(k)%touch)%number /= touched%touches) cycle
         if (begun%candidates%moves(tests(k)%candidate)) zero%test = k
      end do
      if (zero%test > 0) then
         allocate (bars)
         call event_errors(begun, finer, touched%state, touched%system, zero, path_tangent_at(begun, touched%system, &
            & 0.0_wp * touched%state%u, heading%load), path_length(problem, run%state, place), &
            & place%load_factor - run%state%load_factor, bars)
         if (allocated(bars%share)) bars%share = shares_on(begun, touched%state, bars%share, problem, place)
         ! The numbers told are those without the contact.
         here = monitor_values(problem, place, run%system)
         there = monitor_values(begun, touched%state, touched%system)
         do m = 1, size(bars%monitor)
            bars%monitor(m) = shifted_error_bar(bars%monitor(m), there(m) - here(m))
         end do
      end if
      call timing_stop(phase_accuracy)
   end subroutine bars_at_touch

   !> Shares of the elements of one mesh as those of another one, by the middles of the elements.
   function shares_on(from, from_state, share, to, to_state) result(new)
      type(problem_t), intent(in) :: from, to    !! of the same deck
      type(state_t), intent(in) :: from_state, to_state
      real(wp), intent(in) :: share(:, :)        !! (numbers, elements of `from`)
      real(wp), allocatable :: new(:, :)
      real(wp) :: tau
      integer :: e, there
      allocate (new(size(share, 1), to%model%mesh%n_elements), source=0.0_wp)
      do e = 1, size(share, 2)
         call find_point(to, to_state, from%stretch(e), 0.5_wp * sum(from_state%geometry%element(e)%s) + from%origin(e), there, tau)
         new(:, there) = new(:, there) + share(:, e)
      end do
   end function shares_on

   !> Bars of a point of a limit curve: of a limit point as the path has them.
   subroutine bars_on_curve(problem, state, system, heading, length, rise, bars)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system       !! factored there
      type(path_tangent_t), intent(in) :: heading     !! tangent there
      real(wp), intent(in) :: length             !! arc length over which the load changes
      real(wp), intent(in) :: rise               !! by this much
      type(error_bars_t), allocatable, intent(out) :: bars
      type(enriched_problem_t) :: finer
      type(event_t) :: event
      type(zero_t) :: zero
      allocate (bars)
      event%kind = event_limit
      call timing_start(phase_accuracy)
      call new_zero(problem, event, state, system, zero)
      call event_errors(problem, finer, state, system, zero, heading, length, rise, bars)
      call timing_stop(phase_accuracy)
   end subroutine bars_on_curve

   !> Keeps the largest load of a step, which error bars are measured against.
   pure subroutine note_load(step, load_factor, accuracy)
      integer, intent(in) :: step                !! its number
      real(wp), intent(in) :: load_factor
      type(accuracy_t), intent(inout) :: accuracy
      if (step /= accuracy%load_step) accuracy%load = 0.0_wp
      accuracy%load_step = step
      accuracy%load = max(accuracy%load, abs(load_factor))
   end subroutine note_load

   !> Keeps the widest bar of the load factors of a buckling step, and words where one is wider than the deck allows.
   subroutine note_buckling_bars(buckling, widest, accuracy)
      type(buckling_t), intent(in) :: buckling   !! with bars
      real(wp), intent(in) :: widest             !! over the load factor
      type(accuracy_t), intent(inout) :: accuracy
      integer :: k
      do k = 1, size(buckling%load_factor)
         associate (bar => buckling%bar(k), factor => buckling%load_factor(k))
            if (bar%told) call note_ratio(bar, abs(factor), 'the load factor of buckling mode '//whole(k)//' is '// &
               & brief(factor), place_t(step=buckling%step, load_factor=factor), widest, accuracy)
         end associate
      end do
   end subroutine note_buckling_bars

   !> The same of a point of a limit curve; monitors that count have bars with bounds.
   subroutine note_curve_bar(problem, point, name, step, accuracy)
      type(problem_t), intent(in) :: problem
      type(limit_point_t), intent(in) :: point   !! with bars
      character(*), intent(in) :: name           !! of the curve
      type(step_t), intent(in) :: step
      type(accuracy_t), intent(inout) :: accuracy
      integer :: k
      associate (bar => point%bars%load, factor => point%load_factor)
         if (bar%told .and. abs(factor) > 0.0_wp) call note_ratio(bar, abs(factor), 'on the limit curve '//name// &
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

   !> Keeps the widest bar, and words for the first one that is wider than the deck allows.
   subroutine note_ratio(bar, size, what, at, widest, accuracy)
      type(error_bar_t), intent(in) :: bar
      real(wp), intent(in) :: size               !! what it is measured against, > 0
      character(*), intent(in) :: what           !! the number, as far as its bar
      type(place_t), intent(in) :: at
      real(wp), intent(in) :: widest
      type(accuracy_t), intent(inout) :: accuracy
      call note_worst(accuracy%error_bar, bar%bar / size, at)
      if (allowed_part(bar, widest, size) <= 1.0_wp .or. allocated(accuracy%bar_words)) return
      accuracy%bar_words = coarse_words(what//' '//bar_text(bar), brief(widest)//' of it')
   end subroutine note_ratio

   !> What is said of a mesh that is given.
   pure function coarse_words(what, allowed) result(words)
      character(*), intent(in) :: what           !! the number with its bar
      character(*), intent(in) :: allowed
      character(:), allocatable :: words
      words = 'the mesh is too coarse for what was asked: '//what//', and WIDEST on *ACCURACY allows '//allowed// &
         & '; give more elements or a higher order'
   end function coarse_words

   !> Keeps the widest bar of a critical load, and words where the numbers of a point are not known as well as the deck asks, or
   !> it is not known whether they are: of a mesh made for a tolerance at all points, of a given one the loads of critical points
   !> and all at the end.
   !>
   !> At the end the load factor is mostly what the deck gave, and only monitors tell that a mesh is too coarse for the way there.
   subroutine note_error(problem, step, bars, sizes, label, at, accuracy)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(error_bars_t), intent(in) :: bars
      real(wp), intent(in) :: sizes(:)           !! (1 + monitors) what errors are measured against
      character(*), intent(in) :: label          !! '': none
      type(place_t), intent(in) :: at
      type(accuracy_t), intent(inout) :: accuracy
      character(:), allocatable :: what, there
      type(error_bar_t) :: widest
      real(wp) :: ratio, asked
      integer, allocatable :: counted(:)
      integer :: which
      logical :: made
      if (label /= '' .and. bars%load%told .and. accuracy%load > 0.0_wp) &
         & call note_worst(accuracy%error_bar, bars%load%bar / accuracy%load, at)
      made = any(problem%layout%stretch%placed)
      if (allocated(accuracy%bar_words) .or. .not. (made .or. label /= '')) return
      there = ' at point '//whole(at%point)//' (load factor '//brief(at%load_factor)//')'
      if (label /= '') there = ' of '//label//there
      ! Of what is only looked for nothing hangs on that.
      if (bars%missed /= 0 .and. .not. any(label == ['UZ', 'TP'])) then
         accuracy%bar_words = 'the mesh is too coarse for the bifurcations'//there//': finer elements have '// &
            & whole(abs(bars%missed))//trim(merge(' more ', ' fewer', bars%missed > 0))// &
            & ' unstable directions there; give more elements or a higher order'
         return
      end if
      if (bars%unsure .and. (label == 'LP' .or. bars%turned)) then
         accuracy%bar_words = 'the mesh is too coarse to tell whether the load turns'//there//': it errs by more than that '// &
            & 'falls; give more elements or a higher order'
         return
      end if
      if (bars%unsure .and. .not. any(label == ['UZ', 'TP'])) then
         accuracy%bar_words = 'the mesh is too coarse for the bifurcations'//there//': it errs by all of an eigenvalue that is '// &
            & 'next to zero there; give more elements or a higher order'
         return
      end if
      if (allocated(bars%may_open) .and. .not. any(label == ['UZ', 'TP'])) then
         accuracy%bar_words = 'the mesh is too coarse to tell whether contact with a foundation goes on inside its elements'// &
            & there//'; give more elements or a higher order'
         return
      end if
      if (.not. (bars%load%told .or. any(bars%monitor%told))) then
         ! What has no estimate on any mesh is said in the table; changes of contact that have no function are no values of their
         ! own, but on foundations they are.
         if (.not. (bars%too_coarse .or. (made .and. (any(label == ['LP', 'BP', 'EP']) .or. &
            & (any(problem%ground%founded) .and. any(label == ['C+', 'C-'])))))) return
         accuracy%bar_words = 'whether the errors'//there//' are what was asked for is not known: '//bars%why
         return
      end if
      asked = asked_at(problem, step, label)
      counted = step%asked_of
      call excess(bars, sizes, counted, asked, label /= '', label /= '' .or. step%bars_everywhere, ratio, which)
      if (ratio <= 1.0_wp) then
         if (allocated(bars%place) .and. any(counted == 0)) call note_places()
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

      !> Where contact ends has a bar where it has bounds.
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

   !> What is said of a number whose error may be any.
   pure function unbounded_words(what, bar) result(words)
      character(*), intent(in) :: what           !! the number
      type(error_bar_t), intent(in) :: bar
      character(:), allocatable :: words
      words = 'the error of '//what//' is not known: '//bar_text(bar)//', and no bound; give more elements or a higher order'
   end function unbounded_words

   !> The relative error that decides at a point: what a mesh is made for, or the widest bar that is allowed.
   pure real(wp) function asked_at(problem, step, label) result(asked)
      type(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      character(*), intent(in) :: label          !! '': none
      asked = step%widest_bar
      if (.not. any(problem%layout%stretch%placed)) return
      asked = max(step%asked, step%widest_bar)
      if (label == '') asked = step%asked_of_path
   end function asked_at

   !> The bar of a number: 0 the load factor, else a monitor.
   pure function bar_of(bars, which) result(bar)
      type(error_bars_t), intent(in) :: bars
      integer, intent(in) :: which
      type(error_bar_t) :: bar
      bar = bars%load
      if (which > 0) bar = bars%monitor(which)
   end function bar_of
end module error_report

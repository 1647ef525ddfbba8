!> Distribution of a run's time: seconds and calls of each phase, and counters of the work done.
!>
!> The program has one clock, a global variable. Its measurements change no result, so that it need not be passed in argument lists.
!>
!> A phase started inside another one pauses the outer phase, so that the seconds of all phases never exceed the elapsed time. A
!> start or stop needs one clock call (about 20 ns). All time spent on error bars counts as phase_accuracy: during that time the
!> other phases and all counters are suspended.
module timing
   use kinds, only: wp, i8
   implicit none
   private
   public :: timing_start, timing_stop, timing_seconds, timing_calls, timing_total
   public :: count_up, counted
   public :: n_phases, phase_name, n_counters, counter_name
   public :: phase_reading, phase_numbering, phase_elements, phase_assembly, phase_factorisation
   public :: phase_solution, phase_contact, phase_path, phase_accuracy, phase_output
   public :: counter_points, counter_newton, counter_factorisation, counter_solution, counter_lcp
   public :: counter_lcp_pivots, counter_lcp_failed, counter_set_changes, counter_rejected, counter_cut
   public :: counter_located, counter_remeshed, counter_evaluated, counter_largest
   public :: count_largest, timing_reset

   enum, bind(c)
      enumerator :: phase_reading = 1 !! reading and checking the deck
      enumerator :: phase_numbering   !! node numbering
      enumerator :: phase_elements    !! residuals and tangents of the elements
      enumerator :: phase_assembly    !! sums into the global matrix and residual
      enumerator :: phase_factorisation
      enumerator :: phase_solution    !! solutions with a factored matrix
      enumerator :: phase_contact     !! gaps, LCPs, contact regions
      enumerator :: phase_path        !! increments, events, everything else of the path loop
      enumerator :: phase_accuracy    !! discretisation errors, including everything computed for them
      enumerator :: phase_output      !! result file and listing
   end enum
   integer, parameter :: n_phases = phase_output
   character(*), parameter :: phase_name(n_phases) = [character(13) :: 'reading', 'numbering', 'elements', &
      & 'assembly', 'factorisation', 'solution', 'contact', 'path', 'error bars', 'output']

   enum, bind(c)
      enumerator :: counter_points = 1    !! accepted points
      enumerator :: counter_newton        !! Newton iterations, including those of rejected increments
      enumerator :: counter_factorisation
      enumerator :: counter_solution      !! solved right-hand sides
      enumerator :: counter_lcp           !! LCPs handed to Lemke
      enumerator :: counter_lcp_pivots
      enumerator :: counter_lcp_failed    !! LCPs without solution: ray, pivot limit or breakdown
      enumerator :: counter_set_changes   !! changes of the contact set
      enumerator :: counter_rejected      !! rejected increments, after which the state is restored
      enumerator :: counter_cut           !! shortened increments
      enumerator :: counter_located       !! critical and user points located
      enumerator :: counter_remeshed      !! new meshes made to reduce errors
      enumerator :: counter_evaluated     !! evaluations of elements with their tangents
      enumerator :: counter_largest       !! number of elements of the largest mesh used for points
   end enum
   integer, parameter :: n_counters = counter_largest
   character(*), parameter :: counter_name(n_counters) = [character(23) :: 'accepted points', &
      & 'Newton iterations', 'factorisations', 'solutions', 'LCPs', 'LCP pivots', 'LCPs without a solution', &
      & 'contact set changes', 'rejected increments', 'shortened increments', 'located points', &
      & 'meshes made anew', 'elements evaluated', 'elements at the most']

   type :: timers_t
      private
      integer(i8) :: first = -1_i8             !! clock ticks at the first start; -1: no phase has been started yet
      integer(i8) :: mark = 0_i8               !! clock ticks from which the innermost running phase is charged
      integer :: depth = 0
      integer :: running(n_phases) = 0         !! running phases, the outermost first; each at most once
      integer(i8) :: ticks(n_phases) = 0_i8
      integer(i8) :: calls(n_phases) = 0_i8
      integer(i8) :: counter(n_counters) = 0_i8
   end type timers_t

   type(timers_t) :: timers

contains

   !> Starts a phase; the running phase is paused until this one stops. If the phase is already running, it is first stopped, with
   !> all phases started inside it, so that a missing stop at an early return has no consequences.
   subroutine timing_start(phase)
      integer, intent(in) :: phase             !! number of the phase, phase_...
      if (rests(phase)) return
      if (any(timers%running(:timers%depth) == phase)) then
         call timing_stop(phase)
      else
         call charge()
      end if
      timers%depth = timers%depth + 1
      timers%running(timers%depth) = phase
      timers%calls(phase) = timers%calls(phase) + 1
   end subroutine timing_start

   !> Stops a phase and all phases started inside it; the phase around it continues. Nothing is done if the phase is not running.
   subroutine timing_stop(phase)
      integer, intent(in) :: phase             !! number of the phase, phase_...
      integer :: level
      if (rests(phase)) return
      call charge()
      do level = timers%depth, 1, -1
         if (timers%running(level) == phase) then
            timers%depth = level - 1
            return
         end if
      end do
   end subroutine timing_stop

   !> Seconds spent in a phase, without phases started inside it. For a running phase they are counted up to the last start or stop.
   function timing_seconds(phase) result(seconds)
      integer, intent(in) :: phase             !! number of the phase, phase_...
      real(wp) :: seconds
      seconds = real(timers%ticks(phase), wp) / ticks_per_second()
   end function timing_seconds

   !> Number of times a phase was started.
   function timing_calls(phase) result(calls)
      integer, intent(in) :: phase             !! number of the phase, phase_...
      integer(i8) :: calls
      calls = timers%calls(phase)
   end function timing_calls

   !> Seconds from the first start of any phase until now; 0 if no phase was started.
   function timing_total() result(seconds)
      real(wp) :: seconds
      integer(i8) :: now
      seconds = 0.0_wp
      if (timers%first < 0) return
      call system_clock(now)
      seconds = real(now - timers%first, wp) / ticks_per_second()
   end function timing_total

   !> Adds to a counter.
   subroutine count_up(counter, by)
      integer, intent(in) :: counter           !! number of the counter, counter_...
      integer, intent(in), optional :: by      !! number that is added, default: 1
      if (rests(phase_path)) return
      if (present(by)) then
         timers%counter(counter) = timers%counter(counter) + by
      else
         timers%counter(counter) = timers%counter(counter) + 1
      end if
   end subroutine count_up

   !> Stores the largest of the values of a counter.
   subroutine count_largest(counter, value)
      integer, intent(in) :: counter           !! number of the counter, counter_...
      integer, intent(in) :: value
      if (rests(phase_path)) return
      timers%counter(counter) = max(timers%counter(counter), int(value, i8))
   end subroutine count_largest

   !> The value of a counter.
   function counted(counter) result(value)
      integer, intent(in) :: counter           !! number of the counter, counter_...
      integer(i8) :: value
      value = timers%counter(counter)
   end function counted

   !> True if a phase is suspended because error bars are being computed.
   logical function rests(phase)
      integer, intent(in) :: phase             !! number of the phase, phase_...
      rests = phase /= phase_accuracy .and. any(timers%running(:timers%depth) == phase_accuracy)
   end function rests

   !> Resets all times and counters to the state at program start.
   subroutine timing_reset()
      timers = timers_t()
   end subroutine timing_reset

   !> Adds the time since the last start or stop to the innermost running phase.
   subroutine charge()
      integer(i8) :: now
      integer :: phase
      call system_clock(now)
      if (timers%first < 0) timers%first = now
      if (timers%depth > 0) then
         phase = timers%running(timers%depth)
         timers%ticks(phase) = timers%ticks(phase) + (now - timers%mark)
      end if
      timers%mark = now
   end subroutine charge

   !> Clock rate of system_clock for integers of the kind of the ticks.
   function ticks_per_second() result(rate)
      real(wp) :: rate
      integer(i8) :: ticks
      call system_clock(count_rate=ticks)
      rate = real(ticks, wp)
   end function ticks_per_second
end module timing

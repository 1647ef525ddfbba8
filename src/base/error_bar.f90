!> Estimate of the discretisation error of one number.
!>
!> C: estimated exact value minus computed value. A: sum of the absolute error contributions of the elements. D: the part of C that
!> the linear estimate by these contributions does not contain. The bar 1.2 |C| + 2 |D| + 0.2 A bounds the error as long as D is
!> small compared with A. (C alone may be small because contributions cancel, or because two meshes agree that are both too coarse.)
!> For larger D, errors were up to 3.5 times 5 (A + |D|). This product is the bar if it is a small part of the number's size,
!> because the mesh then resolves the solution; otherwise there is no bar. The constants come from 2550 runs of a prototype over
!> orders, meshes and structures (in at most a third the bar was too small there), and were compared with 1394 other runs.
module error_bar
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use kinds, only: wp
   implicit none
   private
   public :: error_bar_t, error_bars_t, place_bar_t, new_error_bar, no_error_bars, shifted_error_bar, bar_of
   public :: largest_unseen, resolved, allowed_part, lacks_bound

   !> Error estimate of one number. All components have the unit of the number.
   type :: error_bar_t
      logical :: estimated = .false.          !! true: an estimate exists
      logical :: bounded = .false. !! true: the error is at most `bar`; false: the mesh is too coarse, and the error may be larger
      real(wp) :: correction = 0.0_wp         !! C: estimated exact value minus computed value
      real(wp) :: bar = 0.0_wp                !! bound of the error, > 0
      real(wp) :: rounding = 0.0_wp           !! part of the bar that may be rounding, which no finer mesh reduces
      logical :: no_number = .false.          !! true: the number is no larger than its rounding, so that it has no relative error
   end type error_bar_t

   !> Position at which contact with an obstacle begins or ends along a rod.
   type :: place_bar_t
      integer :: contact_span = 0             !! number of the contact span, see contact_spans
      logical :: last = .false.               !! true: end of a line contact; false: its beginning, or a point contact
      real(wp) :: at = 0.0_wp                 !! stress-free arc length along the chain of the contact
      type(error_bar_t) :: bar
   end type place_bar_t

   !> Error estimates of load factor and monitors at a point.
   type :: error_bars_t
      type(error_bar_t) :: load
      type(error_bar_t), allocatable :: monitor(:) !! (monitors of the deck) error estimates
      type(place_bar_t), allocatable :: place(:) !! error bars of the positions of touchdown points; not allocated: no estimates
      real(wp), allocatable :: share(:, :)    !! (1 + monitors, elements) absolute error contributions of the elements; not
      !! allocated: no estimates
      real(wp), allocatable :: rest(:)        !! (1 + monitors) error from the residual that the iteration left
      logical :: too_coarse = .false.         !! true: no estimates, because the mesh is far too coarse
      integer :: missed = 0 !! number of unstable directions of the enriched problem minus that of the original problem; 0: they are
      !! equal, or the difference is uncertain
      logical :: unsure = .false. !! true: a sign is uncertain, because the discretisation error is as large as an eigenvalue, or
      !! larger than the change of the load near its turning point
      logical, allocatable :: may_change(:) !! (elements) true: inside the element contact with a foundation may have opened, or
      !! contact with a rigid obstacle may have begun, undetected; not allocated: nowhere
      real(wp) :: unfolding = 0.0_wp !! bifurcation: force on its null vectors less the error of this force; zero at a true
      !! bifurcation. If it is not zero, no path continues through the point
      logical :: turned = .false. !! true: the load rate changes its sign in the enriched problem. Set if a line contact has become
      !! a point contact and the load may be stationary
      real(wp) :: way = 0.0_wp !! event: distance along the path from its position to its position in the enriched problem [arc
      !! length]
      character(:), allocatable :: why        !! reason why some estimates are missing
   end type error_bars_t

   real(wp), parameter :: of_estimate = 1.2_wp, of_unseen = 2.0_wp, of_shares = 0.2_wp
   real(wp), parameter :: largest_unseen = 0.3_wp !! largest ratio D/A for which the error is bounded
   real(wp), parameter :: at_least = 5.0_wp !! factor on A + |D| that gives the size of errors which the contributions do not show
   real(wp), parameter :: exceeded = 3.5_wp       !! largest ratio of observed errors to this size
   real(wp), parameter :: resolved = 0.01_wp      !! part of the number's size; errors up to this part were examined
   real(wp), parameter :: of_difference = 2.0_wp  !! rounding of D over the rounding of a number: D is the difference of two numbers
   real(wp), parameter :: any_bar = 1.0_wp !! part of the number's size: if an error as large as this is allowed, an unbounded error
   !! is allowed, too

contains

   !> Error bar of a number from its estimate. If neither D < 0.3 A nor the error is small compared with the number, the error is
   !> not bounded, and `bar` is only a size that the error may exceed.
   elemental function new_error_bar(correction, unseen, shares, rounding, size) result(error)
      real(wp), intent(in) :: correction      !! C: estimated exact value minus computed value
      real(wp), intent(in) :: unseen          !! D: the part of C that the linear estimate does not contain
      real(wp), intent(in) :: shares          !! A: sum of the absolute error contributions of the elements, >= 0
      real(wp), intent(in) :: rounding        !! estimated rounding error of the number, >= 0
      real(wp), intent(in), optional :: size  !! reference size for numbers of this kind; absent: unknown
      type(error_bar_t) :: error
      real(wp) :: factor, not_linear
      error%estimated = ieee_is_finite(correction) .and. ieee_is_finite(unseen) .and. ieee_is_finite(shares)
      if (.not. error%estimated) return
      error%correction = correction
      ! The linear estimate is at most A, so D is at least |C| - A. A smaller one belongs to another zero of the enriched problem.
      not_linear = max(abs(unseen), abs(correction) - shares)
      error%bounded = not_linear <= largest_unseen * shares + of_difference * rounding
      factor = 0.0_wp
      if (.not. error%bounded) then
         factor = exceeded * at_least
         if (present(size)) error%bounded = width(abs(correction), not_linear, shares) <= resolved * size
         if (.not. error%bounded) factor = at_least
      end if
      error%bar = width(abs(correction), not_linear, shares)
      ! Each of C, D and A contains rounding errors.
      error%rounding = width(min(abs(correction), rounding), min(not_linear, of_difference * rounding), min(shares, rounding))

   contains

      !> Width of the bar from C, D and A.
      pure real(wp) function width(c, d, a)
         real(wp), intent(in) :: c, d, a
         width = of_estimate * c + of_unseen * d + of_shares * a + rounding
         if (factor > 0.0_wp) width = factor * (a + d) + rounding
      end function width
   end function new_error_bar

   !> Error bar of a number that replaces another number with a known bar.
   elemental function shifted_error_bar(known, difference) result(error)
      type(error_bar_t), intent(in) :: known
      real(wp), intent(in) :: difference      !! the replaced number minus the new number
      type(error_bar_t) :: error
      error = known
      if (.not. error%estimated) return
      error%correction = known%correction + difference
      error%bar = known%bar + of_estimate * abs(difference)
   end function shifted_error_bar

   !> Error bar of the load factor or of a monitor.
   pure function bar_of(bars, which) result(bar)
      type(error_bars_t), intent(in) :: bars
      integer, intent(in) :: which            !! index of the monitor; 0: the load factor
      type(error_bar_t) :: bar
      bar = bars%load
      if (which > 0) bar = bars%monitor(which)
   end function bar_of

   !> Ratio of a bar to its allowed value. An unbounded error exceeds every allowed value, unless errors as large as the number
   !> itself are allowed.
   elemental real(wp) function allowed_part(bar, allowed, size) result(part)
      type(error_bar_t), intent(in) :: bar
      real(wp), intent(in) :: allowed         !! allowed value of the bar over `size`, > 0
      real(wp), intent(in) :: size            !! size of the number, > 0
      part = bar%bar / (allowed * size)
      if (bar%no_number) part = 0.0_wp
      if (lacks_bound(bar, allowed)) part = huge(part)
   end function allowed_part

   !> True for a number whose error is unbounded although an error as large as the number itself is not allowed.
   elemental logical function lacks_bound(bar, allowed)
      type(error_bar_t), intent(in) :: bar
      real(wp), intent(in) :: allowed         !! allowed error as part of the number's size
      lacks_bound = bar%estimated .and. .not. bar%bounded .and. allowed < any_bar
   end function lacks_bound

   !> Error bars without estimates.
   pure function no_error_bars(monitors, why) result(bars)
      integer, intent(in) :: monitors         !! number of monitors
      character(*), intent(in) :: why         !! reason why there are no estimates, in words
      type(error_bars_t) :: bars
      allocate (bars%monitor(monitors))
      bars%why = why
   end function no_error_bars
end module error_bar

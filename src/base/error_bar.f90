!> What is known of the discretisation error of one number.
!>
!> C: estimated exact value less the computed one; A: the sum of the sizes of the elements' shares of it; D: what of C the
!> linear estimate by these shares did not see. The bar 1.2 |C| + 2 |D| + 0.2 A holds as long as D is small beside A: C alone may
!> be small because shares cancel, or because two meshes that are both too coarse agree. Beyond, errors were up to 3.5 times
!> 5 (A + |D|): a bar where that is a small part of the number's size, for there meshes resolve what is to be found, else no bar.
!> Constants: from 2550 runs of a prototype over orders, meshes and structures, at most a third too small there; held against
!> 1394 others.
module error_bar
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use kinds, only: wp
   implicit none
   private
   public :: error_bar_t, error_bars_t, place_bar_t, new_error_bar, no_error_bars, moved_error_bar, shifted_error_bar
   public :: largest_unseen, allowed_part, lacks_bound

   !> One number. All in its unit.
   type :: error_bar_t
      logical :: estimated = .false.          !! an estimate exists
      logical :: bounded = .false.            !! the error is within `bar`; else it may be larger, the mesh being too coarse
      real(wp) :: correction = 0.0_wp         !! C
      real(wp) :: bar = 0.0_wp                !! > 0
      real(wp) :: rounding = 0.0_wp           !! what of the bar may be rounding, which no mesh takes away
      logical :: no_number = .false.          !! the number itself is no more than that: it has no relative error
   end type error_bar_t

   !> Where contact with an obstacle begins or ends along a rod.
   type :: place_bar_t
      integer :: contact_span = 0             !! number of what touches, see contact_spans
      logical :: last = .false.               !! the end of a line; else its beginning, or a point
      real(wp) :: at = 0.0_wp                 !! stress-free arc length along the chain of the contact
      type(error_bar_t) :: bar
   end type place_bar_t

   !> Load factor and monitors of a point.
   type :: error_bars_t
      type(error_bar_t) :: load
      type(error_bar_t), allocatable :: monitor(:) !! (monitors of the deck)
      type(place_bar_t), allocatable :: place(:) !! touchdown points; not allocated: not told
      real(wp), allocatable :: share(:, :)    !! (1 + monitors, elements) sizes of what the elements of the mesh contribute; not
      !! allocated where nothing is told
      real(wp), allocatable :: rest(:)        !! (1 + monitors) and what the iteration that led to the point has left
      logical :: too_coarse = .false.         !! nothing is told because the mesh is far from fine enough
      integer :: missed = 0                   !! unstable directions that finer elements have more, or fewer
      logical :: unsure = .false.             !! the mesh errs by all of an eigenvalue, or by more than a load that turns changes:
      !! the sign may be the wrong one
      logical, allocatable :: may_open(:)     !! (elements) contact with a foundation may have opened inside it without its notice;
      !! not allocated: nowhere
      real(wp) :: unfolding = 0.0_wp          !! bifurcation: force on its null vectors beyond what it may err by; a true one has
      !! none, and no path goes through where there is one
      logical :: turned = .false.             !! the load's rate has the other sign on finer elements: told where a line has
      !! become a point and the load may stand
      real(wp) :: way = 0.0_wp                !! event: from its place to that on finer elements, as arc length along the path
      character(:), allocatable :: why        !! some are not told: the reason
   end type error_bars_t

   real(wp), parameter :: of_estimate = 1.2_wp, of_unseen = 2.0_wp, of_shares = 0.2_wp
   real(wp), parameter :: largest_unseen = 0.3_wp !! D over A
   real(wp), parameter :: at_least = 5.0_wp       !! times A + |D|: what errors come to that the shares do not tell
   real(wp), parameter :: exceeded = 3.5_wp       !! times as much, at the most
   real(wp), parameter :: resolved = 0.01_wp      !! of a number's size: errors up to that were looked at
   real(wp), parameter :: of_difference = 2.0_wp  !! D is what two numbers differ by, and either is rounded
   real(wp), parameter :: any_bar = 1.0_wp        !! of a number's own size: who allows that much allows what has no bound, too

contains

   !> The bar of a number by its estimate. Without D < 0.3 A, and not small either, there is none, only a size that the error may
   !> exceed.
   elemental function new_error_bar(correction, unseen, shares, rounding, size) result(error)
      real(wp), intent(in) :: correction      !! C
      real(wp), intent(in) :: unseen          !! D
      real(wp), intent(in) :: shares          !! A >= 0
      real(wp), intent(in) :: rounding        !! what rounding may do to the number, >= 0
      real(wp), intent(in), optional :: size  !! that the number's kind has there; not there: not known
      type(error_bar_t) :: error
      real(wp) :: factor
      error%estimated = ieee_is_finite(correction) .and. ieee_is_finite(unseen) .and. ieee_is_finite(shares)
      if (.not. error%estimated) return
      error%correction = correction
      error%bounded = abs(unseen) <= largest_unseen * shares + of_difference * rounding
      factor = 0.0_wp
      if (.not. error%bounded) then
         factor = exceeded * at_least
         if (present(size)) error%bounded = width(abs(correction), abs(unseen), shares) <= resolved * size
         if (.not. error%bounded) factor = at_least
      end if
      error%bar = width(abs(correction), abs(unseen), shares)
      ! Rounding is in the estimates, too.
      error%rounding = width(min(abs(correction), rounding), min(abs(unseen), of_difference * rounding), min(shares, rounding))

   contains

      !> The bar that the sizes of its parts make.
      pure real(wp) function width(c, d, a)
         real(wp), intent(in) :: c, d, a
         width = of_estimate * c + of_unseen * d + of_shares * a + rounding
         if (factor > 0.0_wp) width = factor * (a + d) + rounding
      end function width
   end function new_error_bar

   !> The bar of a number that is known where another one, its argument, is held, and of that argument.
   elemental function moved_error_bar(held, argument, rate) result(error)
      type(error_bar_t), intent(in) :: held
      type(error_bar_t), intent(in) :: argument
      real(wp), intent(in) :: rate            !! of the number by its argument
      type(error_bar_t) :: error
      error%estimated = held%estimated .and. argument%estimated .and. ieee_is_finite(rate)
      if (.not. error%estimated) return
      error%bounded = held%bounded .and. argument%bounded
      error%correction = held%correction + rate * argument%correction
      error%bar = held%bar + abs(rate) * argument%bar
      error%rounding = held%rounding + abs(rate) * argument%rounding
   end function moved_error_bar

   !> The bar of a number that stands for one with a bar, and differs from it.
   elemental function shifted_error_bar(known, difference) result(error)
      type(error_bar_t), intent(in) :: known
      real(wp), intent(in) :: difference      !! the other one less the number
      type(error_bar_t) :: error
      error = known
      if (.not. error%estimated) return
      error%correction = known%correction + difference
      error%bar = known%bar + of_estimate * abs(difference)
   end function shifted_error_bar

   !> A bar over what is allowed of a number's size. One without bounds is wider than any, unless errors as large as the number
   !> itself are allowed.
   elemental real(wp) function allowed_part(bar, allowed, size) result(part)
      type(error_bar_t), intent(in) :: bar
      real(wp), intent(in) :: allowed         !! > 0
      real(wp), intent(in) :: size            !! > 0
      part = bar%bar / (allowed * size)
      if (bar%no_number) part = 0.0_wp
      if (lacks_bound(bar, allowed)) part = huge(part)
   end function allowed_part

   !> True for a number whose error may be any, where that is not allowed.
   elemental logical function lacks_bound(bar, allowed)
      type(error_bar_t), intent(in) :: bar
      real(wp), intent(in) :: allowed         !! part of the number's size
      lacks_bound = bar%estimated .and. .not. bar%bounded .and. allowed < any_bar
   end function lacks_bound

   !> Nothing told.
   pure function no_error_bars(monitors, why) result(bars)
      integer, intent(in) :: monitors         !! how many
      character(*), intent(in) :: why         !! in words
      type(error_bars_t) :: bars
      allocate (bars%monitor(monitors))
      bars%why = why
   end function no_error_bars
end module error_bar

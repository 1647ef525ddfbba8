!> Coupled ground: obstacles on which a reaction at one candidate causes settlement at other candidates.
!>
!> The law of such ground is 0 <= r _|_ g + T r >= 0 (bilateral: g + T r = 0), with the gap g to the undeformed surface, the
!> reactions r and the settlement T r: eq. (18) of Silveira & Goncalves (2001) with a full matrix T, symmetric and positive
!> definite.
!>
!> Half-space (rectangle_compliance): settlement under uniformly loaded rectangles (Boussinesq; A. E. H. Love, Phil. Trans. R. Soc.
!> A 228, 1929), averaged over a rectangle. The rectangles form one row and have the width of the row. The settlement is the mean
!> over the rectangle that settles. The compliance is therefore twice the energy of the ground over the square of the force:
!> symmetric for any lengths, and positive definite if no two rectangles overlap. The settlement of the rectangle's centre would be
!> neither.
!>
!> Pasternak foundation (layer_compliance): settlement w under point forces. It consists of springs connected by a shear layer, k w
!> - G w'' = p, with the modulus k, the shear stiffness G of the layer, and the force p by length. Between two points of the same
!> rod the springs are lumped at both points and the layer is straight, just as the rod's reaction is lumped at its nodes. The error
!> is of second order in the distance of the points, and G = 0 gives the Winkler foundation. Elsewhere the ground has no load, and
!> the solution between rods and towards infinity is exact. A point far from others settles by 1/(2 sqrt(k G)) under a unit force
!> (A. P. S. Selvadurai, Elastic Analysis of Soil-Foundation Interaction, 1979), and so does the end of a rod, which has a
!> concentrated reaction. A mean over the tributary lengths would have a first-order error under such an end.
module ground_coupling
   use kinds, only: wp, pi
   use model, only: model_t
   use obstacle_types, only: ground_half_space
   use candidates, only: candidates_t
   use rod_geometry, only: geometry_t
   use surface_patches, only: patches_t, new_patches, along_surface, couples
   use lapack, only: dpotrf, dptsv
   implicit none
   private
   public :: coupling_t, new_coupling, settlement, rectangle_compliance, layer_compliance

   !> Compliances of coupled ground. There is one entry for each of the n candidates on such ground.
   type :: coupling_t
      integer :: n = 0
      integer, allocatable :: candidate(:)       !! (n) candidate to which the entry belongs
      integer, allocatable :: entry(:) !! (candidates) index of the candidate's entry; 0: its obstacle does not couple candidates
      real(wp), allocatable :: compliance(:, :) !! (n, n) compliance T [length/force]; zero between candidates of different
      !! obstacles
      real(wp), allocatable :: local(:)          !! (n) diagonal d for which T - 2 d is positive definite
   end type coupling_t

   real(wp), parameter :: far = 20.0_wp !! distance, over the length of the longer rectangle, beyond which differences of the closed
   !! formula cancel

   ! Gauss points and weights on (0, 1), used beyond this distance; the relative error is 1e-12 there:
   real(wp), parameter :: point(3) = [0.5_wp - sqrt(0.15_wp), 0.5_wp, 0.5_wp + sqrt(0.15_wp)]
   real(wp), parameter :: weight(3) = [5.0_wp, 8.0_wp, 5.0_wp] / 18.0_wp

contains

   !> The compliance matrix T of all obstacles that couple candidates.
   function new_coupling(model, list, geometry) result(coupling)
      type(model_t), intent(in) :: model         !! model in which no two candidates load the same part of an obstacle
      type(candidates_t), intent(in) :: list
      type(geometry_t), intent(in) :: geometry   !! stress-free geometry
      type(coupling_t) :: coupling
      type(patches_t) :: patches
      integer :: o
      patches = new_patches(model, list, geometry)
      coupling%n = patches%n
      coupling%candidate = patches%candidate
      coupling%entry = patches%entry
      allocate (coupling%compliance(coupling%n, coupling%n), coupling%local(coupling%n), source=0.0_wp)
      if (coupling%n == 0) return
      do o = 1, size(model%obstacle)
         if (couples(model%obstacle(o))) call add_obstacle(model, list, patches, o, coupling)
      end do
      call split_local(coupling)
   end function new_coupling

   !> Adds the compliances of one obstacle to T.
   subroutine add_obstacle(model, list, patches, number, coupling)
      type(model_t), intent(in) :: model
      type(candidates_t), intent(in) :: list
      type(patches_t), intent(in) :: patches
      integer, intent(in) :: number              !! index into model%obstacle
      type(coupling_t), intent(inout) :: coupling
      integer, allocatable :: order(:)
      logical, allocatable :: joined(:)
      real(wp), allocatable :: part(:, :)
      integer :: i, j
      logical :: ok
      order = along_surface(patches, list, number)
      if (size(order) == 0) return
      allocate (part(size(order), size(order)))
      associate (obstacle => model%obstacle(number))
         if (obstacle%ground == ground_half_space) then
            do j = 1, size(order)
               do i = 1, j
                  part(i, j) = rectangle_compliance(patches%reach(:, order(i)), patches%reach(:, order(j)), obstacle%width, &
                     & obstacle%young, obstacle%poisson)
                  part(j, i) = part(i, j)
               end do
            end do
         else
            joined = [(any(list%neighbour(:, patches%candidate(order(i))) == patches%candidate(order(i + 1))), &
               & i=1, size(order) - 1)]
            call layer_compliance(patches%at(order), joined, obstacle%modulus, obstacle%shear, part, ok)
            if (.not. ok) error stop 'a Pasternak foundation has no compliance'
         end if
      end associate
      coupling%compliance(order, order) = part
   end subroutine add_obstacle

   !> Sets `local` to a part of the diagonal of T. The part is halved until T minus twice this part is positive definite.
   subroutine split_local(coupling)
      type(coupling_t), intent(inout) :: coupling
      real(wp), allocatable :: left(:, :)
      real(wp) :: share
      integer :: i, try, info
      integer, parameter :: max_tries = 50
      share = 0.25_wp
      do try = 1, max_tries
         left = coupling%compliance
         do i = 1, coupling%n
            left(i, i) = (1.0_wp - 2.0_wp * share) * left(i, i)
         end do
         call dpotrf('L', coupling%n, left, coupling%n, info)
         if (info == 0) exit
         share = 0.5_wp * share
      end do
      if (info /= 0) error stop 'the compliance of a foundation is not positive definite'
      do i = 1, coupling%n
         coupling%local(i) = share * coupling%compliance(i, i)
      end do
   end subroutine split_local

   !> Settlement of the ground under a candidate; 0 if its obstacle does not couple candidates.
   pure real(wp) function settlement(coupling, candidate, reaction)
      type(coupling_t), intent(in) :: coupling
      integer, intent(in) :: candidate
      real(wp), intent(in) :: reaction(:)        !! (candidates) reactions
      settlement = 0.0_wp
      if (coupling%n == 0) return
      if (coupling%entry(candidate) > 0) &
         & settlement = dot_product(coupling%compliance(:, coupling%entry(candidate)), reaction(coupling%candidate))
   end function settlement

   !> Mean settlement of the rectangle `there` under a unit force that is distributed evenly over the rectangle `here`.
   pure real(wp) function rectangle_compliance(there, here, width, young, poisson) result(compliance)
      real(wp), intent(in) :: there(2), here(2) !! beginning and end along the row [length]
      real(wp), intent(in) :: width             !! width of the row [length]
      real(wp), intent(in) :: young, poisson    !! Young's modulus and Poisson's ratio of the ground
      real(wp) :: lengths(2), sum_
      integer :: i, j
      lengths = [there(2) - there(1), here(2) - here(1)]
      if (0.5_wp * abs(sum(there) - sum(here)) > far * maxval(lengths)) then
         sum_ = 0.0_wp
         do j = 1, 3
            do i = 1, 3
               sum_ = sum_ + weight(i) * weight(j) * &
                  & across(there(1) + point(i) * lengths(1) - here(1) - point(j) * lengths(2), width)
            end do
         end do
      else
         sum_ = twice_integrated(there(2) - here(1), width) - twice_integrated(there(2) - here(2), width) &
            & - twice_integrated(there(1) - here(1), width) + twice_integrated(there(1) - here(2), width)
         sum_ = sum_ / lengths(1) / lengths(2)
      end if
      compliance = (1.0_wp - poisson**2) / (pi * young) * sum_ / width**2
   end function rectangle_compliance

   !> Integral of 1/distance over both widths of the row, for the distance x along the row.
   pure real(wp) function across(x, width)
      real(wp), intent(in) :: x, width
      across = 2.0_wp * (width * asinh(width / abs(x)) - width**2 / (hypot(x, width) + abs(x)))
   end function across

   !> The function `across`, integrated twice along the row.
   pure real(wp) function twice_integrated(x, width) result(integral)
      real(wp), intent(in) :: x, width
      real(wp) :: a, b, s, cubes
      a = abs(x)
      b = width
      integral = 0.0_wp
      if (.not. a > 0.0_wp) return
      s = hypot(a, b)
      ! cubes = s^3 - a^3 - b^3 with s = sqrt(a^2 + b^2), in a form in which the largest terms do not cancel.
      if (a < b) then
         cubes = a**2 * (s**2 + s * b + b**2) / (s + b) - a**3
      else
         cubes = b**2 * (s**2 + s * a + a**2) / (s + a) - b**3
      end if
      integral = b * a**2 * asinh(b / a) + b**2 * a * asinh(a / b) - cubes / 3.0_wp
   end function twice_integrated

   !> Settlement of each point under a unit force at each point.
   subroutine layer_compliance(place, joined, modulus, shear, compliance, ok)
      real(wp), intent(in) :: place(:)           !! (n) coordinates of the points along the surface, increasing [length]
      logical, intent(in) :: joined(:)           !! (n - 1) true: a rod connects the point with the next point
      real(wp), intent(in) :: modulus, shear     !! k [force/length^2] and G [force], both multiplied by the width of the rod
      real(wp), intent(out) :: compliance(:, :)  !! (n, n) settlement of each point under a unit force at each point [length/force]
      logical, intent(out) :: ok                 !! false: the system is singular
      real(wp) :: diagonal(size(place)), beside(size(place)), h, decay, stiff
      integer :: i, n, info
      n = size(place)
      stiff = sqrt(modulus * shear)
      diagonal = 0.0_wp
      beside = 0.0_wp
      diagonal(1) = stiff
      diagonal(n) = diagonal(n) + stiff
      do i = 1, n - 1
         h = place(i + 1) - place(i)
         if (joined(i)) then
            beside(i) = -shear / h
            diagonal(i:i + 1) = diagonal(i:i + 1) + (shear / h + 0.5_wp * modulus * h)
         else
            decay = exp(-h * modulus / stiff)
            beside(i) = -stiff * 2.0_wp * decay / (1.0_wp - decay**2)
            diagonal(i:i + 1) = diagonal(i:i + 1) + stiff * (1.0_wp + decay**2) / (1.0_wp - decay**2)
         end if
      end do
      compliance = 0.0_wp
      do i = 1, n
         compliance(i, i) = 1.0_wp
      end do
      call dptsv(n, n, diagonal, beside, compliance, n, info)
      ok = info == 0
      if (.not. ok) return
      compliance = 0.5_wp * (compliance + transpose(compliance))
   end subroutine layer_compliance
end module ground_coupling

!> Foundations that act inside elements: the elements on which they act, and the shape of the stress-free axis between nodes.
module ground
   use kinds, only: wp
   use force_law, only: segment_slope
   use model, only: model_t
   use gauss_tableau, only: tableau_t, max_stages, gauss_points, stage_basis
   use rod_geometry, only: geometry_t
   use reference_curve, only: curve_point, curve_abscissa, is_straight
   use candidates, only: candidates_t, new_candidates
   implicit none
   private
   public :: ground_t, new_ground, home_deviation

   integer, parameter :: n_knots = 10 !! degree + 1 of the polynomial of the deviation, far above the order of the elements

   !> Foundations that act inside elements, and the deviation: stress-free axis minus its collocation polynomial. Without the
   !> deviation, an arc in a cavity of the same radius would be in contact at the nodes but not between them.
   type :: ground_t
      type(candidates_t) :: chain               !! candidates of the foundations: the nodes along them, in their order
      integer, allocatable :: first(:)          !! (elements + 1) index in `candidate` of each element's first entry
      integer, allocatable :: candidate(:)      !! candidates at the first node of each element, indices into chain
      logical, allocatable :: founded(:)        !! (elements) true: a foundation acts on the element
      logical :: tabled = .true.                !! true: the deviation is taken from a table, because no node moves along its rod
      logical, allocatable :: curved(:)         !! (elements) true: the deviation is not zero
      real(wp), allocatable :: slope(:) !! (obstacles) largest slope of the force law [force/length^2]; 0: the obstacle does not act
      !! inside elements
      real(wp) :: stiffest = 0.0_wp             !! largest stiffness of a node's share of a foundation [force/length]
      real(wp), allocatable :: deviation(:, :, :) !! (2, n_knots, elements) Newton's divided differences of the deviation, global
      !! axes
      real(wp) :: knot(n_knots) = 0.0_wp        !! knots of the divided differences, in (0, 1)
      integer :: terms = 0                      !! number of divided differences that are used; the remaining ones are rounding
      real(wp) :: rule_place(max_stages + 1, max_stages) = 0.0_wp !! (points, stages) abscissae of the Gauss rule with stages + 1
      !! points
      real(wp) :: rule_weight(max_stages + 1, max_stages) = 0.0_wp
   end type ground_t

contains

   !> Finds the elements on which foundations act, and the deviation of their stress-free axis between the nodes.
   function new_ground(model, tableau, home) result(ground)
      type(model_t), intent(in) :: model
      type(tableau_t), intent(in) :: tableau(:)   !! (stages) tableaux, indexed by the number of stages
      type(geometry_t), intent(in) :: home
      type(ground_t) :: ground
      real(wp) :: weight(n_knots), slope, rounding, largest(n_knots)
      integer :: e, c, n, places(model%mesh%n_elements)
      ground%chain = new_candidates(model, home, distributed=.true.)
      n = model%mesh%n_elements
      allocate (ground%founded(n), ground%curved(n), source=.false.)
      allocate (ground%first(n + 1), source=1)
      places = 0
      do c = 1, ground%chain%n
         e = ground%chain%element(2, c)
         if (e > 0) places(e) = places(e) + 1
      end do
      do e = 1, n
         ground%first(e + 1) = ground%first(e) + places(e)
      end do
      ground%founded = places > 0
      allocate (ground%candidate(ground%first(n + 1) - 1))
      do c = ground%chain%n, 1, -1
         e = ground%chain%element(2, c)
         if (e == 0) cycle
         places(e) = places(e) - 1
         ground%candidate(ground%first(e) + places(e)) = c
      end do
      allocate (ground%slope(size(model%obstacle)), source=0.0_wp)
      if (.not. any(ground%founded)) return
      do c = 1, ground%chain%n
         associate (obstacle => model%obstacle(ground%chain%obstacle(c)))
            slope = obstacle%modulus
            if (obstacle%law > 0) then
               associate (law => model%law(obstacle%law))
                  slope = obstacle%width * maxval([(abs(segment_slope(law, n)), n=1, size(law%force) - 1)])
               end associate
            end if
            ground%slope(ground%chain%obstacle(c)) = slope
            ground%stiffest = max(ground%stiffest, slope * ground%chain%tributary(c))
         end associate
      end do
      n = model%mesh%n_elements
      call gauss_points(n_knots, ground%knot, weight)
      do e = 1, max_stages
         call gauss_points(e + 1, ground%rule_place(:, e), ground%rule_weight(:, e))
      end do
      allocate (ground%deviation(2, n_knots, n), source=0.0_wp)
      rounding = 8.0_wp * epsilon(rounding) * maxval(abs(home%x))
      largest = [(largest_product(e), e=1, n_knots)]
      do e = 1, n
         if (ground%founded(e) .and. model%mesh%curve(e) > 0) call set_deviation(e)
      end do

   contains

      subroutine set_deviation(element)
         integer, intent(in) :: element
         real(wp) :: x(2), start(2), angle, speed, s, basis(max_stages), span(2)
         integer :: k, j, stages
         associate (curve => model%curve(model%mesh%curve(element)), g => home%element(element), &
            & table => ground%deviation(:, :, element))
            if (is_straight(curve)) return
            stages = model%mesh%stages(element)
            call curve_point(curve, model%imperfection, g%s(1), start, angle, speed)
            do k = 1, n_knots
               s = curve_abscissa(curve, model%imperfection, g%s(1), ground%knot(k) * g%length, g%excess)
               call curve_point(curve, model%imperfection, s, x, angle, speed)
               call stage_basis(tableau(stages), ground%knot(k), basis)
               span = 0.0_wp
               do j = 1, stages
                  span = span + basis(j) * g%tangent(:, j)
               end do
               table(:, k) = x - start - (g%length * g%scale) * span
            end do
            ground%curved(element) = maxval(abs(table)) > rounding
            do j = 2, n_knots
               do k = n_knots, j, -1
                  table(:, k) = (table(:, k) - table(:, k - 1)) / (ground%knot(k) - ground%knot(k - j + 1))
               end do
            end do
            ! In the j-th difference the rounding error of the values is multiplied by about 2^(j - 1) / (j - 1)! knots^(j - 1), and
            ! in the sum of the polynomial by the inverse of this. Terms that are below rounding in the sum are dropped.
            do j = n_knots, 1, -1
               if (maxval(abs(table(:, j))) * largest(j) > rounding) exit
            end do
            ground%terms = max(ground%terms, j)
         end associate
      end subroutine set_deviation

      !> Largest magnitude in (0, 1) of the polynomial that multiplies a divided difference in Newton's form, from samples.
      real(wp) function largest_product(number)
         integer, intent(in) :: number
         integer :: k
         largest_product = 0.0_wp
         do k = 0, 20
            largest_product = max(largest_product, abs(product(0.05_wp * k - ground%knot(:number - 1))))
         end do
      end function largest_product
   end function new_ground

   !> Deviation of the stress-free axis at a position inside an element, in global axes.
   pure function home_deviation(ground, e, tau) result(d)
      type(ground_t), intent(in) :: ground
      integer, intent(in) :: e
      real(wp), intent(in) :: tau        !! place in the element, 0 to 1
      real(wp) :: d(2)
      integer :: k
      d = 0.0_wp
      if (.not. ground%curved(e)) return
      do k = ground%terms, 1, -1
         d = ground%deviation(:, k, e) + (tau - ground%knot(k)) * d
      end do
   end function home_deviation
end module ground

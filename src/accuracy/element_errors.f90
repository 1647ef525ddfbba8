!> Errors of the elements at a point of the path. They cause the errors of the reported numbers (loads, displacements, reactions).
!> The dual displacements of a number state by how much a unit force on each unknown changes the number. The error of a number is
!> the work of the elements' errors on its dual displacements (error_contributions).
!>
!> The internal unknowns of the enriched element are eliminated, with the collocation polynomial of the original element as starting
!> point. A relative displacement and a moment remain at the ends; these two are the errors of the original element. Imposed on the
!> original element, they become out-of-balance forces on the nodes. (The end forces of the enriched element for the same
!> displacement cannot be used: at orders 2 and 4 its axial stiffness differs from that of the original element.)
!>
!> A kink of a foundation's force inside an element causes an error of the moment. A foundation that ends inside an element, or
!> whose law has a corner there, exerts a force with the part J (x - c)+. Here c is the position of the kink, J is the slope of the
!> gap at c times the jump of the foundation's stiffness, and (x - c)+ is x - c beyond c and zero before c. The element integrates
!> this force and its first moments exactly (see ge_element). But the moment of an element with s Gauss points is a polynomial of
!> degree s. The error is the part of J (x - c)+^3/6 that this polynomial does not represent. A foundation along the rod exerts no
!> moment.
module element_errors
   use kinds, only: wp
   use element_families, only: collocates
   use problem, only: problem_t
   use rod_state, only: state_t
   use linear_system, only: system_t
   use node_axes, only: element_unknowns
   use small_dense, only: solve_small
   use gauss_tableau, only: max_stages
   use force_law, only: segment_unknown
   use element_gap, only: element_gap_t, gap_value
   use ground_segments, only: element_cuts, gap_in_state, gap_rounding
   implicit none
   private
   public :: element_errors_t, new_element_errors, element_duals, left_of_kink

   !> Factor on the root of the sum of squares in procedure `rounding`. In the runs of a prototype this root was 0.26 to 148 times
   !> the true rounding error.
   real(wp), parameter :: rounding_factor = 4.0_wp

   !> Errors of all elements at one state: the sources of the errors of the reported numbers.
   type :: element_errors_t
      real(wp), allocatable :: force(:, :) !! (6, elements) out-of-balance forces of each element on its two nodes, in the axes in
      !! which the equations of the nodes are written (node axes)
      real(wp), allocatable :: kink(:) !! (elements) moments of slope discontinuities inside the elements, see kink_moments
      real(wp), allocatable :: moved(:, :) !! (2, elements) two magnitudes that set the size of rounding: displacement plus chord
      !! length [length]; rotation [rad]
   contains
      procedure :: work, work_of_kinks, rounding, excess_on_mode
   end type element_errors_t

   !> Largest error of the moment that a kink causes in an element of length 1 with J = 1 (see the header), over all positions of
   !> the kink. Index: the number s of Gauss points.
   real(wp), parameter :: left_of_kink(max_stages) = [4.13e-2_wp, 5.21e-3_wp, 6.78e-4_wp, 1.44e-4_wp, 7.07e-5_wp, 3.17e-5_wp]

   real(wp), parameter :: beside = 1.0_wp / 64.0_wp !! distance from the kink, on each side, between which the slope of the gap is
   !! computed; as a part of the element

contains

   !> Errors of all elements at a state.
   function new_element_errors(problem, state, system, enriched) result(errors)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system       !! assembled at `state`
      type(system_t), intent(in) :: enriched     !! system of the enriched problem at the same point
      type(element_errors_t) :: errors
      integer :: e
      allocate (errors%force(6, problem%model%mesh%n_elements), errors%moved(2, problem%model%mesh%n_elements))
      do e = 1, problem%model%mesh%n_elements
         errors%force(:, e) = unbalanced(problem, system, enriched, e)
         associate (node => problem%model%mesh%node(:, e))
            errors%moved(1, e) = norm2(state%geometry%element(e)%chord) + maxval(abs(state%u(1:2, node)))
            errors%moved(2, e) = maxval(abs(state%u(3, node)))
         end associate
      end do
      errors%kink = kink_moments(problem, state)
   end function new_element_errors

   !> Entries of a vector of all unknowns at the nodes of each element: (6, elements).
   function element_duals(problem, system, x) result(dual)
      type(problem_t), intent(in) :: problem
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: x(:)               !! (unknowns) node axes
      real(wp) :: dual(6, problem%model%mesh%n_elements)
      integer :: e
      do e = 1, size(dual, 2)
         dual(:, e) = element_unknowns(problem, system, x, e)
      end do
   end function element_duals

   !> Work of each element's out-of-balance forces on the dual displacements of its two nodes, (elements).
   pure function work(self, dual)
      class(element_errors_t), intent(in) :: self
      real(wp), intent(in) :: dual(:, :)         !! (6, elements) dual displacements of the nodes of each element
      real(wp) :: work(size(dual, 2))
      work = sum(dual * self%force, dim=1)
   end function work

   !> (elements) Bound of the error of a number that kinks of the foundation's force inside each element cause: the work of the
   !> moment errors (kink_moments) on the moments of the dual displacements (dual moments). The dual moments inside an element are
   !> at most those at its ends.
   pure function work_of_kinks(self, problem, system, dual) result(work)
      class(element_errors_t), intent(in) :: self
      type(problem_t), intent(in) :: problem
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: dual(:, :)         !! (6, elements) dual displacements of the nodes of each element
      real(wp) :: work(size(dual, 2))
      integer, parameter :: moments(2) = [3, 6]
      integer :: e
      work = 0.0_wp
      do e = 1, size(work)
         if (self%kink(e) > 0.0_wp) work(e) = self%kink(e) * problem%compliance(e)%bending * &
            & maxval(abs(matmul(system%ek(moments, :, e), dual(:, e))))
      end do
   end function work_of_kinks

   !> Estimated rounding error of a number: the rounding of the displacements, chords and stress resultants of all elements, with
   !> the same weights as the errors of the elements.
   pure real(wp) function rounding(self, system, dual)
      class(element_errors_t), intent(in) :: self
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: dual(:, :)         !! (6, elements) dual displacements of the nodes of each element
      real(wp) :: resultant(3)
      integer :: e
      rounding = 0.0_wp
      do e = 1, size(dual, 2)
         resultant = matmul(system%ek(4:6, :, e), dual(:, e))
         rounding = rounding + dot_product(resultant(1:2), resultant(1:2)) * self%moved(1, e)**2 + &
            & (resultant(3) * self%moved(2, e))**2 + sum((dual(:, e) * system%eraw(:, e))**2)
      end do
      rounding = rounding_factor * epsilon(rounding) * sqrt(rounding)
   end function rounding

   !> Work of the residual and of the elements' out-of-balance forces on a null vector, reduced by the error of this work. The error
   !> is the sum of the elements' absolute contributions, their rounding, and the rounding of the directions of the elements'
   !> forces. The result is zero if the error is larger than the work.
   real(wp) function excess_on_mode(self, problem, system, mode) result(excess)
      class(element_errors_t), intent(in) :: self
      type(problem_t), intent(in) :: problem
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: mode(:)            !! (unknowns) null vector, node axes
      integer, parameter :: forces(4) = [1, 2, 4, 5], moments(2) = [3, 6]
      real(wp) :: free(size(mode)), dual(6, problem%model%mesh%n_elements), share(problem%model%mesh%n_elements), turned
      integer :: e
      free = merge(0.0_wp, mode, system%fixed)
      dual = element_duals(problem, system, free)
      share = self%work(dual)
      turned = 0.0_wp
      do e = 1, size(share)
         turned = turned + (norm2(dual(forces, e)) * norm2(system%eraw(forces, e)) + &
            & norm2(dual(moments, e)) * norm2(system%eraw(moments, e)))**2
      end do
      excess = abs(dot_product(free, system%residual) + sum(share)) - sum(abs(share)) - self%rounding(system, dual) - &
         & rounding_factor * epsilon(turned) * sqrt(turned)
      excess = max(excess, 0.0_wp)
   end function excess_on_mode

   !> Out-of-balance forces of an element on its nodes, caused by the errors of the element; node axes. The errors may be imposed as
   !> a displacement of either end; the mean of both results does not depend on the direction of the element.
   function unbalanced(problem, system, finer, e) result(force)
      type(problem_t), intent(in) :: problem
      type(system_t), intent(in) :: system, finer
      integer, intent(in) :: e
      real(wp) :: force(6), difference(6), by_end(6, 2)
      logical :: singular(2)
      difference = finer%ef(:, e) - system%ef(:, e)
      force = difference
      if (.not. collocates(problem%model%mesh%family(e)) .or. problem%conforms(e) > 0) return
      call by_displacement(0, 3, by_end(:, 1), singular(1))
      call by_displacement(3, 0, by_end(:, 2), singular(2))
      if (.not. any(singular)) force = 0.5_wp * sum(by_end, dim=2)

   contains

      !> Out-of-balance forces caused by a displacement of one end while the other end is fixed. Its size: in the enriched element
      !> it causes, at the fixed end, the difference between the forces of the two elements.
      subroutine by_displacement(held, moved, forces, singular)
         integer, intent(in) :: held, moved      !! offsets (0 or 3) of the entries of the fixed end and of the displaced end
         real(wp), intent(out) :: forces(6)
         logical, intent(out) :: singular
         real(wp) :: stiffness(3, 3), gap(1, 3), weight(3)
         integer :: j
         stiffness = transpose(finer%ek(held + 1:held + 3, moved + 1:moved + 3, e))
         gap(1, :) = difference(held + 1:held + 3)
         weight = [problem%size, problem%size, 1.0_wp]
         call solve_small(3, stiffness, gap, singular, weight)
         if (singular) return
         forces(held + 1:held + 3) = 0.0_wp
         forces(moved + 1:moved + 3) = difference(moved + 1:moved + 3)
         do j = 1, 3
            associate (coarse => system%ek(:, moved + j, e), fine => finer%ek(:, moved + j, e))
               forces(held + 1:held + 3) = forces(held + 1:held + 3) + coarse(held + 1:held + 3) * gap(1, j)
               forces(moved + 1:moved + 3) = forces(moved + 1:moved + 3) + &
                  & (coarse(moved + 1:moved + 3) - fine(moved + 1:moved + 3)) * gap(1, j)
            end associate
         end do
      end subroutine by_displacement
   end function unbalanced

   !> (elements) moment error caused by kinks in each element, integrated along the element [moment * length].
   function kink_moments(problem, state) result(moment)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state         !! converged
      real(wp) :: moment(problem%model%mesh%n_elements)
      type(element_gap_t) :: gap
      real(wp), allocatable :: tau(:), level(:)
      real(wp) :: slope, rounding
      integer :: c, n, j
      moment = 0.0_wp
      rounding = gap_rounding(state)
      associate (chain => problem%ground%chain)
         do c = 1, chain%n
            if (state%segment(c) /= segment_unknown) cycle
            if (problem%model%obstacle(chain%obstacle(c))%along_rod) cycle
            call element_cuts(problem, state, c, rounding, n, tau, level)
            if (n == 0) cycle
            gap = gap_in_state(problem, state, c)
            associate (e => chain%element(2, c))
               associate (h => state%geometry%element(e)%length)
                  do j = 1, n
                     slope = (gap_value(problem, gap, tau(j) + beside) - gap_value(problem, gap, tau(j) - beside)) / &
                        & (2.0_wp * beside * h)
                     moment(e) = moment(e) + left_of_kink(problem%model%mesh%stages(e)) * h**4 * &
                        & problem%ground%slope(chain%obstacle(c)) * abs(slope)
                  end do
               end associate
            end associate
         end do
      end associate
   end function kink_moments
end module element_errors

!> Compares the number of unstable directions (negative pivots of the tangent) on the mesh with that of the enriched problem, whose
!> elements have a higher order.
!>
!> If these two counts differ, the path has passed a bifurcation that only one of the two discretisations has. Load and
!> displacements need not show this: a straight rod of one element of order 2 is exact except that it cannot buckle. The counts may
!> also be equal while the discretisation error of an eigenvalue of the tangent exceeds the eigenvalue. Then the path may have
!> passed a bifurcation that the structure does not have.
module missed_modes
   use kinds, only: wp, pi
   use errors, only: error_t
   use problem, only: problem_t
   use rod_state, only: state_t
   use linear_system, only: system_t, new_system
   use bordered_system, only: linearise
   use track_nodes, only: excess_curvature
   use mesh_adequacy, only: compression
   use tangent_modes, only: modes_t, lowest_modes, apply_tangent
   use force_free_contact, only: any_force_free, remove_force_free_lines
   use enriched_problem, only: new_finer_problem, new_finer_state
   use enriched_path, only: enriched_path_t, enriched_point_t
   use located_zero, only: mode_rounding
   implicit none
   private
   public :: unstable_difference, sign_uncertain

   real(wp), parameter :: beyond_rounding = 10.0_wp !! factor on the rounding error of an eigenvalue above which its sign is certain

contains

   !> Number of unstable directions that the pivots of a state do not show: the count of the enriched problem minus that of the
   !> original problem. If this is zero, the count of buckling modes inside elements (hidden_directions) is returned. If this is
   !> zero as well, the result is the count of those that appear when line contacts without pressure are released
   !> (released_difference). A difference that is uncertain, because an eigenvalue is close to zero, counts as 0.
   integer function unstable_difference(problem, state, system, path, point, allowed) result(difference)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system       !! factored at `state`
      type(enriched_path_t), intent(in) :: path
      type(enriched_point_t), intent(in) :: point   !! the same point of the enriched problem's path
      integer, intent(in) :: allowed             !! difference that is explained by an event at the point
      difference = 0
      if (size(problem%hinge) > 0) return
      difference = certain_difference(problem, state, system, path%problem, point%state, point%system, allowed)
      if (difference == 0) difference = hidden_directions(problem, state, system)
      if (difference /= 0) return
      if (any_force_free(problem, state, system)) difference = released_difference(problem, state, system, allowed)
   end function unstable_difference

   !> True if the discretisation error of the eigenvalue nearest to zero exceeds the eigenvalue, so that its sign is uncertain. An
   !> eigenvalue that is zero within rounding does not count.
   logical function sign_uncertain(problem, state, system, path, point) result(uncertain)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system       !! factored at `state`
      type(enriched_path_t), intent(in) :: path
      type(enriched_point_t), intent(in) :: point   !! the same point of the enriched problem's path
      type(modes_t) :: modes
      type(error_t), allocatable :: error
      real(wp) :: held(system%n), answer(system%n), finer
      uncertain = .false.
      if (size(problem%hinge) > 0) return
      if (.not. points_comparable(problem, state, path%problem, point%state)) return
      call lowest_modes(problem, state, system, 1, modes, error)
      if (allocated(error) .or. modes%n < 1) return
      held = merge(0.0_wp, modes%x(:, 1), system%fixed)
      call apply_tangent(path%problem, point%state, point%system, held, answer, finer)
      uncertain = abs(finer - modes%mu(1)) > abs(finer)
      if (uncertain) uncertain = abs(modes%mu(1)) > beyond_rounding * mode_rounding(problem, state, system, modes%x(:, 1))
   end function sign_uncertain

   !> Number of unstable directions that no pivot counts, at least: buckling modes of elements between nodes that do not move
   !> (Wittrick and Williams 1971). An element of length h that is clamped at both ends has the n-th of these modes at the thrust N
   !> = 4 pi^2 n^2 EI/h^2. Elements of a higher order do not show these modes either, as their nodes do not move.
   integer function hidden_directions(problem, state, system) result(hidden)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system       !! assembled at `state`
      real(wp) :: force
      integer :: e
      hidden = 0
      do e = 1, problem%model%mesh%n_elements
         ! Elements that are supported between their nodes by an obstacle or the ground buckle at higher loads and do not count.
         if (problem%conforms(e) > 0 .or. problem%ground%founded(e)) cycle
         ! The thrust inside the element is at most the larger of the end forces.
         force = max(norm2(system%eraw(1:2, e)), norm2(system%eraw(4:5, e)))
         if (force * state%geometry%element(e)%length**2 * problem%compliance(e)%bending < (2.0_wp * pi)**2) cycle
         hidden = hidden + int(sqrt(compression(problem, state, e)) / (2.0_wp * pi))
      end do
   end function hidden_directions

   !> Difference between the numbers of negative pivots of a problem and of a finer one; 0 if the signs are uncertain.
   integer function certain_difference(problem, state, system, finer, better, linear, allowed) result(difference)
      type(problem_t), intent(in) :: problem, finer
      type(state_t), intent(in) :: state, better
      type(system_t), intent(in) :: system, linear  !! factored at `state` and at `better`
      integer, intent(in) :: allowed
      integer :: zeros(2)                        ! negative eigenvalues among those that vanish at the event
      difference = linear%negative_pivots - system%negative_pivots
      if (abs(difference) <= allowed) difference = 0
      if (difference == 0) return
      if (.not. points_comparable(problem, state, finer, better)) difference = 0
      if (difference == 0) return
      if (.not. sign_is_certain(problem, state, system, allowed, zeros(1))) difference = 0
      if (difference == 0) return
      if (.not. sign_is_certain(finer, better, linear, allowed, zeros(2))) difference = 0
      if (difference /= 0) difference = difference - (zeros(2) - zeros(1))
   end function certain_difference

   !> Difference between the numbers of unstable directions on enriched and original elements, in the problem without line contacts
   !> that have no pressure (force_free_contact). Such contacts hide a difference: a straight rod along a straight wall is exact on
   !> any mesh.
   integer function released_difference(problem, state, system, allowed) result(difference)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system       !! factored at `state`
      integer, intent(in) :: allowed
      type(problem_t) :: free, finer
      type(state_t) :: released, better
      type(system_t) :: loose, linear
      logical :: any_weak
      difference = 0
      call remove_force_free_lines(problem, state, system, free, released, any_weak)
      if (.not. any_weak) return
      loose = new_system(free)
      call linearise(free, released, released, loose)
      call new_finer_problem(free, finer)
      call new_finer_state(free, released, finer, better)
      linear = new_system(finer)
      call linearise(finer, better, better, linear)
      if (.not. (loose%ok .and. linear%ok)) return
      difference = certain_difference(free, released, loose, finer, better, linear, allowed)
      if (difference == 0) difference = hidden_directions(free, released, loose)
   end function released_difference

   !> True if at every point contact the relative curvatures (rod minus obstacle) on both discretisations differ by less than their
   !> magnitudes, and so have the same sign. Then the numbers of negative pivots can be compared. The rotational stiffness of a
   !> point contact is proportional to the inverse of its relative curvature; close to a transition to a line contact or to two
   !> point contacts the sign is uncertain.
   logical function points_comparable(problem, state, finer, better) result(comparable)
      type(problem_t), intent(in) :: problem, finer
      type(state_t), intent(in) :: state, better
      real(wp) :: excess(2), extension
      integer :: c
      comparable = .true.
      do c = 1, problem%candidates%n
         if (.not. problem%candidates%rolls(c) .or. problem%candidates%follows(c)) cycle
         call excess_curvature(problem, state, c, excess(1), extension)
         call excess_curvature(finer, better, c, excess(2), extension)
         comparable = comparable .and. abs(excess(1) - excess(2)) < minval(abs(excess))
      end do
   end function points_comparable

   !> True if the signs of all eigenvalues are certain, except for the eigenvalues that vanish at an event.
   logical function sign_is_certain(problem, state, system, zeros, negative)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system
      integer, intent(in) :: zeros               !! number of eigenvalues that vanish at the event
      integer, intent(out) :: negative           !! number of negative eigenvalues among those of the event
      type(modes_t) :: modes
      type(error_t), allocatable :: error
      integer :: k
      negative = 0
      k = 1 + zeros
      call lowest_modes(problem, state, system, k, modes, error)
      sign_is_certain = .not. allocated(error) .and. modes%n >= k
      if (.not. sign_is_certain) return
      negative = count(modes%mu(:zeros) < 0.0_wp)
      sign_is_certain = abs(modes%mu(k)) > beyond_rounding * mode_rounding(problem, state, system, modes%x(:, k))
   end function sign_is_certain
end module missed_modes

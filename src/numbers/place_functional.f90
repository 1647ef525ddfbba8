!> Positions of touchdown points along their rods, and relative curvatures at point contacts, as functionals.
!>
!> At a touchdown point the moment does not jump or, at a point contact, the rod has the direction of the obstacle
!> (touchdown_points). The derivatives of the point's position are finite differences of this condition, computed at fixed touchdown
!> points as the equations are. A point contact at a segment boundary has a fixed node; its force moves along the rod beside the
!> node (rolling contact).
!>
!> The relative curvature is the curvature of the rod minus that of the obstacle at a point contact, by stress-free length, positive
!> if the rod bends away from the obstacle. If the path constraint prescribes the relative curvature, the path can be followed to
!> the osculating contact, at which the relative curvature is zero. At this contact the obstacle gives no rotational stiffness, and
!> free spans beside it may be about to buckle, so that neither the load nor displacements are parameters of the path.
module place_functional
   use kinds, only: wp
   use problem, only: problem_t
   use rod_state, only: state_t
   use linear_system, only: system_t
   use track_nodes, only: rolled_t, rolled
   use touchdown_points, only: touchdown_t, touchdown_at, touchdown_step, excess_ahead
   use span_regions, only: chain_coordinate
   use error_bar, only: place_bar_t
   use state_functional, only: functional_t
   use local_differences, only: local_number_t, linearised
   implicit none
   private
   public :: moving_ends, places_at, places_after, new_place_functional, named_place, new_relative_curvature

   !> Position of a touchdown point as a function of the state, for finite differences.
   type, extends(local_number_t) :: touchdown_place_t
      integer :: candidate = 0
      type(touchdown_t) :: before                !! touchdown condition at the state in which the node is at the touchdown point
   contains
      procedure :: value => place_of_state
   end type touchdown_place_t

   !> Relative curvature at a point contact as a function of the state, for finite differences.
   type, extends(local_number_t) :: relative_curvature_t
      integer :: candidate = 0
      type(state_t) :: before                   !! state in which the node is at the point contact
   contains
      procedure :: value => curvature_of_state
   end type relative_curvature_t

contains

   !> Candidates whose contact force moves along the rod: touchdown points, whose nodes move with the force, and point contacts at
   !> segment boundaries, whose nodes are fixed (rolling contact).
   pure function moving_ends(problem) result(ends)
      type(problem_t), intent(in) :: problem
      integer, allocatable :: ends(:)
      integer :: c
      ends = pack([(c, c=1, problem%candidates%n)], [(problem%candidates%contact_span(c) > 0 .and. (problem%candidates%moves(c) &
         & .or. problem%candidates%rolls(c)), c=1, problem%candidates%n)])
   end function moving_ends

   !> (ends) Positions of touchdown points: stress-free arc lengths along the chains of their contacts. (The chain of a contact is
   !> the sequence of its candidates along the rods.)
   function places_at(problem, state, ends) result(at)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: ends(:)             !! candidates from moving_ends
      real(wp) :: at(size(ends))
      integer :: k
      at = [(place_at(problem, state, ends(k)), k=1, size(ends))]
   end function places_at

   !> Positions of touchdown points in a state `after` that is close to `before` and has the same nodes.
   function places_after(problem, before, after, ends) result(at)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: before, after
      integer, intent(in) :: ends(:) !! candidates from moving_ends
      real(wp) :: at(size(ends))
      integer :: k
      at = [(place_after(problem, touchdown_at(problem, before, ends(k)), after, ends(k)), k=1, size(ends))]
   end function places_after

   !> Position of one touchdown point in a state `after`: the position of its node plus the step that follows from the touchdown
   !> condition.
   real(wp) function place_after(problem, before, after, candidate) result(at)
      type(problem_t), intent(in) :: problem
      type(touchdown_t), intent(in) :: before    !! touchdown condition in a state close to `after`
      type(state_t), intent(in) :: after
      integer, intent(in) :: candidate
      at = place_at(problem, after, candidate) + touchdown_step(problem, before, after, candidate)
   end function place_after

   !> Position of one touchdown point: that of its node, or that of the rolling contact force beside the node.
   real(wp) function place_at(problem, state, candidate) result(at)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: candidate
      type(rolled_t) :: roll
      roll = rolled(problem, state, candidate)
      at = chain_coordinate(problem, state, candidate, merge(1, 2, is_last(problem, candidate))) + roll%way
   end function place_at

   !> Position of the touchdown point in a state that has the nodes of `before`.
   real(wp) function place_of_state(self, problem, state) result(at)
      class(touchdown_place_t), intent(in) :: self
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      at = place_after(problem, self%before, state, self%candidate)
   end function place_of_state

   !> Linearisation of a touchdown point's position. At the end of a line contact, errors of the elements' end moments also move the
   !> point.
   function new_place_functional(problem, state, system, candidate) result(number)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system       !! assembled at `state`
      integer, intent(in) :: candidate
      type(functional_t) :: number
      type(touchdown_place_t) :: place
      place%candidate = candidate
      place%before = touchdown_at(problem, state, candidate)
      associate (beside => problem%candidates%element(:, candidate))
         place%element = pack(beside, beside > 0)
         number = linearised(problem, state, system, place)
         ! The residual that the iteration left in the touchdown condition does not count in the error bar of the position.
         number%defect = 0.0_wp
         if (.not. (place%before%by_moment .and. abs(place%before%slope) > 0.0_wp)) return
         allocate (number%by_element(6, problem%model%mesh%n_elements), source=0.0_wp)
         if (beside(1) > 0) number%by_element(6, beside(1)) = 1.0_wp / place%before%slope
         if (beside(2) > 0) number%by_element(3, beside(2)) = 1.0_wp / place%before%slope
      end associate
   end function new_place_functional

   !> Identifies a touchdown point, for its error bar, by the contact span, its end and the position.
   type(place_bar_t) function named_place(problem, candidate, at) result(place)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: candidate
      real(wp), intent(in) :: at !! position from places_at
      place%contact_span = problem%contact_span(problem%candidates%contact_span(candidate))%number
      place%last = is_last(problem, candidate)
      place%at = at
   end function named_place

   !> True if a touchdown point is the last end of a line contact; false for the first end of a line contact and for a point
   !> contact.
   pure logical function is_last(problem, candidate)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: candidate
      is_last = problem%candidates%neighbour(1, candidate) > 0
   end function is_last

   !> Relative curvature at a point contact as a functional.
   function new_relative_curvature(problem, state, system, candidate) result(curvature)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system      !! assembled at `state`
      integer, intent(in) :: candidate          !! candidate of a point contact
      type(functional_t) :: curvature
      type(relative_curvature_t) :: number
      number%candidate = candidate
      number%before = state
      associate (beside => problem%candidates%element(:, candidate))
         number%element = pack(beside, beside > 0)
      end associate
      curvature = linearised(problem, state, system, number)
   end function new_relative_curvature

   !> Relative curvature in a state that has the nodes of `before`.
   real(wp) function curvature_of_state(self, problem, state) result(value)
      class(relative_curvature_t), intent(in) :: self
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      value = excess_ahead(problem, self%before, state, self%candidate)
   end function curvature_of_state
end module place_functional

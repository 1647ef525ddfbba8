!> Error of monitors between the nodes of elements, in addition to the nodal error: enriched polynomials have another displacement
!> at the same place of the element.
module inside_elements
   use kinds, only: wp
   use model, only: quantity_displacement
   use problem, only: problem_t
   use rod_state, only: state_t
   use linear_system, only: system_t
   use state_functional, only: functional_t
   use displacement_functional, only: new_displacement_functional, watched_displacement
   use deck_nodes, only: find_node, place_defect
   use rod_profile, only: profile_t
   use state_transfer, only: point_displacement
   implicit none
   private
   public :: inside_t, look_inside

   !> Change of a monitor inside elements due to enriched polynomials.
   type :: inside_t
      real(wp) :: change = 0.0_wp                !! monitor of the enriched polynomial minus the monitor
      real(wp) :: most = 0.0_wp                  !! bound of that change
      integer, allocatable :: element(:)         !! elements with the monitor inside; empty: monitor at nodes
   end type inside_t

   integer, parameter :: places = 7              !! places in an element at which two polynomials are compared

contains

   !> Change of a monitor between nodes due to enriched polynomials; zero if the monitor is not a displacement.
   function look_inside(problem, state, finer, start, at_start, watched) result(inside)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(problem_t), intent(in) :: finer       !! the enriched problem
      type(state_t), intent(in) :: start         !! the same point as a state of the enriched problem
      type(system_t), intent(in) :: at_start     !! system of the enriched problem, assembled there
      integer, intent(in) :: watched             !! index into model%monitor
      type(inside_t) :: inside
      type(functional_t) :: enriched
      real(wp) :: tau
      integer :: i, node, holder
      allocate (inside%element(0))
      associate (monitor => problem%deck%monitor(watched))
         if (monitor%quantity /= quantity_displacement) return
         enriched = new_displacement_functional(finer, start, at_start, watched)
         inside%change = enriched%defect + enriched%value - watched_displacement(problem, state, watched)
         do i = 1, size(monitor%node)
            call find_node(problem, state, monitor%node(i), node, holder, tau)
            if (holder == 0) cycle
            inside%element = [inside%element, holder]
            inside%most = inside%most + abs(monitor%factor) / size(monitor%node) * &
               & largest_inside(problem, state, finer, start, at_start, monitor%component, holder, tau)
         end do
         inside%most = max(inside%most, abs(inside%change))
      end associate
   end function look_inside

   !> Bound of a displacement error at a distance from the nodes: at the place itself two polynomials may agree by chance.
   real(wp) function largest_inside(problem, state, finer, start, at_start, component, element, tau) result(most)
      type(problem_t), intent(in) :: problem, finer
      type(state_t), intent(in) :: state, start
      type(system_t), intent(in) :: at_start
      integer, intent(in) :: component, element
      real(wp), intent(in) :: tau                !! position in the element, 0 to 1
      type(profile_t) :: profile, finer_profile
      real(wp) :: other, largest, u(3), v(3), defect(3)
      integer :: j
      largest = 0.0_wp
      do j = 1, places
         other = real(j, wp) / (places + 1)
         call place_defect(finer, start, at_start, element, other, finer_profile, defect)
         call point_displacement(problem, state, element, other, profile, u)
         call point_displacement(finer, start, element, other, finer_profile, v)
         largest = max(largest, abs(defect(component) + v(component) - u(component)))
      end do
      most = 4.0_wp * tau * (1.0_wp - tau) * largest
   end function largest_inside
end module inside_elements

!> Error of numbers between the nodes of elements, in addition to the nodal error: enriched polynomials have another displacement at
!> the same place of the element.
module inside_elements
   use kinds, only: wp
   use problem, only: problem_t
   use rod_state, only: state_t
   use linear_system, only: system_t
   use state_functional, only: functional_t, inner_place_t, section_place_t
   use section_quantities, only: section_value
   use bordered_system, only: apply_increment
   use deck_nodes, only: place_defect
   use state_transfer, only: kept_t, point_displacement
   implicit none
   private
   public :: inside_t, look_inside

   !> Change of a number by the enriched polynomials inside elements.
   type :: inside_t
      real(wp) :: change = 0.0_wp                !! number from the enriched polynomials minus the number
      real(wp) :: most = 0.0_wp                  !! bound of that change
      integer, allocatable :: element(:)         !! elements with the number's places inside; empty: none
   end type inside_t

   integer, parameter :: samples = 7             !! places in an element at which two polynomials are compared

contains

   !> Change of a number between nodes due to enriched polynomials, in which the elements have no internal residuals.
   function look_inside(problem, state, number, finer, start, at_start) result(inside)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(functional_t), intent(in) :: number
      type(problem_t), intent(in) :: finer       !! the enriched problem
      type(state_t), intent(in) :: start         !! the same point as a state of the enriched problem
      type(system_t), intent(in) :: at_start     !! system of the enriched problem, assembled there
      type(inside_t) :: inside
      type(kept_t) :: own, enriched
      type(state_t) :: solved                    ! enriched state without internal residuals
      real(wp) :: largest
      integer :: i, j
      allocate (inside%element(0))
      if (allocated(number%section)) call look_at_sections()
      if (.not. allocated(number%inner)) return
      inside%element = number%inner%element
      do i = 1, size(number%inner)
         associate (place => number%inner(i))
            inside%change = inside%change + difference(place, place%tau)
            ! At the place itself two polynomials may agree by chance.
            largest = maxval([(abs(difference(place, real(j, wp) / (samples + 1))), j=1, samples)])
            inside%most = inside%most + 4.0_wp * place%tau * (1.0_wp - place%tau) * largest
         end associate
      end do
      inside%most = max(inside%most, abs(inside%change))

   contains

      !> Change of sections in enriched elements with the same nodal displacements.
      subroutine look_at_sections()
         real(wp) :: none(at_start%n)
         solved = start
         none = 0.0_wp
         call apply_increment(finer, at_start, none, 0.0_wp, solved)
         inside%element = number%section%element
         do i = 1, size(number%section)
            associate (place => number%section(i))
               inside%change = inside%change + place%factor * section_change(place, place%tau)
               largest = maxval([(abs(section_change(place, real(j, wp) / (samples + 1))), j=1, samples)])
               inside%most = inside%most + 4.0_wp * place%tau * (1.0_wp - place%tau) * abs(place%factor) * largest
            end associate
         end do
         inside%most = max(inside%most, abs(inside%change))
      end subroutine look_at_sections

      real(wp) function section_change(place, tau)
         type(section_place_t), intent(in) :: place
         real(wp), intent(in) :: tau             !! position in the element, 0 to 1
         section_change = section_value(finer, solved, place%element, tau, place%quantity, place%sense) - &
            & section_value(problem, state, place%element, tau, place%quantity, place%sense)
      end function section_change

      !> Difference of the two polynomials in an element, with the weights of a place.
      real(wp) function difference(place, tau)
         type(inner_place_t), intent(in) :: place
         real(wp), intent(in) :: tau             !! position in the element, 0 to 1
         real(wp), dimension(3) :: u, v, defect
         call place_defect(finer, start, at_start, place%element, tau, enriched%profile, defect)
         call point_displacement(problem, state, place%element, tau, own, u)
         call point_displacement(finer, start, place%element, tau, enriched, v)
         difference = dot_product(place%weight, defect + v - u)
      end function difference
   end function look_inside
end module inside_elements

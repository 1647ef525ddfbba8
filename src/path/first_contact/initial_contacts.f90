!> Isolated places, at nodes and between them, where rods of a deck are in contact with obstacles at the start. Meshes that detect
!> contact have nodes at these places.
module initial_contacts
   use kinds, only: wp
   use problem, only: problem_t, touching_gap
   use contact_spans, only: contact_span_t
   use obstacle_geometry, only: obstacle_gap
   use reference_curve, only: curve_point
   use golden_section, only: golden_section_t, sections_to_rounding
   implicit none
   private
   public :: find_initial_contacts

contains

   !> All isolated places with a least gap of zero. A rod along its obstacle has no isolated places.
   function find_initial_contacts(problem) result(contact_span)
      type(problem_t), intent(in) :: problem         !! problem on the deck's mesh
      type(contact_span_t), allocatable :: contact_span(:)
      real(wp), allocatable :: at(:), gap(:)
      logical, allocatable :: touches(:)              ! true: gap of zero at the sample; one additional value at each end
      integer :: contact, rod_segment, i
      allocate (contact_span(0))
      do contact = 1, size(problem%deck%contact)
         if (.not. problem%deck%contact(contact)%along) cycle
         do rod_segment = 1, size(problem%layout%rod_segment)
            if (.not. (problem%covered(rod_segment, contact) .and. problem%layout%rod_segment(rod_segment)%free)) cycle
            call sample_gap(problem, contact, rod_segment, at, gap)
            touches = [.false., gap <= touching_gap(problem), .false.]
            do i = 1, size(at)
               if (.not. touches(i + 1) .or. touches(i) .or. touches(i + 2)) cycle
               contact_span = [contact_span, contact_span_t(contact=contact, rod_segment=rod_segment, at=[at(i), at(i)])]
            end do
         end do
      end do
   end function find_initial_contacts

   !> Samples the gap at the deck's nodes along a rod segment, and its minimum inside each element.
   subroutine sample_gap(problem, contact, rod_segment, at, gap)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: contact, rod_segment
      real(wp), allocatable, intent(out) :: at(:)    !! coordinates along the rod segment, increasing
      real(wp), allocatable, intent(out) :: gap(:)
      real(wp) :: inside, place
      integer :: k, n
      associate (whole => problem%layout%rod_segment(rod_segment))
         allocate (at(2 * size(whole%element) + 1), gap(2 * size(whole%element) + 1))
         n = 0
         call keep(whole%at(1), gap_at(problem, contact, whole%element(1), 0.0_wp))
         do k = 1, size(whole%element)
            call least_inside(problem, contact, whole%element(k), place, inside)
            associate (last => gap_at(problem, contact, whole%element(k), 1.0_wp))
               if (inside < min(gap(n), last)) call keep(whole%at(k) + place * (whole%at(k + 1) - whole%at(k)), inside)
               call keep(whole%at(k + 1), last)
            end associate
         end do
      end associate
      at = at(:n)
      gap = gap(:n)

   contains

      subroutine keep(where, what)
         real(wp), intent(in) :: where, what
         n = n + 1
         at(n) = where
         gap(n) = what
      end subroutine keep
   end subroutine sample_gap

   !> Finds the minimum of the gap inside an element; the gap is assumed to have only one minimum there.
   subroutine least_inside(problem, contact, e, place, least)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: contact, e
      real(wp), intent(out) :: place                 !! place, 0 to 1 of the element
      real(wp), intent(out) :: least
      type(golden_section_t) :: search
      call search%begin(0.0_wp, 1.0_wp, sections_to_rounding)
      do while (search%asks(place))
         call search%tell(gap_at(problem, contact, e, place))
      end do
      least = search%least
   end subroutine least_inside

   !> Gap at a position of an element of the deck.
   real(wp) function gap_at(problem, contact, e, tau) result(gap)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: contact, e
      real(wp), intent(in) :: tau
      real(wp) :: x(2), angle, speed, normal(2), bend
      associate (mesh => problem%deck%mesh, c => problem%deck%contact(contact))
         if (mesh%curve(e) > 0) then
            call curve_point(problem%deck%curve(mesh%curve(e)), problem%deck%imperfection, mesh%s(1, e) + &
               & tau * (mesh%s(2, e) - mesh%s(1, e)), x, angle, speed)
         else
            x = (1.0_wp - tau) * mesh%x(:, mesh%node(1, e)) + tau * mesh%x(:, mesh%node(2, e))
         end if
         call obstacle_gap(problem%deck%obstacle(c%obstacle), x, gap, normal, bend)
         gap = gap + c%gap + problem%overlap(contact)
      end associate
   end function gap_at
end module initial_contacts

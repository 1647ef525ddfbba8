!> Contact spans: connected contact of a rod with a rigid obstacle, at a point or along a line between two touchdown points. The
!> contact set is the set of all contact spans; their ends are positions along the rods, not nodes of a mesh.
module contact_spans
   use kinds, only: wp
   use text, only: to_text
   use model, only: model_t, contact_t
   use obstacle_types, only: ground_independent
   use element_families, only: conforms
   use cross_section, only: varies
   use rod_layout, only: layout_t, new_layout
   use ordering, only: ascending
   implicit none
   private
   public :: contact_span_t, covers, choose_spans, sort_contact_spans, closed_share, point_share, initial_share

   ! Lengths as shares of the length of the rod segment:
   real(wp), parameter :: closed_share = 1.0e-4_wp !! a shorter free span is closed
   real(wp), parameter :: point_share = 1.0e-5_wp  !! a shorter line contact inside the segment is a point contact. Beside the
   !! middle of a clamped column a line may begin and end with lengths of this order
   real(wp), parameter :: initial_share = 2.0_wp * closed_share !! initial length of a line contact, or of a contact that continues
   !! past a segment boundary; it exceeds the length below which a free span is closed

   !> One connected contact of one rod segment with one obstacle.
   type :: contact_span_t
      integer :: number = 0 !! identity number, constant from the start to the end of the contact; 0: not yet assigned
      integer :: contact = 0                !! index into model%contact
      integer :: rod_segment = 0            !! index into layout%rod_segment
      real(wp) :: at(2) = 0.0_wp !! coordinates of the two ends of the contact along the rod segment; equal for a point contact
      logical :: line = .false.
      ! Data that depend on the mesh:
      integer :: element(2) = 0 !! first and last conforming element; for a point contact: the element after and the element before
      !! the point (either may be 0: none)
      integer :: candidate(2) = 0 !! candidates at the two ends; at a segment boundary another contact span may have the same
      !! candidate
   end type contact_span_t

contains

   !> Decides which contacts are represented by contact spans (component `along`). The other contacts act at the deck's nodes, which
   !> are then fixed; they exclude contact spans of all contacts on the same elements. Component `needs` of such a contact names the
   !> condition that it does not satisfy; it is not set if the deck requests contact at nodes.
   subroutine choose_spans(model)
      type(model_t), intent(inout) :: model
      type(layout_t) :: layout
      logical :: taken(size(model%contact))
      integer :: k
      do while (any(model%contact%along))
         layout = new_layout(model)
         taken = .false.
         do k = 1, size(taken)
            if (model%contact(k)%along) call judge(model%contact(k), taken(k))
         end do
         if (all(taken .eqv. model%contact%along)) exit
         model%contact%along = taken
      end do

   contains

      subroutine judge(contact, takes)
         type(contact_t), intent(inout) :: contact
         logical, intent(out) :: takes
         character(:), allocatable :: needs
         takes = .false.
         if (acts_at_nodes(model, layout, k)) return
         needs = span_needs(model, layout, k)
         takes = needs == ''
         if (.not. takes) contact%needs = needs
      end subroutine judge
   end subroutine choose_spans

   !> (rod segments) true: the contact covers the rod segment.
   pure function covers(model, layout, contact)
      type(model_t), intent(in) :: model    !! model of the deck
      type(layout_t), intent(in) :: layout
      integer, intent(in) :: contact        !! index into model%contact
      logical :: covers(size(layout%rod_segment)), member(model%mesh%n_nodes)
      integer :: k
      member = .false.
      member(model%contact(contact)%node) = .true.
      ! A contact begins and ends at segment boundaries only: one element of a segment shows whether the contact covers the segment.
      do k = 1, size(covers)
         covers(k) = all(member(model%mesh%node(:, layout%rod_segment(k)%element(1))))
      end do
   end function covers

   !> True if the deck's obstacle, steps or nodes require contact at nodes instead of contact spans.
   pure logical function acts_at_nodes(model, layout, contact) result(at_nodes)
      type(model_t), intent(in) :: model    !! model of the deck
      type(layout_t), intent(in) :: layout
      integer, intent(in) :: contact
      integer :: k
      associate (obstacle => model%obstacle(model%contact(contact)%obstacle))
         at_nodes = .not. obstacle%rigid .or. obstacle%bilateral .or. obstacle%at_nodes .or. obstacle%ground /= ground_independent &
            & .or. .not. any(covers(model, layout, contact))
      end associate
      do k = 1, size(model%step)
         at_nodes = at_nodes .or. model%step(k)%paper_loop
      end do
   end function acts_at_nodes

   !> Condition for contact spans that a contact with a rigid obstacle does not satisfy, in words; '' if the contact satisfies all
   !> conditions. The conditions are: rods without shear flexibility; nodes that the program may place; and no other contact on the
   !> same elements that line contacts do not support.
   pure function span_needs(model, layout, contact) result(needs)
      type(model_t), intent(in) :: model    !! model of the deck
      type(layout_t), intent(in) :: layout
      integer, intent(in) :: contact
      character(:), allocatable :: needs
      logical :: member(model%mesh%n_nodes), touched(model%mesh%n_nodes)
      integer :: i, k, e, other
      needs = ''
      associate (mesh => model%mesh, nodes => model%contact(contact)%node)
         member = .false.
         member(nodes) = .true.
         do k = 1, size(model%tie)
            if (.not. member(model%tie(k)%node)) cycle
            needs = 'nodes that do not follow others; a joint ties node '//to_text(mesh%node_label(model%tie(k)%node))
            return
         end do
         touched = .false.
         do k = 1, size(layout%rod_segment)
            e = layout%rod_segment(k)%element(1)
            if (.not. all(member(mesh%node(:, e)))) cycle
            if (.not. conforms(mesh%family(e)) .or. mesh%curve(e) == 0) then
               needs = 'GE elements on a generated curve (*LINE, *ARC ...); element '//to_text(mesh%element_label(e))//' is not'
            else if (mesh%stages(e) == 1) then
               needs = 'elements of order 4 or higher; element '//to_text(mesh%element_label(e))//' is GE2'
            else if (.not. model%section(mesh%section(e))%shear_rigid) then
               needs = 'rods without shear flexibility; by its *BEAM SECTION element '//to_text(mesh%element_label(e))//' has it'
            else if (varies(model%section(mesh%section(e)))) then
               needs = 'sections that do not vary; by its *BEAM SECTION that of element '//to_text(mesh%element_label(e))//' does'
            else if (any([(any(abs(model%step(i)%load%gradient(:, e)) > 0.0_wp), i=1, size(model%step))])) then
               needs = 'rods without the pressure of a *LIQUID; it acts on element '//to_text(mesh%element_label(e))
            else
               other = other_contact(e)
               if (other > 0) needs = 'an obstacle alone on its rod, or one that no node carries beside soil that pulls and '// &
                  & 'presses (*AXIAL SOIL, BILATERAL); *CONTACT with '// &
                  & trim(model%obstacle(model%contact(other)%obstacle)%name)//' acts on element '// &
                  & to_text(mesh%element_label(e))//', too, and not as contact along the rod'
            end if
            if (needs /= '') return
            touched(mesh%node(1, layout%rod_segment(k)%element)) = .true.
            touched(mesh%node(2, layout%rod_segment(k)%element)) = .true.
         end do
         k = findloc(touched(nodes), .false., 1)
         if (k > 0) needs = 'nodes with elements between them; node '//to_text(mesh%node_label(nodes(k)))//' is alone'
      end associate

   contains

      !> Another contact on an element that excludes contact spans there; 0: no such contact. (Contact at nodes needs the deck's
      !> nodes. A foundation with tension does not exclude contact spans, because it acts on free rods and in line contacts alike.)
      pure integer function other_contact(e) result(other)
         integer, intent(in) :: e
         do other = 1, size(model%contact)
            associate (its => model%contact(other))
               if (other == contact .or. its%along .or. model%obstacle(its%obstacle)%at_nodes) cycle
               if (its%distributed .and. model%obstacle(its%obstacle)%bilateral .and. &
                  & model%obstacle(model%contact(contact)%obstacle)%carrier == 0) cycle
               if (any(its%node == model%mesh%node(1, e)) .and. any(its%node == model%mesh%node(2, e))) return
            end associate
         end do
         other = 0
      end function other_contact
   end function span_needs

   !> Sorts contact spans along the rod segments.
   pure subroutine sort_contact_spans(contact_span)
      type(contact_span_t), intent(inout) :: contact_span(:)
      contact_span = contact_span(ascending(contact_span%at(1)))
      contact_span = contact_span(ascending(real(contact_span%rod_segment, wp)))
   end subroutine sort_contact_spans
end module contact_spans

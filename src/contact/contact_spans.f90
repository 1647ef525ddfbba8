!> Where rods touch rigid obstacles: points, and lines between two touchdown points. Together they are the contact set, along
!> the rods instead of at nodes.
module contact_spans
   use kinds, only: wp
   use text, only: to_text
   use model, only: model_t, contact_t
   use obstacle_types, only: ground_independent
   use element_families, only: conforms
   use rod_layout, only: layout_t, new_layout
   implicit none
   private
   public :: contact_span_t, covers, choose_spans, sort_contact_spans, shortest, line_share, first_length

   real(wp), parameter :: shortest = 1.0e-4_wp !! of a stretch: spans as short as that are taken for none
   !> Of its stretch, that a line begins with, or a touch goes on beside a breakpoint: not so short that it is taken for none.
   real(wp), parameter :: line_share = 2.0_wp * shortest
   real(wp), parameter :: first_length = 20.0_wp * line_share !! of its stretch, that a free span begins with that opens

   !> One connected contact of one stretch of a rod with one obstacle.
   type :: contact_span_t
      integer :: number = 0                 !! its identity, from birth to death
      integer :: contact = 0                !! index into model%contact
      integer :: stretch = 0                !! of the layout
      real(wp) :: at(2) = 0.0_wp            !! coordinates of its ends along the stretch; a point: equal
      logical :: line = .false.
      ! On a mesh:
      integer :: element(2) = 0             !! the first and the last that lie on the obstacle; of a point the one after it and the
      !! one before, though there may be none
      integer :: candidate(2) = 0           !! of the nodes at its ends; a breakpoint's may be shared with another touch
   end type contact_span_t

contains

   !> Leaves contact spans to those contacts that can have them; the others act at the deck's nodes, which stay, and where they
   !> do there is no place for spans of another one. What those lack is noted in `needs`, unless the deck has asked for nodes.
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
         if (stands_at_nodes(model, layout, k)) return
         needs = span_needs(model, layout, k)
         takes = needs == ''
         if (.not. takes) contact%needs = needs
      end subroutine judge
   end subroutine choose_spans

   !> Which stretches a contact covers.
   pure function covers(model, layout, contact)
      type(model_t), intent(in) :: model    !! the deck's
      type(layout_t), intent(in) :: layout
      integer, intent(in) :: contact        !! index into model%contact
      logical :: covers(size(layout%stretch))
      logical :: member(model%mesh%n_nodes)
      integer :: k
      member = .false.
      member(model%contact(contact)%node) = .true.
      ! Coverage changes at breakpoints only: one element stands for all.
      do k = 1, size(covers)
         covers(k) = all(member(model%mesh%node(:, layout%stretch(k)%element(1))))
      end do
   end function covers

   !> True for a contact that is one of nodes by what the deck says of its obstacle, its steps or its nodes.
   pure logical function stands_at_nodes(model, layout, contact) result(stands)
      type(model_t), intent(in) :: model    !! the deck's
      type(layout_t), intent(in) :: layout
      integer, intent(in) :: contact
      integer :: k
      associate (obstacle => model%obstacle(model%contact(contact)%obstacle))
         stands = .not. obstacle%rigid .or. obstacle%bilateral .or. obstacle%at_nodes .or. obstacle%ground /= ground_independent &
            & .or. .not. any(covers(model, layout, contact))
      end associate
      do k = 1, size(model%step)
         stands = stands .or. model%step(k)%paper_loop
      end do
   end function stands_at_nodes

   !> What a contact with a rigid obstacle lacks for points and lines anywhere along the rod: rods without shear whose nodes may
   !> stand anywhere, and that no other contact acts on as a line contact does not take into account. '' when it lacks nothing.
   pure function span_needs(model, layout, contact) result(needs)
      type(model_t), intent(in) :: model    !! the deck's
      type(layout_t), intent(in) :: layout
      integer, intent(in) :: contact
      character(:), allocatable :: needs
      logical :: member(model%mesh%n_nodes), touched(model%mesh%n_nodes)
      integer :: k, e, other
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
         do k = 1, size(layout%stretch)
            e = layout%stretch(k)%element(1)
            if (.not. all(member(mesh%node(:, e)))) cycle
            if (.not. conforms(mesh%family(e)) .or. mesh%curve(e) == 0) then
               needs = 'GE elements on a *LINE, *ARC or *RING; element '//to_text(mesh%element_label(e))//' is not'
            else if (mesh%stages(e) == 1) then
               needs = 'elements of order 4 or higher; element '//to_text(mesh%element_label(e))//' is GE2'
            else if (.not. model%section(mesh%section(e))%shear_rigid) then
               needs = 'rods without shear flexibility; by its *BEAM SECTION element '//to_text(mesh%element_label(e))//' has it'
            else
               other = other_contact(e)
               if (other > 0) needs = 'an obstacle alone on its rod; *CONTACT with '// &
                  & trim(model%obstacle(model%contact(other)%obstacle)%name)//' acts on element '// &
                  & to_text(mesh%element_label(e))//', too, and not as contact along the rod'
            end if
            if (needs /= '') return
            touched(mesh%node(1, layout%stretch(k)%element)) = .true.
            touched(mesh%node(2, layout%stretch(k)%element)) = .true.
         end do
         k = findloc(touched(nodes), .false., 1)
         if (k > 0) needs = 'nodes with elements between them; node '//to_text(mesh%node_label(nodes(k)))//' is alone'
      end associate

   contains

      !> A contact of an element that has no contact spans, 0: none. The equations of an element on an obstacle have no foundation,
      !> and contact at nodes needs these where the deck has them.
      pure integer function other_contact(e) result(other)
         integer, intent(in) :: e
         do other = 1, size(model%contact)
            associate (its => model%contact(other))
               if (other == contact .or. its%along .or. model%obstacle(its%obstacle)%at_nodes) cycle
               if (any(its%node == model%mesh%node(1, e)) .and. any(its%node == model%mesh%node(2, e))) return
            end associate
         end do
         other = 0
      end function other_contact
   end function span_needs

   !> Orders touches along the stretches.
   pure subroutine sort_contact_spans(touch)
      type(contact_span_t), intent(inout) :: touch(:)
      type(contact_span_t) :: next
      integer :: i, j
      do i = 2, size(touch)
         next = touch(i)
         j = i
         do while (j > 1)
            if (touch(j - 1)%stretch < next%stretch) exit
            if (touch(j - 1)%stretch == next%stretch .and. touch(j - 1)%at(1) <= next%at(1)) exit
            touch(j) = touch(j - 1)
            j = j - 1
         end do
         touch(j) = next
      end do
   end subroutine sort_contact_spans
end module contact_spans

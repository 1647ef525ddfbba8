!> Where rods touch rigid obstacles: points, and lines between two touchdown points. Together they are the contact set, along
!> the rods instead of at nodes.
module contact_touch
   use kinds, only: wp
   use model, only: model_t, ground_independent
   use element_families, only: conforms
   use rod_layout, only: layout_t, new_layout
   implicit none
   private
   public :: touch_t, covers, choose_spans, sort_touches, shortest, line_share, first_length

   real(wp), parameter :: shortest = 1.0e-4_wp !! of a stretch: spans as short as that are taken for none
   !> Of its stretch, that a line begins with, or a touch goes on beside a breakpoint: not so short that it is taken for none.
   real(wp), parameter :: line_share = 2.0_wp * shortest
   real(wp), parameter :: first_length = 20.0_wp * line_share !! of its stretch, that a free span begins with that opens

   !> One connected contact of one stretch of a rod with one obstacle.
   type :: touch_t
      integer :: number = 0                 !! its identity, from birth to death
      integer :: contact = 0                !! index into model%contact
      integer :: stretch = 0                !! of the layout
      real(wp) :: at(2) = 0.0_wp            !! coordinates of its ends along the stretch; a point: equal
      logical :: line = .false.
      ! On a mesh:
      integer :: element(2) = 0             !! the first and the last that lie on the obstacle; of a point the one after it and the
      !! one before, though there may be none
      integer :: candidate(2) = 0           !! of the nodes at its ends; a breakpoint's may be shared with another touch
   end type touch_t

contains

   !> Leaves contact spans to those contacts that can have them; the others act at the deck's nodes, which stay, and where they
   !> do there is no place for spans of another one.
   subroutine choose_spans(model)
      type(model_t), intent(inout) :: model
      type(layout_t) :: layout
      logical :: takes(size(model%contact))
      integer :: k
      do while (any(model%contact%along))
         layout = new_layout(model)
         takes = [(takes_spans(model, layout, k), k=1, size(takes))]
         if (all(takes .eqv. model%contact%along)) exit
         model%contact%along = takes
      end do
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

   !> True for a contact that spans describe: with a rigid obstacle that only pushes, along rods without shear whose nodes may
   !> stand anywhere, where contact points may move.
   pure logical function takes_spans(model, layout, contact) result(takes)
      type(model_t), intent(in) :: model    !! the deck's
      type(layout_t), intent(in) :: layout
      integer, intent(in) :: contact
      logical :: member(model%mesh%n_nodes), covered(model%mesh%n_nodes)
      integer :: k, e
      associate (touched => model%contact(contact), obstacle => model%obstacle(model%contact(contact)%obstacle), mesh => model%mesh)
         takes = touched%along .and. obstacle%rigid .and. .not. (obstacle%bilateral .or. obstacle%at_nodes) .and. &
            & obstacle%ground == ground_independent
         do k = 1, size(model%step)
            takes = takes .and. .not. model%step(k)%paper_loop
         end do
         if (.not. takes) return
         member = .false.
         member(touched%node) = .true.
         covered = .false.
         do k = 1, size(layout%stretch)
            e = layout%stretch(k)%element(1)
            if (.not. all(member(mesh%node(:, e)))) cycle
            takes = takes .and. layout%stretch(k)%free .and. conforms(mesh%family(e)) .and. &
               & model%section(mesh%section(e))%shear_rigid .and. .not. founded(e)
            covered(mesh%node(1, layout%stretch(k)%element)) = .true.
            covered(mesh%node(2, layout%stretch(k)%element)) = .true.
         end do
         ! Nodes on their own are candidates on their own.
         takes = takes .and. all(covered(touched%node))
      end associate

   contains

      !> True for an element that a foundation acts on, too: what lies on an obstacle's track knows of no other forces.
      pure logical function founded(e)
         integer, intent(in) :: e
         integer :: c
         founded = .false.
         do c = 1, size(model%contact)
            if (.not. model%contact(c)%distributed) cycle
            founded = founded .or. all([any(model%contact(c)%node == model%mesh%node(1, e)), &
               & any(model%contact(c)%node == model%mesh%node(2, e))])
         end do
      end function founded
   end function takes_spans

   !> Orders touches along the stretches.
   pure subroutine sort_touches(touch)
      type(touch_t), intent(inout) :: touch(:)
      type(touch_t) :: next
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
   end subroutine sort_touches
end module contact_touch

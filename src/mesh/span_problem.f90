!> Problem on a mesh that follows the contact. The mesh has a few elements for each span between segment boundaries and touchdown
!> points, and one contact candidate for each node in contact.
module span_problem
   use kinds, only: wp
   use problem, only: problem_t, remeshed_problem, mesh_sampled, mesh_of_marks, mesh_of_spans
   use rod_state, only: state_t
   use mesh_density, only: position_rounding
   use remeshed_model, only: division_t
   use contact_spans, only: contact_span_t, covers, sort_contact_spans
   use span_candidates, only: add_span_candidates
   use span_division, only: span_nodes, sampled_division
   use ground_mark, only: cut_t
   use ground_cuts, only: add_marks
   use rolling_rods, only: find_rolling, free_clamps
   implicit none
   private
   public :: new_span_problem, same_spans, new_sampled_problem, place_spans

contains

   !> Problem with a given set of contact spans; loads, step and history are copied from `base`.
   function new_span_problem(base, touches, state, cuts) result(problem)
      type(problem_t), intent(in) :: base            !! problem of the same deck, on any mesh
      type(contact_span_t), intent(in) :: touches(:) !! the given contact spans
      type(state_t), intent(in), optional :: state !! state of `base`; if given, no span that continues gets fewer elements than in
      !! `base`
      type(cut_t), intent(in), optional :: cuts(:)   !! interface points of the foundations' laws, sorted along the rods
      type(problem_t) :: problem
      type(contact_span_t) :: contact_span(size(touches))
      type(division_t) :: division(size(base%layout%rod_segment))
      type(cut_t), allocatable :: cut(:)
      integer :: k
      allocate (cut(0))
      if (present(cuts)) cut = cuts
      contact_span = touches
      do k = 1, size(contact_span)
         associate (length => base%layout%rod_segment(contact_span(k)%rod_segment)%length)
            where (contact_span(k)%at <= position_rounding * length) contact_span(k)%at = 0.0_wp
            where (contact_span(k)%at >= (1.0_wp - position_rounding) * length) contact_span(k)%at = length
         end associate
      end do
      call sort_contact_spans(contact_span)
      do k = 1, size(division)
         division(k)%at = span_nodes(base, contact_span, cut, k, state)
      end do
      call lay_spans(base, contact_span, cut, division, problem)
   end function new_span_problem

   !> Problem with the contact spans and the mesh of another problem, `like`. The decks of `base` and `like` may differ in numerical
   !> values only, so that the rod segments are the same.
   function same_spans(base, like) result(problem)
      type(problem_t), intent(in) :: base            !! problem on any mesh
      type(problem_t), intent(in) :: like            !! problem with contact spans
      type(problem_t) :: problem
      type(contact_span_t) :: contact_span(size(like%contact_span))
      type(division_t) :: division(size(like%layout%rod_segment))
      type(cut_t) :: cut(size(like%mark))
      integer :: k, i
      do k = 1, size(division)
         associate (first => like%element_first(k), last => like%element_last(k))
            division(k)%at = [0.0_wp, like%model%mesh%s(2, first:last) + like%origin(first:last)]
            division(k)%at(last - first + 2) = like%layout%rod_segment(k)%length
         end associate
      end do
      do k = 1, size(cut)
         associate (c => like%mark(k)%candidate(2), chain => like%ground%chain)
            associate (e => chain%element(2, c))
               cut(k) = cut_t(rod_segment=like%rod_segment(e), contact=chain%contact(c), at=like%model%mesh%s(1, e) + &
                  & like%origin(e), &
                  & level=like%mark(k)%level, segment=like%mark(k)%segment)
            end associate
         end associate
      end do
      contact_span = like%contact_span
      do k = 1, size(contact_span)
         ! The end of the span is at a node, up to rounding.
         associate (at => division(contact_span(k)%rod_segment)%at)
            do i = 1, 2
               contact_span(k)%at(i) = at(minloc(abs(at - contact_span(k)%at(i)), 1))
            end do
         end associate
      end do
      call lay_spans(base, contact_span, cut, division, problem)
   end function same_spans

   !> Makes the problem with a given set of contact spans, on a mesh with nodes at their ends.
   subroutine lay_spans(base, contact_span, cut, division, problem)
      type(problem_t), intent(in) :: base
      type(contact_span_t), intent(in) :: contact_span(:)   !! contact spans, sorted along the rods
      type(cut_t), intent(in) :: cut(:)              !! interface points, sorted along the rods
      type(division_t), intent(in) :: division(:)    !! (rod segments) coordinates of the mesh nodes along the segment
      type(problem_t), intent(out) :: problem
      problem = remeshed_problem(base, division, spans=.true.)
      problem%contact_span = contact_span
      call add_span_candidates(problem, division)
      call add_marks(problem, cut, division)
      if (size(problem%mark) > 0) problem%mesh_kind = mesh_of_marks
      if (any(base%deck%contact%along)) problem%mesh_kind = mesh_of_spans
      call free_clamps(problem)
      call find_rolling(problem)
   end subroutine lay_spans

   !> Problem before any contact span is known. Its mesh is fine enough for the nodes to detect contact.
   function new_sampled_problem(base, contact_span) result(problem)
      type(problem_t), intent(in) :: base            !! problem on the deck's mesh
      type(contact_span_t), intent(in), optional :: contact_span(:) !! contact spans at whose ends the mesh must have nodes
      type(problem_t) :: problem
      problem = remeshed_problem(base, sampled_division(base, contact_span), spans=.false.)
      problem%mesh_kind = mesh_sampled
   end function new_sampled_problem

   !> Sets the parts of the rods on which contact spans are allowed, the coordinates of the rod segments along the chains, the
   !> lengths of closed chains, and the initial overlaps. All of them are taken from the deck's mesh.
   subroutine place_spans(deck, problem)
      type(problem_t), intent(in) :: deck            !! problem on the deck's mesh
      type(problem_t), intent(inout) :: problem      !! problem of the same deck, on any mesh
      logical, allocatable :: covered(:, :)
      integer :: k
      allocate (covered(size(deck%layout%rod_segment), size(deck%deck%contact)))
      do k = 1, size(deck%deck%contact)
         covered(:, k) = covers(deck%deck, deck%layout, k)
      end do
      problem%covered = covered
      problem%chain_start = chain_starts(deck)
      problem%chain_length = deck%candidates%chain_length
      problem%overlap = deck%overlap
   end subroutine place_spans

   !> Coordinate along the chain of each contact at which each rod segment begins; 0 if the contact does not cover the segment.
   function chain_starts(deck) result(start)
      type(problem_t), intent(in) :: deck            !! problem on the deck's mesh
      real(wp) :: start(size(deck%layout%rod_segment), size(deck%deck%contact)) !! (rod segments, contacts)
      integer :: i
      start = 0.0_wp
      do i = 1, deck%candidates%n
         if (deck%candidates%element(2, i) == 0) cycle
         associate (rod_segment => deck%rod_segment(deck%candidates%element(2, i)))
            if (deck%layout%rod_segment(rod_segment)%element(1) == deck%candidates%element(2, i)) &
               & start(rod_segment, deck%candidates%contact(i)) = deck%candidates%s(i)
         end associate
      end do
   end function chain_starts
end module span_problem

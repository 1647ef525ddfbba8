!> The problem on a mesh that goes with the contact: a few elements for every span, between breakpoints of the rods and
!> touchdown points, and one candidate for every node in contact.
module span_problem
   use kinds, only: wp
   use problem, only: problem_t, copy_problem, remeshed_problem, mesh_sampled, mesh_of_marks, mesh_of_spans
   use rod_state, only: state_t
   use remeshed_model, only: division_t
   use contact_spans, only: contact_span_t, covers, sort_contact_spans
   use span_candidates, only: add_touch_candidates
   use span_division, only: span_nodes, sampled_division
   use ground_mark, only: cut_t
   use ground_cuts, only: add_marks
   use neutral_spans, only: free_clamps
   use rolling_rods, only: find_rolling
   implicit none
   private
   public :: new_span_problem, same_spans, new_sampled_problem, place_spans

   real(wp), parameter :: at_breakpoint = 1.0e-9_wp !! of a stretch: as near as that is there

contains

   !> The problem with a set of touches; loads, step and all that goes before are those of `base`.
   function new_span_problem(base, touches, state, cuts) result(problem)
      type(problem_t), intent(in) :: base            !! of the same deck, on any mesh
      type(contact_span_t), intent(in) :: touches(:)
      type(state_t), intent(in), optional :: state   !! of `base`: no span that goes on gets fewer elements than it has
      type(cut_t), intent(in), optional :: cuts(:)   !! sorted: where the laws of foundations have their corners
      type(problem_t) :: problem
      type(contact_span_t) :: touch(size(touches))
      type(division_t) :: division(size(base%layout%stretch))
      type(cut_t), allocatable :: cut(:)
      integer :: k
      allocate (cut(0))
      if (present(cuts)) cut = cuts
      touch = touches
      do k = 1, size(touch)
         associate (length => base%layout%stretch(touch(k)%stretch)%length)
            where (touch(k)%at <= at_breakpoint * length) touch(k)%at = 0.0_wp
            where (touch(k)%at >= (1.0_wp - at_breakpoint) * length) touch(k)%at = length
         end associate
      end do
      call sort_contact_spans(touch)
      do k = 1, size(division)
         division(k)%at = span_nodes(base, touch, cut, k, state)
      end do
      call lay_spans(base, touch, cut, division, problem)
   end function new_span_problem

   !> The problem with the touches and on the mesh of another one that has the same stretches: what differs are values in the deck.
   function same_spans(base, like) result(problem)
      type(problem_t), intent(in) :: base            !! on any mesh
      type(problem_t), intent(in) :: like            !! with spans
      type(problem_t) :: problem
      type(contact_span_t) :: touch(size(like%touch))
      type(division_t) :: division(size(like%layout%stretch))
      type(cut_t) :: cut(size(like%mark))
      integer :: k, i
      do k = 1, size(division)
         associate (first => like%element_first(k), last => like%element_last(k))
            division(k)%at = [0.0_wp, like%model%mesh%s(2, first:last) + like%origin(first:last)]
            division(k)%at(last - first + 2) = like%layout%stretch(k)%length
         end associate
      end do
      do k = 1, size(cut)
         associate (c => like%mark(k)%candidate(2), chain => like%ground%chain)
            associate (e => chain%element(2, c))
               cut(k) = cut_t(stretch=like%stretch(e), contact=chain%contact(c), at=like%model%mesh%s(1, e) + like%origin(e), &
                  & level=like%mark(k)%level, segment=like%mark(k)%segment)
            end associate
         end associate
      end do
      touch = like%touch
      do k = 1, size(touch)
         ! The node that stands there, but for rounding.
         associate (at => division(touch(k)%stretch)%at)
            do i = 1, 2
               touch(k)%at(i) = at(minloc(abs(at - touch(k)%at(i)), 1))
            end do
         end associate
      end do
      call lay_spans(base, touch, cut, division, problem)
   end function same_spans

   !> The problem with a set of touches on a mesh that has nodes at their ends.
   subroutine lay_spans(base, touch, cut, division, problem)
      type(problem_t), intent(in) :: base
      type(contact_span_t), intent(in) :: touch(:)          !! sorted
      type(cut_t), intent(in) :: cut(:)              !! sorted
      type(division_t), intent(in) :: division(:)    !! (stretches)
      type(problem_t), intent(out) :: problem
      problem = remeshed_problem(with_spans(base, .true.), division)
      problem%touch = touch
      call add_touch_candidates(problem, division)
      call add_marks(problem, cut, division)
      if (size(problem%mark) > 0) problem%mesh_kind = mesh_of_marks
      if (any(base%deck%contact%along)) problem%mesh_kind = mesh_of_spans
      call free_clamps(problem)
      call find_rolling(problem)
   end subroutine lay_spans

   !> The problem before any contact span is known: a mesh fine enough to tell by its nodes what touches.
   function new_sampled_problem(base, touch) result(problem)
      type(problem_t), intent(in) :: base            !! of the deck
      type(contact_span_t), intent(in), optional :: touch(:) !! places at which a node stands, too
      type(problem_t) :: problem
      problem = remeshed_problem(with_spans(base, .false.), sampled_division(base, touch))
      problem%mesh_kind = mesh_sampled
   end function new_sampled_problem

   !> Where spans may be, and what they count from, as the deck has it.
   subroutine place_spans(deck, problem)
      type(problem_t), intent(in) :: deck            !! on the deck's mesh
      type(problem_t), intent(inout) :: problem      !! of the same deck, on any mesh
      logical, allocatable :: covered(:, :)
      integer :: k
      allocate (covered(size(deck%layout%stretch), size(deck%deck%contact)))
      do k = 1, size(deck%deck%contact)
         covered(:, k) = covers(deck%deck, deck%layout, k)
      end do
      problem%covered = covered
      problem%chain_start = chain_starts(deck)
      problem%overlap = deck%overlap
   end subroutine place_spans

   !> Coordinates of the beginnings of all stretches along the chains of the contacts, 0 where there is none.
   function chain_starts(deck) result(start)
      type(problem_t), intent(in) :: deck            !! on the deck's mesh
      real(wp) :: start(size(deck%layout%stretch), size(deck%deck%contact)) !! (stretches, contacts)
      integer :: i
      start = 0.0_wp
      do i = 1, deck%candidates%n
         if (deck%candidates%element(2, i) == 0) cycle
         associate (stretch => deck%stretch(deck%candidates%element(2, i)))
            if (deck%layout%stretch(stretch)%element(1) == deck%candidates%element(2, i)) &
               & start(stretch, deck%candidates%contact(i)) = deck%candidates%s(i)
         end associate
      end do
   end function chain_starts

   !> The problem whose deck has its contacts as spans, or at nodes.
   function with_spans(base, spans) result(problem)
      type(problem_t), intent(in) :: base
      logical, intent(in) :: spans
      type(problem_t) :: problem
      call copy_problem(base, problem)
      problem%deck%contact%spans = problem%deck%contact%along .and. spans
   end function with_spans
end module span_problem

!> Start of a path with contact spans. Without contact at the start the path begins without spans, except point contacts at supports
!> on an obstacle (prepare_spans). With contact at the start it begins on a mesh whose nodes detect contact, and the first increment
!> turns contact at nodes into contact spans (begin_spans).
module span_start
   use kinds, only: wp, parallel
   use problem, only: problem_t, touching_gap, copy_problem
   use rod_state, only: candidate_gap, may_react
   use contact_spans, only: contact_span_t
   use span_problem, only: new_span_problem, new_sampled_problem, place_spans
   use other_set, only: other_set_t, copy_other_set, go_to_load, on_next_mesh
   use test_kinds, only: span_test_t, test_force, test_slack, well_below
   use nodes_to_spans, only: find_spans_ahead, most_increments
   use set_onset, only: go_back
   use corrector, only: increment_t
   use path_point, only: path_point_t
   use path_state, only: path_state_t, copy_path_state
   use rod_layout, only: segment_element
   use rod_geometry, only: geometry_t, new_geometry
   use obstacle_geometry, only: obstacle_gap
   use initial_overlap, only: gap_inside
   use minimum_search, only: minimum_search_t, to_rounding
   implicit none
   private
   public :: prepare_spans, begin_spans

   real(wp), parameter :: small_part = 0.5_wp**(most_increments / 2) !! length of the first increment in a second attempt, as a
   !! share of the full increment; by doubling, the attempt reaches the full increment within half of the allowed increments with
   !! contact at nodes
   integer, parameter :: most_parts = 26 !! largest number of halvings of the first increment in search of the onset of contact:
   !! half of the binary digits. Contact that begins on a still shorter part of the increment counts as contact at the start

contains

   !> Makes the problem with which a path with contact spans starts. Without contact at the start this problem has no contact spans
   !> but points at supports on an obstacle; with contact at the start it has a mesh whose nodes detect contact. The problem is
   !> unchanged if no contact of the deck uses contact spans.
   subroutine prepare_spans(problem)
      type(problem_t), intent(inout) :: problem      !! in: on the deck's mesh; out: on the mesh of the start
      type(problem_t) :: on_deck
      type(contact_span_t), allocatable :: clamp(:), first(:)
      real(wp) :: normal(2)
      logical :: touches
      integer :: k, i
      if (.not. any(problem%deck%contact%along)) return
      call copy_problem(problem, on_deck)
      call place_spans(on_deck, problem)
      touches = .false.
      allocate (clamp(0))
      do k = 1, size(problem%deck%contact)
         associate (contact => problem%deck%contact(k))
            if (.not. contact%along) cycle
            do i = 1, size(contact%node)
               if (.not. touches_at_first(problem, k, i, normal)) cycle
               if (is_supported_end(problem, k, contact%node(i), normal)) then
                  clamp = [clamp, touch_at_end(problem, k, contact%node(i), size(clamp) + 1)]
               else
                  touches = .true.
               end if
            end do
         end associate
      end do
      first = find_initial_contacts(problem)
      do k = 1, size(first)
         touches = touches .or. (first(k)%at(1) > 0.0_wp .and. &
            & first(k)%at(1) < problem%layout%rod_segment(first(k)%rod_segment)%length)
      end do
      if (touches) then
         problem = new_sampled_problem(problem, first)
      else
         problem = new_span_problem(problem, clamp)
      end if
   end subroutine prepare_spans

   !> True if a node of a contact touches its obstacle at the start.
   logical function touches_at_first(problem, k, i, normal) result(touches)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: k, i                    !! index of the contact; index into the nodes of the contact
      real(wp), intent(out) :: normal(2)             !! unit normal of the obstacle at the node
      real(wp) :: gap, bend
      call first_gap(problem, k, i, gap, normal, bend)
      touches = gap <= touching_gap(problem)
   end function touches_at_first

   !> Computes the gap of a node of a contact at the start, with the normal and the curvature of the obstacle.
   subroutine first_gap(problem, k, i, gap, normal, bend)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: k, i                    !! index of the contact; index into the nodes of the contact
      real(wp), intent(out) :: gap
      real(wp), intent(out) :: normal(2), bend       !! unit normal and curvature of the obstacle at the node
      associate (contact => problem%deck%contact(k))
         call obstacle_gap(problem%deck%obstacle(contact%obstacle), problem%deck%mesh%x(:, contact%node(i)), gap, normal, bend)
         gap = gap + contact%gap + problem%overlap(k)
      end associate
   end subroutine first_gap

   !> True if a contact span began after the start: at the nearest local minimum of the gap the gap at the start was positive.
   logical function gains_contact(next) result(gains)
      type(other_set_t), intent(in) :: next
      integer :: k
      associate (problem => next%problem)
         gains = any([(carries(problem%contact_span(k)) .and. nearest_gap(problem, &
            & problem%contact_span(k)) > touching_gap(problem), &
            & k=1, size(problem%contact_span))])
      end associate

   contains

      !> True if a contact span carries force: it is a line contact, or a point contact whose force is not taken by a support.
      logical function carries(contact_span)
         type(contact_span_t), intent(in) :: contact_span
         real(wp) :: gap, normal(2), bend
         carries = contact_span%line
         if (carries) return
         call candidate_gap(next%problem, next%state, contact_span%candidate(1), gap, normal, bend)
         carries = may_react(next%problem, contact_span%candidate(1), normal)
      end function carries
   end function gains_contact

   !> True if a point contact of the set would pull just after the start: the contact touches at the start, but opens at once and
   !> closes again later.
   logical function pulls_at_start(start, next) result(pulls)
      real(wp), intent(in) :: start             !! load factor at the start
      type(other_set_t), intent(in) :: next
      type(other_set_t) :: early
      type(span_test_t), allocatable :: tests(:)
      call copy_other_set(next, early)
      call go_to_load(early, start + small_part * (next%state%load_factor - start), tests)
      pulls = allocated(tests)
      if (pulls) pulls = any(tests%kind == test_force .and. tests%value < -well_below * test_slack(test_force))
   end function pulls_at_start

   !> Gap that the rod had at the start at a local minimum of the gap near a contact span. The minimum is found by descent along the
   !> deck's nodes, from the span to the node with the least gap ("lowest" node). The result is 0 if the rod was in contact beside
   !> this node. Nodes whose supports carry the whole contact force are left out, unless there are no others.
   real(wp) function nearest_gap(problem, contact_span) result(gap)
      type(problem_t), intent(in) :: problem
      type(contact_span_t), intent(in) :: contact_span
      real(wp) :: first(size(problem%deck%contact(contact_span%contact)%node)), normal(2), bend
      integer :: row(problem%deck%mesh%n_nodes), i, e, here, next
      type(contact_span_t), allocatable :: inside(:)
      inside = find_initial_contacts(problem)
      row = 0
      associate (contact => problem%deck%contact(contact_span%contact), mesh => problem%deck%mesh, &
         & whole => problem%layout%rod_segment(contact_span%rod_segment))
         row(contact%node) = [(i, i=1, size(contact%node))]
         do i = 1, size(contact%node)
            call first_gap(problem, contact_span%contact, i, first(i), normal, bend)
            if (all(problem%deck%fixed(1:2, contact%node(i)) .or. abs(normal) <= parallel)) first(i) = huge(gap)
         end do
         e = whole%element(segment_element(whole, contact_span%at(1)))
         here = lower_end(e)
         do
            next = here
            do e = 1, mesh%n_elements
               if (.not. any(mesh%node(:, e) == contact%node(here))) cycle
               i = lower_end(e)
               if (first(i) < first(next)) next = i
            end do
            if (next == here) exit
            here = next
         end do
      end associate
      gap = merge(first(here), 0.0_wp, first(here) < huge(gap))
      if (any([(beside(inside(i)), i=1, size(inside))])) gap = 0.0_wp

   contains

      !> True if an initial contact lies in an element beside the lowest node, but not at a node: a place so close to a node that
      !> the gaps do not differ counts as the node.
      logical function beside(place)
         type(contact_span_t), intent(in) :: place
         associate (whole => problem%layout%rod_segment(place%rod_segment))
            e = whole%element(segment_element(whole, place%at(1)))
            beside = place%contact == contact_span%contact .and. &
               & minval(abs(whole%at - place%at(1))) > sqrt(touching_gap(problem) * problem%size)
         end associate
         beside = beside .and. any(problem%deck%mesh%node(:, e) == problem%deck%contact(contact_span%contact)%node(here))
      end function beside

      !> The node of an element that is nearer to the obstacle, as an index into the contact's nodes.
      integer function lower_end(e) result(lower)
         integer, intent(in) :: e                    !! element of the deck; at least one of its two nodes belongs to the contact
         integer :: ends(2)
         ends = row(problem%deck%mesh%node(:, e))
         lower = maxval(ends)
         if (all(ends > 0)) lower = ends(minloc(first(ends), dim=1))
      end function lower_end
   end function nearest_gap

   !> True if a node is the end of a rod, supported on the obstacle by a hinge or by a clamp parallel to the obstacle. Contact may
   !> spread from such an end, but carries no force yet.
   logical function is_supported_end(problem, contact, node, normal) result(held)
      type(problem_t), intent(in) :: problem         !! problem on the deck's mesh
      integer, intent(in) :: contact, node
      real(wp), intent(in) :: normal(2)              !! unit normal of the obstacle at the node
      type(geometry_t) :: home
      real(wp) :: angle
      integer :: e, side
      held = count(problem%beside(:, node) > 0) == 1 .and. all(problem%model%fixed(1:2, node) .or. abs(normal) <= parallel)
      if (.not. held) return
      side = merge(1, 2, problem%beside(2, node) > 0)
      e = problem%beside(3 - side, node)
      home = new_geometry(problem%model)
      angle = home%element(e)%end_angle(side)
      held = problem%covered(problem%rod_segment(e), contact) .and. (.not. problem%model%fixed(3, node) .or. &
         & abs(dot_product(normal, [cos(angle), sin(angle)])) <= parallel)
   end function is_supported_end

   !> Point contact at the supported end of a rod (see is_supported_end).
   type(contact_span_t) function touch_at_end(problem, contact, node, number) result(contact_span)
      type(problem_t), intent(in) :: problem         !! problem on the deck's mesh
      integer, intent(in) :: contact, node, number
      contact_span%contact = contact
      contact_span%number = number
      contact_span%rod_segment = problem%rod_segment(maxval(problem%beside(:, node)))
      if (problem%beside(1, node) > 0) contact_span%at = problem%layout%rod_segment(contact_span%rod_segment)%length
   end function touch_at_end

   !> Finds the first point of a path that starts in contact: the run changes from contact at nodes to contact spans.
   subroutine begin_spans(problem, run, trial, report)
      type(problem_t), intent(inout) :: problem !! in: on a mesh whose nodes detect contact; out: with contact spans, at the start
      !! of the path
      type(path_state_t), intent(inout) :: run          !! the run at the start of the path
      type(path_point_t), intent(out) :: trial
      type(increment_t), intent(out) :: report
      type(other_set_t) :: next
      type(path_state_t) :: on
      character(:), allocatable :: why
      real(wp) :: first
      logical :: found, small
      integer :: try
      small = .false.
      do try = 1, most_parts
         call copy_path_state(run, on)
         call find_spans_ahead(problem, run, on, next, first, found, report, why)
         if (.not. found) then
            ! Increments with contact at nodes have gone beyond the end of the first increment without success: the first increment
            ! may have been too long, and a shorter one is tried.
            if (small .or. .not. allocated(why)) exit
            small = .true.
            run%control%increment = small_part * run%control%increment
            cycle
         end if
         if (abs(next%state%load_factor - first) > 0.0_wp) call go_back(first, next)
         if (.not. (gains_contact(next) .or. pulls_at_start(run%last%state%load_factor, next))) exit
         ! A contact that begins after the start must be located from a point before its onset.
         run%control%increment = 0.5_wp * run%control%increment
      end do
      if (try <= most_parts) run%control%increment = on%control%increment
      if (.not. found) then
         report%converged = .false.
         if (.not. allocated(why)) return
         report%message = 'contact at nodes did not turn into points and lines along the rod: '//why
         report%hopeless = .true.
         return
      end if
      next%problem%contact_span%number = run%spans_begun + next%problem%contact_span%number
      run = on_next_mesh(problem, run, next)
      call copy_problem(next%problem, problem)
      trial = next%path_point_t
   end subroutine begin_spans

   !> Point contacts at all isolated places where the gap has a minimum of zero. A rod that lies along its obstacle has no isolated
   !> places.
   function find_initial_contacts(problem) result(contact_span)
      type(problem_t), intent(in) :: problem         !! problem on the deck's mesh
      type(contact_span_t), allocatable :: contact_span(:)
      real(wp), allocatable :: at(:), gap(:)
      logical, allocatable :: touches(:)              ! (samples) true: the gap is zero there; with one additional entry at each end
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

   !> Samples the gap along a rod segment: at the deck's nodes, and at the minimum inside an element if there is one. The gap is
   !> assumed to have at most one minimum in an element.
   subroutine sample_gap(problem, contact, rod_segment, at, gap)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: contact, rod_segment
      real(wp), allocatable, intent(out) :: at(:)    !! coordinates of the samples along the rod segment, increasing
      real(wp), allocatable, intent(out) :: gap(:)
      real(wp) :: place, last
      integer :: k, n
      associate (whole => problem%layout%rod_segment(rod_segment))
         allocate (at(2 * size(whole%element) + 1), gap(2 * size(whole%element) + 1))
         n = 0
         call keep(whole%at(1), gap_at_start(problem, contact, whole%element(1), 0.0_wp))
         do k = 1, size(whole%element)
            associate (e => whole%element(k))
               last = gap_at_start(problem, contact, e, 1.0_wp)
               ! The gap has a minimum inside the element if it decreases from both ends inwards by more than rounding.
               if (gap_at_start(problem, contact, e, to_rounding) < gap(n) .and. &
                  & gap_at_start(problem, contact, e, 1.0_wp - to_rounding) < last) then
                  place = least_inside(problem, contact, e)
                  call keep(whole%at(k) + place * (whole%at(k + 1) - whole%at(k)), gap_at_start(problem, contact, e, place))
               end if
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

   !> Place in an element where the gap is least, 0 (first node) to 1 (second node).
   real(wp) function least_inside(problem, contact, e) result(place)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: contact, e
      type(minimum_search_t) :: search
      call search%begin(0.0_wp, 1.0_wp, to_rounding)
      do while (search%next_guess(place))
         call search%take_value(gap_at_start(problem, contact, e, place))
      end do
   end function least_inside

   !> Gap at the start at a place tau (0 to 1) in an element of the deck.
   real(wp) function gap_at_start(problem, contact, e, tau) result(gap)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: contact, e
      real(wp), intent(in) :: tau
      gap = gap_inside(problem%deck, problem%deck%contact(contact), e, tau) + problem%overlap(contact)
   end function gap_at_start
end module span_start

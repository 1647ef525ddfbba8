!> Interface points of foundations, at which contact ends or a law has a corner: their positions along the rod segments (cut_t),
!> independent of a mesh, and the interface points of a mesh with nodes at these positions (mark_t).
module ground_cuts
   use kinds, only: wp
   use problem, only: problem_t, same_place
   use rod_state, only: state_t
   use ground_mark, only: cut_t, mark_t
   use ground_segments, only: has_kinks, element_cuts, gap_rounding, crosses_at, segment_at, decay_length
   use ground_following, only: is_live
   use remeshed_model, only: division_t
   use mesh_density, only: mesh_density_t, between, equal_shares
   use force_law, only: segment_unknown
   use contact_spans, only: closed_share
   use ordering, only: ascending
   implicit none
   private
   public :: find_cuts, inner_cuts, marked, add_marks, graded

   real(wp), parameter :: shortest = 1.0e-6_wp !! least distance between interface points, over the structure's size; of two closer
   !! points a mesh has a node at neither
   !> Least distance between two interface points with the same gap, or between an interface point and a segment boundary, over the
   !> length of a boundary layer beside the point. The second value is for foundations along a rod. Shorter spans open and close
   !> with the square root of the load, or continue beyond the boundary, where an interface point cannot move. Without interface
   !> points the elements determine such contact themselves; the relative error of the force is the third power of this number. The
   !> error bars do not contain the kink of a foundation along a rod without interface point (element_errors); its error must
   !> therefore be smaller.
   real(wp), parameter :: shortest_of_layer = 0.1_wp, shortest_along = 0.01_wp

contains

   !> Interface points of a converged state, in order along each rod segment.
   function find_cuts(problem, state) result(cut)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(cut_t), allocatable :: cut(:)
      real(wp), allocatable :: tau(:), level(:)
      real(wp) :: rounding
      integer :: c, e, m, j, n
      allocate (cut(0))
      rounding = gap_rounding(state)
      do m = 1, size(problem%mark)
         if (.not. is_live(problem, state, m)) then
            ! The elements beside the point determine contact from the gap. The point is dropped if the gap there does not pass the
            ! value of the point's corner.
            if (.not. crosses_at(problem, state, m)) cycle
         end if
         c = problem%mark(m)%candidate(2)
         e = problem%ground%chain%element(2, c)
         call add(c, e, state%geometry%element(e)%s(1), problem%mark(m)%level)
      end do
      do c = 1, problem%ground%chain%n
         if (state%segment(c) /= segment_unknown .or. .not. has_kinks(problem, c)) cycle
         e = problem%ground%chain%element(2, c)
         if (.not. problem%layout%rod_segment(problem%rod_segment(e))%free) cycle
         call element_cuts(problem, state, c, rounding, n, tau, level)
         associate (s => state%geometry%element(e)%s)
            do j = 1, n
               call add(c, e, s(1) + tau(j) * (s(2) - s(1)), level(j))
            end do
         end associate
      end do
      cut = cut(ascending(cut%at))
      cut = cut(ascending(real(cut%rod_segment, wp)))
      call add_layers(problem, state, cut)
      call thin(problem, state, cut)
      call add_layers(problem, state, cut)

   contains

      !> Adds an interface point at nominal coordinate s of an element.
      subroutine add(candidate, e, s, at_level)
         integer, intent(in) :: candidate, e
         real(wp), intent(in) :: s, at_level
         cut = [cut, cut_t(rod_segment=problem%rod_segment(e), contact=problem%ground%chain%contact(candidate), &
            & at=s + problem%origin(e), level=at_level)]
      end subroutine add
   end function find_cuts

   !> True if the mesh has an interface point at each of the given positions and no others.
   logical function marked(problem, state, cut)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(cut_t), intent(in) :: cut(:)              !! interface points of the state
      integer :: m
      marked = inner_cuts(cut) == size(problem%mark)
      do m = 1, size(problem%mark)
         marked = marked .and. is_live(problem, state, m)
      end do
   end function marked

   !> Number of positions at which a mesh can have an interface point that moves.
   pure integer function inner_cuts(cut)
      type(cut_t), intent(in) :: cut(:)
      inner_cuts = count(.not. cut%at_end)
   end function inner_cuts

   !> Removes pairs of interface points that are too close for an element between them, points too close to a touchdown point, and
   !> points caused by oscillations of polynomials (with the same segment of the law on both sides). Points next to a segment
   !> boundary are moved onto the boundary.
   subroutine thin(problem, state, cut)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(cut_t), allocatable, intent(inout) :: cut(:)
      logical, allocatable :: kept(:)
      real(wp) :: part, beside, apart
      integer :: i
      cut = pack(cut, cut%segment(1) /= cut%segment(2))
      allocate (kept(size(cut)), source=.true.)
      do i = 1, size(cut)
         associate (length => problem%layout%rod_segment(cut(i)%rod_segment)%length)
            part = merge(shortest_along, shortest_of_layer, &
               & problem%deck%obstacle(problem%deck%contact(cut(i)%contact)%obstacle)%along_rod)
            beside = max(shortest * problem%size, part * maxval(cut(i)%layer))
            cut(i)%at_end = min(cut(i)%at, length - cut(i)%at) <= beside
            if (cut(i)%at_end) cut(i)%at = merge(0.0_wp, length, cut(i)%at < 0.5_wp * length)
            if (beside_touchdown(cut(i))) kept(i) = .false.
            if (i == 1) cycle
            if (cut(i - 1)%rod_segment /= cut(i)%rod_segment) cycle
            apart = shortest * problem%size
            if (cut(i - 1)%contact == cut(i)%contact .and. .not. abs(cut(i - 1)%level - cut(i)%level) > 0.0_wp) &
               & apart = max(apart, part * max(maxval(cut(i - 1)%layer), maxval(cut(i)%layer)))
            if (cut(i)%at - cut(i - 1)%at <= apart) kept(i - 1:i) = .false.
         end associate
      end do
      cut = pack(cut, kept)

   contains

      !> True if the span between a touchdown point and an interface point counts as closed.
      pure logical function beside_touchdown(point) result(beside)
         type(cut_t), intent(in) :: point
         integer :: c
         beside = .false.
         do c = 1, problem%candidates%n
            if (.not. problem%candidates%moves(c)) cycle
            associate (e => problem%candidates%element(2, c))
               if (problem%rod_segment(e) == point%rod_segment) beside = beside .or. abs(state%geometry%element(e)%s(1) + &
                  & problem%origin(e) - point%at) <= closed_share * problem%layout%rod_segment(point%rod_segment)%length
            end associate
         end do
      end function beside_touchdown
   end subroutine thin

   !> Computes the boundary layer lengths, over which foundations bend the rod, on both sides of each interface point. On
   !> each side the force law has the slope that it has at the middle between this interface point and the next one along the rod.
   subroutine add_layers(problem, state, cut)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(cut_t), intent(inout) :: cut(:)
      real(wp) :: ends(2), stiffness
      integer :: i, j, side
      do i = 1, size(cut)
         ends = [0.0_wp, problem%layout%rod_segment(cut(i)%rod_segment)%length]
         do j = 1, size(cut)
            if (cut(j)%rod_segment /= cut(i)%rod_segment .or. cut(j)%contact /= cut(i)%contact) cycle
            if (cut(j)%at < cut(i)%at) ends(1) = max(ends(1), cut(j)%at)
            if (cut(j)%at > cut(i)%at) ends(2) = min(ends(2), cut(j)%at)
         end do
         do side = 1, 2
            call segment_at(problem, state, cut(i)%rod_segment, cut(i)%contact, 0.5_wp * (cut(i)%at + ends(side)), &
               & cut(i)%segment(side), stiffness)
            cut(i)%layer(side) = 0.0_wp
            associate (first => problem%layout%rod_segment(cut(i)%rod_segment)%element(1), deck => problem%deck)
               if (stiffness > 0.0_wp) cut(i)%layer(side) = decay_length(deck%section(deck%mesh%section(first)), &
                  & deck%obstacle(deck%contact(cut(i)%contact)%obstacle), stiffness)
            end associate
         end do
      end do
   end subroutine add_layers

   !> Adds interface points to the problem of a mesh that has nodes at their positions.
   subroutine add_marks(problem, cut, division)
      type(problem_t), intent(inout) :: problem
      type(cut_t), intent(in) :: cut(:)
      type(division_t), intent(in) :: division(:)    !! (rod segments) coordinates of the mesh nodes
      type(mark_t) :: mark
      integer :: i, j, k, e, side
      deallocate (problem%mark)
      allocate (problem%mark(0))
      do i = 1, size(cut)
         if (cut(i)%at_end) cycle
         associate (at => division(cut(i)%rod_segment)%at, first => problem%element_first(cut(i)%rod_segment))
            j = minloc(abs(at - cut(i)%at), 1)
            if (j == 1 .or. j == size(at)) cycle
            if (.not. same_place(problem%size, at(j), cut(i)%at)) cycle
            mark%node = problem%model%mesh%node(1, first + j - 1)
            mark%level = cut(i)%level
            mark%segment = cut(i)%segment
            do side = 1, 2
               e = first + j - 3 + side
               mark%candidate(side) = 0
               do k = problem%ground%first(e), problem%ground%first(e + 1) - 1
                  if (problem%ground%chain%contact(problem%ground%candidate(k)) == cut(i)%contact) &
                     & mark%candidate(side) = problem%ground%candidate(k)
               end do
            end do
            if (all(mark%candidate > 0)) problem%mark = [problem%mark, mark]
         end associate
      end do
      problem%ground%tabled = size(problem%mark) == 0 .and. size(problem%contact_span) == 0
   end subroutine add_marks

   !> Coordinates of the nodes between two positions: n elements with equal integrals of a mesh density, shorter in boundary layers.
   !> In a layer of length l beside an end, displacements decrease as exp(-x / (sqrt(2) l)); the error of an element of s stages is
   !> this amplitude times the element's length to the power 2 s + 1. After a first element of length l, lengths of equal error grow
   !> as exp(x / ((2 s + 1) sqrt(2) l)).
   pure function graded(demand, from, to, n, layer, stages) result(at)
      type(mesh_density_t), intent(in) :: demand
      real(wp), intent(in) :: from, to !! nominal coordinates of the two positions
      integer, intent(in) :: n, stages !! number of elements; number of stages of an element
      real(wp), intent(in) :: layer(2)               !! length of the boundary layer at each position; 0: none
      real(wp), allocatable :: at(:)                 !! coordinates of the nodes, including the two positions
      real(wp), allocatable :: first(:), last(:), inner(:)
      real(wp) :: whole
      integer :: i, middle
      whole = between(demand, from, to)
      first = from + side(layer(1), 1.0_wp, from)
      last = to - side(layer(2), -1.0_wp, to)
      associate (a => first(size(first)), b => last(size(last)))
         middle = max(1, ceiling(n * between(demand, a, b) / whole - 0.01_wp), &
            & ceiling(wanted(layer(1), a - from, b - from) + wanted(layer(2), to - b, to - a) - 0.01_wp))
         inner = equal_shares(demand, a, b, middle)
      end associate
      at = [first, inner(2:middle), [(last(i), i=size(last), 1, -1)]]

   contains

      !> Distances of the layer's nodes from an end, beginning with 0, until the elements are as long as outside the layer, at most
      !> up to the middle.
      pure function side(l, sense, end) result(x)
         real(wp), intent(in) :: l, sense, end
         real(wp), allocatable :: x(:)
         real(wp) :: h, now
         x = [0.0_wp]
         if (.not. l > 0.0_wp) return
         now = 0.0_wp
         do
            h = l * exp(now / grown(l))
            if (now + 1.5_wp * h > 0.5_wp * (to - from)) exit
            if (n * between(demand, min(end + sense * now, end + sense * (now + h)), max(end + sense * now, &
               & end + sense * (now + h))) >= whole) exit
            now = now + h
            x = [x, now]
         end do
      end function side

      !> Number of elements with graded lengths between two distances from an end.
      pure real(wp) function wanted(l, near, far)
         real(wp), intent(in) :: l, near, far
         wanted = 0.0_wp
         if (l > 0.0_wp) wanted = grown(l) / l * (exp(-near / grown(l)) - exp(-far / grown(l)))
      end function wanted

      !> Distance from an end over which the graded lengths grow by the factor e = 2.718.
      pure real(wp) function grown(l)
         real(wp), intent(in) :: l
         grown = (2 * stages + 1) * sqrt(2.0_wp) * l
      end function grown
   end function graded
end module ground_cuts

!> Reads nodes, elements, generated curves and sets in the order of the deck; each card may refer to preceding definitions only.
module read_mesh
   use kinds, only: wp, name_length, degree
   use errors, only: error_t, fail
   use text, only: to_text, same_name
   use memory, only: can_be_had
   use model, only: model_t, curve_t, imperfection_t, empty_lists
   use element_families, only: element_kind
   use mesh_generators, only: growing_mesh_t, new_growing_mesh, new_element_t, line_curve, arc_curve, ring_curve, ellipse_curve, &
      & path_curve, graded_division
   use reference_curve, only: curve_point
   use read_obstacles, only: end_spline
   use checked_deck, only: checked_deck_t, labels_t
   use distribution, only: same_length
   implicit none
   private
   public :: read_mesh_cards

   integer, parameter :: output_elements = 64 !! number of elements for the output of a curve whose number of elements is omitted

   !> Approximate memory of a run for one element of a line: stored section forces, and several copies of the equations [bytes]:
   real(wp), parameter :: bytes_of_element = 3.5e3_wp
   !> Entries for each node of a chain in a band matrix factored with pivoting: three unknowns, coupled with those of neighbouring
   !> nodes.
   integer, parameter :: band_entries = 3 * (3 * 5 + 1)

   !> A corner of a *DISTRIBUTION: the lines generated for its ELSET get a node there.
   type :: corner_t
      character(name_length) :: set = ''       !! name of the element set
      real(wp) :: ahead = 0.0_wp               !! distance of the corner from the end of the lines that the set contains so far
   end type corner_t

   !> What the cards of the mesh have given so far.
   type :: mesh_reading_t
      type(growing_mesh_t) :: grown                     !! nodes, elements and curves
      type(new_element_t) :: pattern                    !! family and stages of the elements of the present card
      integer :: node_set = 0, element_set = 0 !! sets to which the present card adds nodes and elements; 0: none
      type(corner_t), allocatable :: corner(:)          !! corners of distributions
   end type mesh_reading_t

contains

   !> Reads all cards of the mesh. Sets mesh and curves of the model, and makes its other lists empty.
   subroutine read_mesh_cards(deck, model)
      type(checked_deck_t), intent(inout), target :: deck !! out: with nodes, elements and sets
      type(model_t), intent(inout) :: model             !! out: with mesh (without sections) and curve
      type(mesh_reading_t) :: reading
      integer :: e
      reading%grown = new_growing_mesh()
      allocate (deck%names%curve_line(0), reading%corner(0))
      do while (deck%next_card('DISTRIBUTION'))
         if (deck%given('FORMULA')) cycle
         do while (deck%next_line())
            reading%corner = [reading%corner, corner_t(deck%text('ELSET'), deck%real('s'))]
         end do
      end do
      do while (deck%next_card('NODE|ELEMENT|LINE|ARC|RING|ELLIPSE|SPLINE|NSET|ELSET'))
         if (all(deck%at%keyword /= ['NSET ', 'ELSET'])) call begin_card(deck, reading)
         select case (deck%at%keyword)
         case ('NODE')
            call read_nodes(deck, reading)
         case ('ELEMENT')
            call read_elements(deck, reading)
         case ('NSET')
            call read_set(deck, deck%names%node)
         case ('ELSET')
            call read_set(deck, deck%names%element)
         case ('SPLINE')
            call read_spline(deck, reading)
         case default
            call read_curves(deck, reading)
         end select
      end do
      call reading%grown%take(model%mesh, model%curve)
      call empty_lists(model)
      deck%names%above_only = .false.
      allocate (deck%names%connected(model%mesh%n_nodes), source=.false.)
      do e = 1, model%mesh%n_elements
         deck%names%connected(model%mesh%node(:, e)) = .true.
      end do
   end subroutine read_mesh_cards

   !> Kind of the elements of a card, and the sets to which its nodes and elements are added.
   subroutine begin_card(deck, reading)
      type(checked_deck_t), intent(inout) :: deck
      type(mesh_reading_t), intent(inout) :: reading
      reading%node_set = 0
      reading%element_set = 0
      if (deck%at%keyword /= 'NODE') then
         call element_kind(deck%word('TYPE'), reading%pattern%family, reading%pattern%stages)
         if (deck%given('ELSET')) call deck%names%element%begin_set(deck%text('ELSET'), reading%element_set)
      end if
      if (deck%at%keyword == 'ELEMENT') return
      if (deck%given('NSET')) call deck%names%node%begin_set(deck%text('NSET'), reading%node_set)
   end subroutine begin_card

   !> Reads *NODE: each data line defines one node.
   subroutine read_nodes(deck, reading)
      type(checked_deck_t), intent(inout) :: deck
      type(mesh_reading_t), intent(inout) :: reading
      do while (deck%next_line())
         if (.not. is_new_label(deck, deck%names%node)) cycle
         call new_node(deck, reading, deck%integer('label'), [deck%real('x'), deck%real('y')])
         call deck%names%node%append(reading%node_set, [reading%grown%n_nodes])
      end do
   end subroutine read_nodes

   !> Reads *ELEMENT: each data line defines one element.
   subroutine read_elements(deck, reading)
      type(checked_deck_t), intent(inout) :: deck
      type(mesh_reading_t), intent(inout) :: reading
      integer :: node(2)
      do while (deck%next_line())
         if (.not. is_new_label(deck, deck%names%element)) cycle
         node = end_nodes(deck, reading%grown, 'second node')
         if (minval(node) > 0) then
            call new_element(deck, reading, deck%integer('label'), node, 0, [0.0_wp, norm2(reading%grown%x(:, node(2)) - &
               & reading%grown%x(:, node(1)))], .false.)
         else
            deck%names%mesh_incomplete = .true.
         end if
      end do
   end subroutine read_elements

   !> Reads *LINE, *ARC, *RING and *ELLIPSE: each data line defines one curve.
   subroutine read_curves(deck, reading)
      type(checked_deck_t), intent(inout) :: deck
      type(mesh_reading_t), intent(inout) :: reading
      type(curve_t) :: curve
      integer :: node(2), elements
      real(wp) :: grading
      real(wp), allocatable :: s(:)
      logical :: placed, ok
      do while (deck%next_line())
         call read_curve(deck, reading%grown, node, curve)
         call read_division(deck, reading, minval(node) > 0 .and. node(1) == node(2), elements, grading, placed, ok)
         if (ok .and. minval(node) > 0) then
            call reading%grown%add_curve(curve)
            s = graded_division(curve%length, elements, grading)
            call add_corners(deck, reading%corner, s)
            call mesh_curve(deck, reading, node, s, placed)
            deck%names%curve_line = [deck%names%curve_line, deck%at%line]
         else
            deck%names%mesh_incomplete = .true.
         end if
      end do
   end subroutine read_curves

   !> Reads *SPLINE: the card defines one curve.
   subroutine read_spline(deck, reading)
      type(checked_deck_t), intent(inout) :: deck
      type(mesh_reading_t), intent(inout) :: reading
      type(curve_t) :: curve
      integer, allocatable :: node(:), elements(:)
      real(wp), allocatable :: grading(:), point(:, :), at(:), s(:)
      logical, allocatable :: placed(:)
      logical :: ok, closed, sound
      integer :: i, n
      n = deck%at%n_lines
      allocate (node(n), elements(n), grading(n), placed(n))
      sound = deck%lines_sound()         ! lines with errors are skipped
      i = 0
      do while (deck%next_line())
         i = i + 1
         node(i) = deck%node('node')
         ok = .true.
         if (i < n .or. deck%word('ENDS') == 'CLOSED') then
            call read_division(deck, reading, .false., elements(i), grading(i), placed(i), ok)
         else if (deck%given('elements')) then
            call deck%wrong('elements', 'no node follows the last one of a spline that is not closed')
            ok = .false.
         end if
         sound = sound .and. ok .and. node(i) > 0
         if (i == 1 .or. .not. sound) cycle
         sound = norm2(reading%grown%x(:, node(i)) - reading%grown%x(:, node(i - 1))) > 0.0_wp
         if (.not. sound) call deck%wrong_line('the node is at the place of the one before')
      end do
      if (sound) point = reading%grown%x(:, node)
      if (sound) call end_spline(deck, point, closed, sound)
      if (.not. sound) deck%names%mesh_incomplete = .true.
      if (.not. sound) return
      if (deck%word('ENDS') == 'CLOSED') node = [node, node(1)]
      call path_curve(point, closed, reading%grown%x(:, node), curve, at)
      call reading%grown%add_curve(curve)
      do i = 1, size(node) - 1
         s = graded_division(at(i + 1) - at(i), elements(i), grading(i))
         call add_corners(deck, reading%corner, s)
         call mesh_curve(deck, reading, node(i:i + 1), at(i) + s, placed(i))
      end do
      deck%names%curve_line = [deck%names%curve_line, deck%at%line]
   end subroutine read_spline

   !> Adds nodes at corners of distributions to the nodes of a curve.
   subroutine add_corners(deck, corner, s)
      type(checked_deck_t), intent(in) :: deck
      type(corner_t), intent(inout) :: corner(:) ! out: the distances are those from the end of this curve
      real(wp), allocatable, intent(inout) :: s(:) ! coordinates of the nodes, from 0 to the length of the curve
      real(wp) :: length
      integer :: i
      if (.not. deck%given('ELSET')) return
      length = s(size(s))
      do i = 1, size(corner)
         if (.not. same_name(deck%text('ELSET'), corner(i)%set)) cycle
         associate (at => corner(i)%ahead)
            if (at > 0.0_wp .and. at < length) then
               if (minval(abs(s - at)) > same_length * length) s = [pack(s, s < at), at, pack(s, s > at)]
            end if
            at = at - length
         end associate
      end do
   end subroutine add_corners

   !> Reads the end nodes and the shape of a curve.
   subroutine read_curve(deck, grown, node, curve)
      type(checked_deck_t), intent(inout) :: deck
      type(growing_mesh_t), intent(in) :: grown
      integer, intent(out) :: node(2)      ! end nodes, equal for a ring; 0 after an error
      type(curve_t), intent(out) :: curve
      type(error_t), allocatable :: error
      real(wp) :: x(2, 2), centre(2)
      if (deck%at%keyword == 'RING') then
         node = deck%node('node')
      else if (deck%at%keyword == 'ELLIPSE' .and. deck%integer('first node') == deck%integer('last node')) then
         node = deck%node('first node')
      else
         node = end_nodes(deck, grown, 'last node')
      end if
      if (minval(node) == 0) return
      x = grown%x(:, node)
      if (deck%at%keyword /= 'LINE') centre = [deck%real('xc'), deck%real('yc')]
      select case (deck%at%keyword)
      case ('LINE')
         curve = line_curve(x(:, 1), x(:, 2))
      case ('ARC')
         call arc_curve(x(:, 1), x(:, 2), centre, deck%word('DIRECTION') == 'ANTICLOCKWISE', curve, error)
      case ('ELLIPSE')
         call ellipse_curve(x(:, 1), x(:, 2), centre, [deck%real('a'), deck%real('b')], deck%real('angle') * degree, &
            deck%word('DIRECTION') == 'ANTICLOCKWISE', curve, error)
      case ('RING')
         if (norm2(x(:, 1) - centre) > 0.0_wp) curve = ring_curve(x(:, 1), centre)
         if (norm2(x(:, 1) - centre) <= 0.0_wp) call fail(error, 'the centre is at the node')
      end select
      if (.not. allocated(error)) return
      call deck%wrong_line(error%message)
      node = 0
   end subroutine read_curve

   !> Reads into how many elements a curve is divided, and checks the division.
   subroutine read_division(deck, reading, closed, elements, grading, placed, ok)
      type(checked_deck_t), intent(inout) :: deck
      type(mesh_reading_t), intent(inout) :: reading
      logical, intent(in) :: closed        ! true: the curve ends at its first node
      integer, intent(out) :: elements     ! number of elements, as given, or for the output
      real(wp), intent(out) :: grading
      logical, intent(out) :: placed       ! true: the deck omits the number of elements
      logical, intent(out) :: ok
      real(wp) :: all_elements
      integer :: before
      before = deck%diagnostics%n
      placed = .not. deck%given('elements')
      elements = deck%integer('elements')
      if (placed) elements = output_elements
      grading = 1.0_wp
      if (placed .and. reading%pattern%stages < 2) then
         call deck%wrong_line('the number of elements can be left out of those of order 4, 6 and 8 only (TYPE)')
      else if (closed .and. elements < 3) then
         call deck%wrong('elements', 'a ring needs at least 3 elements')
      else if (deck%at%keyword /= 'RING') then
         grading = deck%real('grading')
         if (placed .and. deck%given('grading')) call deck%wrong('grading', 'grading needs a number of elements')
         if (elements == 1 .and. abs(grading - 1.0_wp) > 0.0_wp) call deck%wrong('grading', 'grading needs at least 2 elements')
      end if
      ok = deck%diagnostics%n == before
      if (.not. ok) return
      all_elements = real(reading%grown%n_elements, wp) + elements
      ok = elements <= huge(1) - max(deck%names%node%greatest, deck%names%element%greatest) - 2
      if (.not. ok) call deck%wrong('elements', 'too many elements to number')
      if (.not. ok) return
      ok = band_entries * all_elements <= huge(1)
      if (ok) ok = can_be_had(bytes_of_element * all_elements)
      if (.not. ok) call deck%wrong('elements', 'so many elements need about '// &
         to_text(nint(1.0e-9_wp * bytes_of_element * all_elements))//' GB of memory, more than can be had')
   end subroutine read_division

   !> Adds nodes and elements on the last curve, from its first end to its last end.
   subroutine mesh_curve(deck, reading, ends, s, placed)
      type(checked_deck_t), intent(inout) :: deck
      type(mesh_reading_t), intent(inout) :: reading
      integer, intent(in) :: ends(2)             ! indices of the end nodes, equal for a ring
      real(wp), intent(in) :: s(0:)              ! coordinates of the elements' ends on the curve
      logical, intent(in) :: placed              ! true: the deck omits the number of elements
      type(imperfection_t) :: none(0)
      integer :: i, from, to
      real(wp) :: x(2), angle, speed
      from = ends(1)
      call deck%names%node%append(reading%node_set, [from])
      do i = 1, ubound(s, 1)
         to = ends(2)
         if (i < ubound(s, 1)) then
            call curve_point(reading%grown%curve(reading%grown%n_curves), none, s(i), x, angle, speed)
            call new_node(deck, reading, deck%names%node%greatest + 1, x)
            to = reading%grown%n_nodes
         end if
         call new_element(deck, reading, deck%names%element%greatest + 1, [from, to], reading%grown%n_curves, s(i - 1:i), placed)
         call deck%names%node%append(reading%node_set, [to])
         from = to
      end do
   end subroutine mesh_curve

   !> First and second node of an element or of a row of elements. If they cannot be used, an error is added and the result is 0.
   function end_nodes(deck, grown, second) result(node)
      type(checked_deck_t), intent(inout) :: deck
      type(growing_mesh_t), intent(in) :: grown
      character(*), intent(in) :: second         ! name of the field that has the second node
      integer :: node(2)
      node(1) = deck%node('first node')
      node(2) = deck%node(second)
      if (minval(node) == 0) return
      if (node(1) == node(2)) then
         call deck%wrong(second, 'both nodes are node '//deck%text('first node'))
      else if (norm2(grown%x(:, node(2)) - grown%x(:, node(1))) <= 0.0_wp) then
         call deck%wrong('first node', 'the length is zero: both nodes are at the same place', last=second)
      else
         return
      end if
      node = 0
   end function end_nodes

   !> Adds a node, defined in the present line.
   subroutine new_node(deck, reading, label, x)
      type(checked_deck_t), intent(inout) :: deck
      type(mesh_reading_t), intent(inout) :: reading
      integer, intent(in) :: label
      real(wp), intent(in) :: x(2)
      call reading%grown%add_node(label, x)
      call deck%names%node%add(label, deck%at%line_at)
   end subroutine new_node

   !> Adds an element of the present card, defined in the present line.
   subroutine new_element(deck, reading, label, node, curve, s, placed)
      type(checked_deck_t), intent(inout) :: deck
      type(mesh_reading_t), intent(inout) :: reading
      integer, intent(in) :: label, node(2), curve
      real(wp), intent(in) :: s(2)
      logical, intent(in) :: placed
      call reading%grown%add_element(new_element_t(label, node, reading%pattern%family, reading%pattern%stages, curve, s, placed))
      call deck%names%element%add(label, deck%at%line_at)
      call deck%names%element%append(reading%element_set, [deck%names%element%n])
   end subroutine new_element

   !> True if the label of a line is not in use yet; otherwise an error is added.
   logical function is_new_label(deck, labels) result(is_new)
      type(checked_deck_t), intent(inout) :: deck
      type(labels_t), intent(in) :: labels   ! labels of nodes or elements
      integer :: old
      old = labels%find(deck%integer('label'))
      is_new = old == 0
      if (.not. is_new) call deck%wrong('label', trim(labels%what)//' '//to_text(deck%integer('label'))// &
         ' was defined in '//deck%source%line_words(labels%line(old)))
   end function is_new_label

   !> Reads *NSET and *ELSET.
   subroutine read_set(deck, labels)
      type(checked_deck_t), intent(inout), target :: deck
      type(labels_t), pointer, intent(in) :: labels ! labels of nodes or elements
      integer :: set, k
      call labels%begin_set(deck%text(deck%at%keyword), set)
      do while (deck%next_line())
         if (deck%given('GENERATE')) then
            call labels%append(set, range_of(deck, labels))
            cycle
         end if
         do k = 1, deck%count(deck%field_name(1))
            if (labels%what == 'node') call labels%append(set, deck%nodes(deck%field_name(1), k))
            if (labels%what == 'element') call labels%append(set, deck%elements(deck%field_name(1), k))
         end do
      end do
   end subroutine read_set

   !> Reads one line of a set with GENERATE.
   function range_of(deck, labels) result(members)
      type(checked_deck_t), intent(inout) :: deck
      type(labels_t), intent(in) :: labels       ! labels of nodes or elements
      integer, allocatable :: members(:)         ! nodes or elements up to the first that is not defined
      integer :: first, last, increment, label, n
      first = deck%integer('first')
      last = deck%integer('last')
      increment = deck%integer('increment')
      allocate (members(0))
      if (last < first) then
         call deck%wrong('last', 'the last label must not be below the first one')
      else if (mod(last - first, increment) /= 0) then
         call deck%wrong_line('the last label is not a whole number of increments from the first one')
      else
         members = reshape(members, [min((last - first) / increment, labels%n) + 1], pad=[0])
         do n = 1, (last - first) / increment + 1
            label = first + (n - 1) * increment
            members(n) = labels%find(label)
            if (members(n) > 0) cycle
            if (.not. deck%names%mesh_incomplete) call deck%wrong_line(trim(labels%what)//' '//to_text(label)// &
               ' is not defined above this line')
            members = members(:n - 1)
            return
         end do
      end if
   end function range_of
end module read_mesh

!> Reads nodes, elements, generated curves and sets, in the order of the deck: each card refers to preceding definitions.
module read_mesh
   use kinds, only: wp
   use errors, only: error_t
   use text, only: to_text
   use memory, only: can_be_had
   use model, only: model_t, curve_t
   use element_families, only: element_kind
   use mesh_generators, only: growing_mesh_t, line_curve, arc_curve, ring_curve, graded_division
   use reference_curve, only: curve_point
   use model, only: imperfection_t
   use diagnostics, only: diagnostics_t, place_t
   use deck_cards, only: deck_t, complain
   use card_values, only: given, parameter_text, parameter_word, field_given, field_place, field_text, field_integer, &
      field_real, &
      whole_line
   use deck_names, only: deck_names_t, find_nodes, find_elements, take_node_sets
   implicit none
   private
   public :: read_mesh_cards

   integer, parameter :: output_elements = 64 !! elements that carry the output of a curve whose number of elements is omitted

   !> Approximate memory of a run for one element of a line: stored resultants, and several copies of the equations.
   real(wp), parameter :: bytes_of_element = 3.5e3_wp
   !> Entries per node of a chain's band matrix factored with pivoting: three unknowns, coupled with those of neighbouring nodes.
   integer, parameter :: band_entries = 3 * (3 * 5 + 1)

   !> Lines of the deck that define labels, for messages about a second definition.
   type :: origin_t
      integer, allocatable :: node_line(:), element_line(:) !! line of the deck, by index
   end type origin_t

contains

   !> Reads all cards of the mesh; fills mesh, curves and node sets of the model.
   subroutine read_mesh_cards(deck, names, model, diagnostics)
      type(deck_t), intent(in) :: deck
      type(deck_names_t), intent(inout) :: names        !! receives nodes, elements and sets
      type(model_t), intent(inout) :: model             !! receives mesh (without sections), curve, node_set
      type(diagnostics_t), intent(inout) :: diagnostics
      type(growing_mesh_t) :: grown
      type(origin_t) :: origin
      integer :: card, e
      allocate (origin%node_line(64), origin%element_line(64), names%placed_line(0))
      do card = 1, deck%n_cards
         if (.not. deck%card(card)%sound) cycle
         select case (deck%card(card)%keyword)
         case ('NODE')
            call read_nodes(deck, names, grown, origin, diagnostics, card)
         case ('ELEMENT')
            call read_elements(deck, names, grown, origin, diagnostics, card)
         case ('LINE', 'ARC', 'RING')
            call read_curves(deck, names, grown, origin, diagnostics, card)
         case ('NSET', 'ELSET')
            call read_set(deck, names, diagnostics, card)
         end select
      end do
      call grown%take(model%mesh, model%curve)
      call take_node_sets(names, model%node_set)
      names%above_only = .false.
      names%element_line = origin%element_line(:model%mesh%n_elements)
      allocate (names%connected(model%mesh%n_nodes), source=.false.)
      do e = 1, model%mesh%n_elements
         names%connected(model%mesh%node(:, e)) = .true.
      end do
   end subroutine read_mesh_cards

   subroutine read_nodes(deck, names, grown, origin, diagnostics, card)
      type(deck_t), intent(in) :: deck
      type(deck_names_t), intent(inout) :: names
      type(growing_mesh_t), intent(inout) :: grown
      type(origin_t), intent(inout) :: origin
      type(diagnostics_t), intent(inout) :: diagnostics
      integer, intent(in) :: card
      integer :: line, label, set, old
      set = set_of_card(deck, names, card, 'NSET')
      do line = deck%card(card)%first_line, deck%card(card)%last_line
         if (.not. deck%data_line(line)%sound) cycle
         label = field_integer(deck, line, 1)
         old = names%node%find(label)
         if (old > 0) then
            call complain(deck, diagnostics, card, field_place(deck, line, 1), &
               'node '//to_text(label)//' was defined in '//deck%source%line_words(origin%node_line(old)))
            cycle
         end if
         call new_node(names, grown, origin, label, [field_real(deck, line, 2), field_real(deck, line, 3)], &
            deck%data_line(line)%line)
         call names%node_set%append(set, grown%mesh%n_nodes)
      end do
   end subroutine read_nodes

   subroutine read_elements(deck, names, grown, origin, diagnostics, card)
      type(deck_t), intent(in) :: deck
      type(deck_names_t), intent(inout) :: names
      type(growing_mesh_t), intent(inout) :: grown
      type(origin_t), intent(inout) :: origin
      type(diagnostics_t), intent(inout) :: diagnostics
      integer, intent(in) :: card
      integer :: line, label, set, old, node(2), family, stages
      real(wp) :: length
      set = set_of_card(deck, names, card, 'ELSET')
      call element_kind(parameter_word(deck, card, 'TYPE'), family, stages)
      do line = deck%card(card)%first_line, deck%card(card)%last_line
         if (.not. deck%data_line(line)%sound) cycle
         label = field_integer(deck, line, 1)
         old = names%element%find(label)
         if (old > 0) then
            call complain(deck, diagnostics, card, field_place(deck, line, 1), &
               'element '//to_text(label)//' was defined in '//deck%source%line_words(origin%element_line(old)))
            cycle
         end if
         call two_nodes(deck, names, grown, diagnostics, line, node, length)
         if (minval(node) == 0) then
            names%mesh_incomplete = .true.
            cycle
         end if
         call new_element(names, grown, origin, label, node, family, stages, 0, [0.0_wp, length], &
            deck%data_line(line)%line, .false.)
         call names%element_set%append(set, grown%mesh%n_elements)
      end do
   end subroutine read_elements

   !> Reads *LINE, *ARC and *RING: one curve for each data line.
   subroutine read_curves(deck, names, grown, origin, diagnostics, card)
      type(deck_t), intent(in) :: deck
      type(deck_names_t), intent(inout) :: names
      type(growing_mesh_t), intent(inout) :: grown
      type(origin_t), intent(inout) :: origin
      type(diagnostics_t), intent(inout) :: diagnostics
      integer, intent(in) :: card
      type(curve_t) :: curve
      type(error_t), allocatable :: error
      integer :: line, node(2), node_set, element_set, elements, elements_field, family, stages
      real(wp) :: length, centre(2), grading
      logical :: placed
      node_set = set_of_card(deck, names, card, 'NSET')
      element_set = set_of_card(deck, names, card, 'ELSET')
      call element_kind(parameter_word(deck, card, 'TYPE'), family, stages)
      do line = deck%card(card)%first_line, deck%card(card)%last_line
         if (.not. deck%data_line(line)%sound) cycle
         grading = 1.0_wp
         select case (deck%card(card)%keyword)
         case ('LINE')
            elements_field = 3
            call two_nodes(deck, names, grown, diagnostics, line, node, length)
            if (minval(node) > 0) curve = line_curve(grown%mesh%x(:, node(1)), grown%mesh%x(:, node(2)))
         case ('ARC')
            elements_field = 5
            centre = [field_real(deck, line, 3), field_real(deck, line, 4)]
            call two_nodes(deck, names, grown, diagnostics, line, node, length)
            if (minval(node) > 0) then
               call arc_curve(grown%mesh%x(:, node(1)), grown%mesh%x(:, node(2)), centre, &
                  parameter_word(deck, card, 'DIRECTION') == 'ANTICLOCKWISE', curve, error)
               if (allocated(error)) then
                  call complain(deck, diagnostics, card, whole_line(deck, line), error%message)
                  node = 0
               end if
            end if
         case default
            elements_field = 4
            centre = [field_real(deck, line, 2), field_real(deck, line, 3)]
            node = one_node(deck, names, diagnostics, line, 1)
            if (minval(node) > 0) then
               if (norm2(grown%mesh%x(:, node(1)) - centre) <= 0.0_wp) then
                  call complain(deck, diagnostics, card, whole_line(deck, line), 'the centre is at the node')
                  node = 0
               else
                  curve = ring_curve(grown%mesh%x(:, node(1)), centre)
               end if
            end if
         end select
         placed = .not. field_given(deck, line, elements_field)
         elements = output_elements
         if (.not. placed) elements = field_integer(deck, line, elements_field)
         if (placed .and. stages < 2) then
            call complain(deck, diagnostics, card, whole_line(deck, line), 'the number of elements can be left out of those of '// &
               'order 4, 6 and 8 only (TYPE)')
            node = 0
         else if (deck%card(card)%keyword == 'RING' .and. elements < 3) then
            call complain(deck, diagnostics, card, field_place(deck, line, elements_field), &
               'a ring needs at least 3 elements')
            node = 0
         else if (deck%card(card)%keyword /= 'RING') then
            grading = field_real(deck, line, elements_field + 1)
            if (placed .and. field_given(deck, line, elements_field + 1)) then
               call complain(deck, diagnostics, card, field_place(deck, line, elements_field + 1), &
                  'grading needs a number of elements')
               node = 0
            end if
            if (elements == 1 .and. abs(grading - 1.0_wp) > 0.0_wp) then
               call complain(deck, diagnostics, card, field_place(deck, line, elements_field + 1), &
                  'grading needs at least 2 elements')
               node = 0
            end if
         end if
         if (minval(node) == 0) then
            names%mesh_incomplete = .true.
         else if (elements > huge(1) - max(names%greatest_node, names%greatest_element) - 2) then
            call complain(deck, diagnostics, card, field_place(deck, line, elements_field), &
               'too many elements to number')
            names%mesh_incomplete = .true.
         else if (.not. fits(real(grown%mesh%n_elements, wp) + elements)) then
            call complain(deck, diagnostics, card, field_place(deck, line, elements_field), 'so many elements need about '// &
               to_text(nint(1.0e-9_wp * bytes_of_element * (real(grown%mesh%n_elements, wp) + elements)))// &
               ' GB of memory, more than can be had')
            names%mesh_incomplete = .true.
         else
            call grown%add_curve(curve)
            call mesh_curve(names, grown, origin, node, graded_division(curve%length, elements, grading), family, &
               stages, &
               node_set, element_set, deck%data_line(line)%line, placed)
            names%placed_line = [names%placed_line, merge(line, 0, placed)]
         end if
      end do
   end subroutine read_curves

   !> True for a number of elements for which there is enough memory, and whose equations can be numbered.
   logical function fits(elements)
      real(wp), intent(in) :: elements
      fits = band_entries * elements <= huge(1)
      if (fits) fits = can_be_had(bytes_of_element * elements)
   end function fits

   !> Adds nodes and elements on the last curve, from its first to its last node.
   subroutine mesh_curve(names, grown, origin, ends, s, family, stages, node_set, element_set, deck_line, placed)
      type(deck_names_t), intent(inout) :: names
      type(growing_mesh_t), intent(inout) :: grown
      type(origin_t), intent(inout) :: origin
      integer, intent(in) :: ends(2)             ! indices of the end nodes, equal for a ring
      real(wp), intent(in) :: s(0:)              ! ends of the elements on the curve
      integer, intent(in) :: family, stages, node_set, element_set, deck_line
      logical, intent(in) :: placed              ! the deck omits the number of elements
      type(imperfection_t) :: none(0)
      integer :: i, from, to
      real(wp) :: x(2), angle, speed
      from = ends(1)
      call names%node_set%append(node_set, from)
      do i = 1, ubound(s, 1)
         to = ends(2)
         if (i < ubound(s, 1)) then
            call curve_point(grown%curve(grown%n_curves), none, s(i), x, angle, speed)
            call new_node(names, grown, origin, names%greatest_node + 1, x, deck_line)
            to = grown%mesh%n_nodes
         end if
         call new_element(names, grown, origin, names%greatest_element + 1, [from, to], family, stages, &
            grown%n_curves, &
            s(i - 1:i), deck_line, placed)
         call names%element_set%append(element_set, grown%mesh%n_elements)
         call names%node_set%append(node_set, to)
         from = to
      end do
   end subroutine mesh_curve

   !> Reads *NSET and *ELSET.
   subroutine read_set(deck, names, diagnostics, card)
      type(deck_t), intent(in) :: deck
      type(deck_names_t), intent(inout) :: names
      type(diagnostics_t), intent(inout) :: diagnostics
      integer, intent(in) :: card
      character(:), allocatable :: what
      integer, allocatable :: members(:)
      integer :: line, field, set, i
      what = 'node'
      if (deck%card(card)%keyword == 'ELSET') what = 'element'
      set = set_of_card(deck, names, card, deck%card(card)%keyword)
      do line = deck%card(card)%first_line, deck%card(card)%last_line
         if (.not. deck%data_line(line)%sound) cycle
         if (given(deck, card, 'GENERATE')) then
            call read_range(deck, names, diagnostics, line, what, set)
            cycle
         end if
         do field = 1, deck%data_line(line)%n_fields
            if (what == 'node') then
               call find_nodes(deck, names, diagnostics, line, field, members)
            else
               call find_elements(deck, names, diagnostics, line, field, members)
            end if
            do i = 1, size(members)
               if (what == 'node') call names%node_set%append(set, members(i))
               if (what == 'element') call names%element_set%append(set, members(i))
            end do
         end do
      end do
   end subroutine read_set

   !> Reads one line of a set with GENERATE.
   subroutine read_range(deck, names, diagnostics, line, what, set)
      type(deck_t), intent(in) :: deck
      type(deck_names_t), intent(inout) :: names
      type(diagnostics_t), intent(inout) :: diagnostics
      integer, intent(in) :: line
      character(*), intent(in) :: what
      integer, intent(in) :: set
      integer :: first, last, increment, label, member, steps
      first = field_integer(deck, line, 1)
      last = field_integer(deck, line, 2)
      increment = field_integer(deck, line, 3)
      if (last < first) then
         call complain(deck, diagnostics, deck%data_line(line)%card, field_place(deck, line, 2), &
            'the last label must not be below the first one')
         return
      else if (mod(last - first, increment) /= 0) then
         call complain(deck, diagnostics, deck%data_line(line)%card, whole_line(deck, line), &
            'the last label is not a whole number of increments from the first one')
         return
      end if
      do steps = 0, (last - first) / increment
         label = first + steps * increment
         if (what == 'node') member = names%node%find(label)
         if (what == 'element') member = names%element%find(label)
         if (member == 0) then
            if (.not. names%mesh_incomplete) call complain(deck, diagnostics, deck%data_line(line)%card, &
               whole_line(deck, line), what//' '//to_text(label)//' is not defined above this line')
            return
         end if
         if (what == 'node') call names%node_set%append(set, member)
         if (what == 'element') call names%element_set%append(set, member)
      end do
   end subroutine read_range

   !> First and second node of a straight or curved row; 0, and an error is added, if they cannot be used.
   subroutine two_nodes(deck, names, grown, diagnostics, line, node, distance)
      type(deck_t), intent(in) :: deck
      type(deck_names_t), intent(in) :: names
      type(growing_mesh_t), intent(in) :: grown
      type(diagnostics_t), intent(inout) :: diagnostics
      integer, intent(in) :: line
      integer, intent(out) :: node(2)
      real(wp), intent(out) :: distance
      integer :: first_field
      first_field = 1
      if (deck%card(deck%data_line(line)%card)%keyword == 'ELEMENT') first_field = 2
      node(1) = one_node(deck, names, diagnostics, line, first_field)
      node(2) = one_node(deck, names, diagnostics, line, first_field + 1)
      distance = 0.0_wp
      if (minval(node) == 0) return
      distance = norm2(grown%mesh%x(:, node(2)) - grown%mesh%x(:, node(1)))
      if (node(1) == node(2)) then
         call complain(deck, diagnostics, deck%data_line(line)%card, field_place(deck, line, first_field + 1), &
            'both nodes are node '//field_text(deck, line, first_field))
         node = 0
      else if (distance <= 0.0_wp) then
         call complain(deck, diagnostics, deck%data_line(line)%card, two_fields(first_field), &
            'the length is zero: both nodes are at the same place')
         node = 0
      end if

   contains

      type(place_t) function two_fields(first) result(place)
         integer, intent(in) :: first
         type(place_t) :: second
         place = field_place(deck, line, first)
         second = field_place(deck, line, first + 1)
         place%last = second%last
      end function two_fields
   end subroutine two_nodes

   !> Index of the node that a field names; 0, and an error is added, if it is not defined.
   integer function one_node(deck, names, diagnostics, line, field) result(node)
      type(deck_t), intent(in) :: deck
      type(deck_names_t), intent(in) :: names
      type(diagnostics_t), intent(inout) :: diagnostics
      integer, intent(in) :: line, field
      integer, allocatable :: nodes(:)
      node = names%node%find(field_integer(deck, line, field))
      if (node == 0) call find_nodes(deck, names, diagnostics, line, field, nodes)
   end function one_node

   subroutine new_node(names, grown, origin, label, x, deck_line)
      type(deck_names_t), intent(inout) :: names
      type(growing_mesh_t), intent(inout) :: grown
      type(origin_t), intent(inout) :: origin
      integer, intent(in) :: label, deck_line
      real(wp), intent(in) :: x(2)
      call grown%add_node(label, x)
      call names%node%add(label, grown%mesh%n_nodes)
      names%least_node = min(names%least_node, label)
      names%greatest_node = max(names%greatest_node, label)
      call note(origin%node_line, grown%mesh%n_nodes, deck_line)
   end subroutine new_node

   subroutine new_element(names, grown, origin, label, node, family, stages, curve, s, deck_line, placed)
      type(deck_names_t), intent(inout) :: names
      type(growing_mesh_t), intent(inout) :: grown
      type(origin_t), intent(inout) :: origin
      integer, intent(in) :: label, node(2), family, stages, curve, deck_line
      real(wp), intent(in) :: s(2)
      logical, intent(in) :: placed
      call grown%add_element(label, node, family, stages, curve, s, placed)
      call names%element%add(label, grown%mesh%n_elements)
      names%least_element = min(names%least_element, label)
      names%greatest_element = max(names%greatest_element, label)
      call note(origin%element_line, grown%mesh%n_elements, deck_line)
   end subroutine new_element

   pure subroutine note(list, n, value)
      integer, allocatable, intent(inout) :: list(:)
      integer, intent(in) :: n, value
      integer, allocatable :: larger(:)
      if (n > size(list)) then
         allocate (larger(2 * n))
         larger(:n - 1) = list(:n - 1)
         call move_alloc(larger, list)
      end if
      list(n) = value
   end subroutine note

   !> Index of the set to which a card adds its nodes or elements, 0 if the card names none.
   integer function set_of_card(deck, names, card, parameter) result(set)
      type(deck_t), intent(in) :: deck
      type(deck_names_t), intent(inout) :: names
      integer, intent(in) :: card
      character(*), intent(in) :: parameter
      set = 0
      if (.not. given(deck, card, parameter)) return
      if (parameter == 'NSET') call names%node_set%begin(parameter_text(deck, card, parameter), set)
      if (parameter == 'ELSET') call names%element_set%begin(parameter_text(deck, card, parameter), set)
   end function set_of_card
end module read_mesh

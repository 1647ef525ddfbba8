!> Reads *IMPERFECTION of the model part: shapes on chains of curves, and the resulting positions of the nodes.
module read_imperfections
   use kinds, only: wp, degree
   use text, only: to_text
   use model, only: model_t, mesh_t, imperfection_t, shape_sine, shape_cosine, shape_clamped
   use imperfection_chain, only: chain_t, follow_chain
   use imperfection, only: imperfection_value, nodal_imperfection, random_offsets
   use reference_curve, only: measure_curves
   use diagnostics, only: diagnostics_t
   use deck_cards, only: deck_t, complain
   use card_values, only: parameter_word, parameter_integer, field_place, field_real, field_text
   use deck_names, only: deck_names_t, find_set, find_nodes
   implicit none
   private
   public :: read_imperfection_cards

contains

   !> Reads all imperfections except buckling modes; assigns them to the curves and moves mesh%x.
   subroutine read_imperfection_cards(deck, names, model, diagnostics)
      type(deck_t), intent(in) :: deck
      type(deck_names_t), intent(in) :: names           !! with the mesh
      type(model_t), intent(inout) :: model             !! receives imperfection, curve%imperfection, mesh%x
      type(diagnostics_t), intent(inout) :: diagnostics
      integer, allocatable :: from_card(:)
      integer :: card, set
      type(chain_t) :: chain
      type(imperfection_t) :: shape
      logical :: ok
      allocate (model%imperfection(0), from_card(0))
      do card = 1, deck%n_cards
         if (.not. deck%card(card)%sound .or. deck%card(card)%keyword /= 'IMPERFECTION') cycle
         if (deck%card(card)%step > 0 .or. parameter_word(deck, card, 'SHAPE') == 'MODE') cycle
         call find_set(deck, names, diagnostics, card, 'ELSET', 'element', set)
         if (set == 0 .or. names%mesh_incomplete) cycle
         call follow_chain(deck, model, diagnostics, card, names%element_set%members(set), chain, ok)
         if (.not. ok) cycle
         call read_shape(deck, names, model%mesh, diagnostics, card, chain, shape, ok)
         if (.not. ok) cycle
         model%imperfection = [model%imperfection, shape]
         from_card = [from_card, card]
         call mark_curves(model, chain)
      end do
      call move_nodes(deck, model, diagnostics, from_card)
      call measure_curves(model%curve, model%imperfection)
   end subroutine read_imperfection_cards

   !> Reads the data lines.
   subroutine read_shape(deck, names, mesh, diagnostics, card, chain, shape, ok)
      type(deck_t), intent(in) :: deck
      type(deck_names_t), intent(in) :: names
      type(mesh_t), intent(in) :: mesh
      type(diagnostics_t), intent(inout) :: diagnostics
      integer, intent(in) :: card
      type(chain_t), intent(in) :: chain
      type(imperfection_t), intent(out) :: shape
      logical, intent(out) :: ok
      real(wp), allocatable :: offset(:)
      integer :: line, first, most
      first = deck%card(card)%first_line
      ok = all(deck%data_line(first:deck%card(card)%last_line)%sound)
      if (.not. ok) return
      shape%length = chain%knot(size(chain%knot))
      select case (parameter_word(deck, card, 'SHAPE'))
      case ('SINE', 'COSINE')
         shape%shape = merge(shape_sine, shape_cosine, parameter_word(deck, card, 'SHAPE') == 'SINE')
         shape%amplitude = [(field_real(deck, line, 1), line=first, deck%card(card)%last_line)]
         shape%half_waves = [(field_real(deck, line, 2), line=first, deck%card(card)%last_line)]
         shape%phase = [(field_real(deck, line, 3) * degree, line=first, deck%card(card)%last_line)]
         most = most_half_waves(names, mesh, chain)
         do line = first, deck%card(card)%last_line
            if (field_real(deck, line, 2) > most) then
               call complain(deck, diagnostics, card, field_place(deck, line, 2), field_text(deck, line, 2)// &
                  ' half waves are more than '//to_text(most)//', the most that the elements of the chain can follow')
               ok = .false.
            else if (chain%closed .and. abs(modulo(field_real(deck, line, 2), 2.0_wp)) > 0.0_wp) then
               call complain(deck, diagnostics, card, field_place(deck, line, 2), &
                  'a closed chain needs an even number of half waves')
               ok = .false.
            end if
         end do
      case ('CLAMPED')
         shape%shape = shape_clamped
         shape%amplitude = [field_real(deck, first, 1), field_real(deck, first, 2)]
      case ('NODAL')
         call read_nodal_offsets(deck, names, mesh, diagnostics, card, chain, offset, ok)
         if (ok) call nodal_imperfection(chain%knot, offset, chain%closed, shape)
      case default
         allocate (offset(size(chain%node)))
         call random_offsets(parameter_integer(deck, card, 'SEED'), field_real(deck, first, 1), chain%closed, offset)
         call nodal_imperfection(chain%knot, offset, chain%closed, shape)
      end select
   end subroutine read_shape

   !> Largest number of half waves along a chain that the mesh resolves: one for each Gauss point of its elements, or for each
   !> straight element. If numbers of elements are omitted, the program may make finer meshes, and a constant applies.
   pure integer function most_half_waves(names, mesh, chain) result(most)
      type(deck_names_t), intent(in) :: names
      type(mesh_t), intent(in) :: mesh
      type(chain_t), intent(in) :: chain
      integer, parameter :: most_of_any_mesh = 1000
      most = sum(max(1, mesh%stages(chain%element)))
      if (any(names%placed_line(mesh%curve(chain%element)) > 0)) most = max(most, most_of_any_mesh)
   end function most_half_waves

   !> Reads SHAPE=NODAL: node or set, offset.
   subroutine read_nodal_offsets(deck, names, mesh, diagnostics, card, chain, offset, ok)
      type(deck_t), intent(in) :: deck
      type(deck_names_t), intent(in) :: names
      type(mesh_t), intent(in) :: mesh
      type(diagnostics_t), intent(inout) :: diagnostics
      integer, intent(in) :: card
      type(chain_t), intent(in) :: chain
      real(wp), allocatable, intent(out) :: offset(:)
      logical, intent(out) :: ok
      integer, allocatable :: nodes(:)
      integer :: place_in_chain(mesh%n_nodes), given_in(mesh%n_nodes)
      integer :: line, i, node
      ok = .true.
      allocate (offset(size(chain%node)), source=0.0_wp)
      place_in_chain = 0
      given_in = 0
      do i = size(chain%node), 1, -1
         place_in_chain(chain%node(i)) = i
      end do
      do line = deck%card(card)%first_line, deck%card(card)%last_line
         call find_nodes(deck, names, diagnostics, line, 1, nodes)
         ok = ok .and. size(nodes) > 0
         do i = 1, size(nodes)
            node = nodes(i)
            if (place_in_chain(node) == 0) then
               call complain(deck, diagnostics, card, field_place(deck, line, 1), &
                  'node '//to_text(mesh%node_label(node))//' is not on the chain')
               ok = .false.
               exit
            else if (given_in(node) > 0) then
               call complain(deck, diagnostics, card, field_place(deck, line, 1), &
                  'node '//to_text(mesh%node_label(node))//' has an offset already, from '// &
                  deck%source%line_words(given_in(node)))
               ok = .false.
               exit
            end if
            given_in(node) = deck%data_line(line)%line
            offset(place_in_chain(node)) = field_real(deck, line, 2)
         end do
      end do
      if (chain%closed) offset(size(offset)) = offset(1)
   end subroutine read_nodal_offsets

   !> Assigns to the curves of a chain its imperfection, the last one in the list.
   subroutine mark_curves(model, chain)
      type(model_t), intent(inout) :: model
      type(chain_t), intent(in) :: chain
      integer :: i, e
      do i = 1, size(chain%element)
         e = chain%element(i)
         if (model%mesh%s(1, e) > 0.0_wp) cycle
         model%curve(model%mesh%curve(e))%imperfection = size(model%imperfection)
         model%curve(model%mesh%curve(e))%offset = chain%knot(i)
      end do
   end subroutine mark_curves

   !> Moves mesh%x; all curves that meet at a node must give it the same position.
   subroutine move_nodes(deck, model, diagnostics, from_card)
      type(deck_t), intent(in) :: deck
      type(model_t), intent(inout) :: model
      type(diagnostics_t), intent(inout) :: diagnostics
      integer, intent(in) :: from_card(:)        ! by imperfection
      real(wp), parameter :: disagreement = 1.0e-3_wp
      real(wp) :: shift(2, model%mesh%n_nodes), size_of_offset(model%mesh%n_nodes), w, dw, angle, here(2)
      integer :: owner(model%mesh%n_nodes), e, k, node, i
      logical :: visited(model%mesh%n_nodes), reported(size(from_card))
      if (size(from_card) == 0) return
      shift = 0.0_wp
      size_of_offset = 0.0_wp
      owner = 0
      visited = .false.
      reported = .false.
      do e = 1, model%mesh%n_elements
         if (model%mesh%curve(e) == 0) cycle
         associate (curve => model%curve(model%mesh%curve(e)))
            do k = 1, 2
               node = model%mesh%node(k, e)
               here = 0.0_wp
               w = 0.0_wp
               if (curve%imperfection > 0) then
                  call imperfection_value(model%imperfection(curve%imperfection), curve%offset + model%mesh%s(k, &
                     e), w, dw)
                  angle = curve%angle + curve%curvature * model%mesh%s(k, e)
                  here = w * [-sin(angle), cos(angle)]
               end if
               if (.not. visited(node)) shift(:, node) = here
               visited(node) = .true.
               size_of_offset(node) = max(size_of_offset(node), abs(w))
               if (curve%imperfection > 0) owner(node) = curve%imperfection
               if (owner(node) == 0) cycle
               i = owner(node)
               if (norm2(here - shift(:, node)) <= disagreement * size_of_offset(node) + &
                  1.0e-12_wp * model%imperfection(i)%length .or. reported(i)) cycle
               reported(i) = .true.
               call complain(deck, diagnostics, from_card(i), deck%card(from_card(i))%place, 'node '// &
                  to_text(model%mesh%node_label(node))//' is moved, but another curve that meets it there is not '// &
                  'moved '// &
                  'with it; the offset must be zero at such a node')
            end do
         end associate
      end do
      model%mesh%x = model%mesh%x_nominal + shift
      do e = 1, model%mesh%n_elements
         if (model%mesh%curve(e) > 0) cycle
         model%mesh%s(2, e) = norm2(model%mesh%x(:, model%mesh%node(2, e)) - model%mesh%x(:, model%mesh%node(1, e)))
      end do
   end subroutine move_nodes
end module read_imperfections

!> Reads *IMPERFECTION. In the model part it defines shapes on chains of curves, which determine the positions of the nodes; in a
!> step (SHAPE=MODE) it defines buckling modes as the stress-free offset at the start of the step.
module read_imperfections
   use kinds, only: wp, degree, pi
   use text, only: to_text, plural
   use model, only: model_t, mesh_t, imperfection_t, mode_offset_t, shape_sine, shape_cosine, shape_clamped
   use imperfection, only: nodal_imperfection, random_offsets
   use reference_curve, only: curve_angle
   use imperfect_mesh, only: add_imperfection, move_to_curves, parted_nodes
   use checked_deck, only: checked_deck_t, position_t, node_words, element_words
   implicit none
   private
   public :: read_imperfection_cards, read_mode_imperfection_cards

   real(wp), parameter :: largest_corner = 1.0e-4_wp !! angles between curves below this are rounding of the coordinates in a deck
   !! [rad]

   !> A chain: connected elements that cover whole curves.
   type :: chain_t
      integer, allocatable :: element(:)  !! elements in their order
      integer, allocatable :: node(:)     !! nodes in their order, one more than elements; if closed, the last node is the first
      real(wp), allocatable :: knot(:)    !! chain coordinates of the nodes
      logical :: closed = .false.         !! true: the chain ends where it begins
   end type chain_t

contains

   !> Reads all imperfections except buckling modes; assigns them to the curves and moves mesh%x.
   subroutine read_imperfection_cards(deck, model)
      type(checked_deck_t), intent(inout) :: deck       !! contains the mesh
      type(model_t), intent(inout) :: model             !! out: model%imperfection, curve%imperfection and mesh%x are set
      type(position_t), allocatable :: origin(:)          ! (imperfections) card of the imperfection
      type(chain_t) :: chain
      type(imperfection_t) :: shape
      logical :: ok
      allocate (origin(0))
      do while (deck%next_card('IMPERFECTION'))
         if (deck%word('SHAPE') == 'MODE') deck%names%has_modes = .true.
         if (deck%at%step > 0 .or. deck%word('SHAPE') == 'MODE') cycle
         call follow_chain(deck, model, deck%elements('ELSET'), chain, ok)
         if (ok) ok = deck%lines_sound()
         if (ok) call read_shape(deck, model%mesh, chain, shape, ok)
         if (.not. ok) cycle
         call add_imperfection(model, chain%element, chain%knot, shape)
         origin = [origin, deck%at]
      end do
      call move_to_curves(model)
      if (size(origin) > 0) call report_parted(parted_nodes(model))

   contains

      !> Reports each imperfection that moves a node to another place than a second curve at this node.
      subroutine report_parted(node)
         integer, intent(in) :: node(:)
         logical :: reported(size(origin))
         integer :: e, k, i
         reported = .false.
         do k = 1, size(node)
            i = 0
            do e = 1, model%mesh%n_elements
               if (model%mesh%curve(e) == 0 .or. all(model%mesh%node(:, e) /= node(k))) cycle
               i = max(i, model%curve(model%mesh%curve(e))%imperfection)
            end do
            if (reported(i)) cycle
            reported(i) = .true.
            deck%at = origin(i)
            call deck%wrong_card(node_words(model%mesh, node(k))//' is moved, but another curve that meets it '// &
               'there is not moved with it; the offset must be zero at such a node')
         end do
         call deck%rewind()
      end subroutine report_parted
   end subroutine read_imperfection_cards

   !> Reads the data lines; none of them has errors.
   subroutine read_shape(deck, mesh, chain, shape, ok)
      type(checked_deck_t), intent(inout) :: deck
      type(mesh_t), intent(in) :: mesh
      type(chain_t), intent(in) :: chain
      type(imperfection_t), intent(out) :: shape
      logical, intent(out) :: ok
      real(wp), allocatable :: offset(:)
      ok = .true.
      shape%length = chain%knot(size(chain%knot))
      select case (deck%word('SHAPE'))
      case ('SINE', 'COSINE')
         shape%shape = merge(shape_sine, shape_cosine, deck%word('SHAPE') == 'SINE')
         allocate (shape%amplitude(0), shape%half_waves(0), shape%phase(0))
         do while (deck%next_line())
            shape%amplitude = [shape%amplitude, deck%real('amplitude')]
            shape%half_waves = [shape%half_waves, deck%real('half waves')]
            shape%phase = [shape%phase, deck%real('phase') * degree]
            call check_half_waves()
         end do
      case ('CLAMPED')
         ok = deck%next_line()
         shape%shape = shape_clamped
         shape%amplitude = [deck%real('a1'), deck%real('a2')]
      case ('NODAL')
         call read_nodal_offsets()
         if (ok) call nodal_imperfection(chain%knot, offset, chain%closed, shape)
      case default
         ok = deck%next_line()
         allocate (offset(size(chain%node)))
         call random_offsets(deck%integer('SEED'), deck%real('amplitude'), chain%closed, offset)
         call nodal_imperfection(chain%knot, offset, chain%closed, shape)
      end select

   contains

      !> Checks the half waves on a line: the mesh must resolve them, and on a closed chain their number must be even.
      subroutine check_half_waves()
         integer, parameter :: most_of_any_mesh = 1000
         integer :: most
         ! The mesh resolves one half wave for each Gauss point of its elements, or for each straight element. If numbers of
         ! elements are omitted, the program may make finer meshes, and the limit is a constant.
         most = sum(max(1, mesh%stages(chain%element)))
         if (any(mesh%placed(chain%element))) most = max(most, most_of_any_mesh)
         if (deck%real('half waves') > most) then
            call deck%wrong('half waves', deck%text('half waves')//' half waves are more than '//to_text(most)// &
               ', the most that the elements of the chain can follow')
         else if (chain%closed .and. abs(modulo(deck%real('half waves'), 2.0_wp)) > 0.0_wp) then
            call deck%wrong('half waves', 'a closed chain needs an even number of half waves')
         else
            return
         end if
         ok = .false.
      end subroutine check_half_waves

      !> Reads data lines of SHAPE=NODAL: node or set, offset.
      subroutine read_nodal_offsets()
         character(:), allocatable :: problem
         integer, allocatable :: nodes(:)
         integer :: place_in_chain(mesh%n_nodes), given_in(mesh%n_nodes), i
         allocate (offset(size(chain%node)), source=0.0_wp)
         place_in_chain = 0
         given_in = 0
         do i = size(chain%node), 1, -1
            place_in_chain(chain%node(i)) = i
         end do
         do while (deck%next_line())
            nodes = deck%nodes('node or set')
            ok = ok .and. size(nodes) > 0
            do i = 1, size(nodes)
               associate (node => nodes(i))
                  problem = ''
                  if (given_in(node) > 0) problem = ' has an offset already, from '//deck%source%line_words(given_in(node))
                  if (place_in_chain(node) == 0) problem = ' is not on the chain'
                  if (problem /= '') then
                     call deck%wrong('node or set', node_words(mesh, node)//problem)
                     ok = .false.
                     exit
                  end if
                  given_in(node) = deck%at%line_at
                  offset(place_in_chain(node)) = deck%real('offset')
               end associate
            end do
         end do
         if (chain%closed) offset(size(offset)) = offset(1)
      end subroutine read_nodal_offsets
   end subroutine read_shape

   !> Reads the modes of all steps, and reports each *IMPERFECTION that is in the wrong part of the deck.
   subroutine read_mode_imperfection_cards(deck, model)
      type(checked_deck_t), intent(inout) :: deck       !! contains the mesh and the names of the steps
      type(model_t), intent(inout) :: model             !! in: contains all other imperfections; out: also step%mode_offset
      type(chain_t) :: chain
      integer :: s, from_step, mode
      logical :: of_mode, ok
      do while (deck%next_card('IMPERFECTION'))
         s = deck%at%step
         of_mode = deck%word('SHAPE') == 'MODE'
         if (s == 0 .and. of_mode) call deck%wrong('SHAPE', 'SHAPE=MODE belongs in a step with *STATIC')
         if (s > 0 .and. .not. of_mode) call deck%wrong('SHAPE', &
            'only SHAPE=MODE may stand in a step; all other shapes belong above the first *STEP')
         if (s == 0 .or. .not. of_mode) cycle
         if (model%step(s)%n_modes > 0) cycle ! another procedure reports this error
         call find_buckling_step(from_step)
         call follow_chain(deck, model, deck%elements('ELSET'), chain, ok)
         if (.not. ok .or. from_step == 0) cycle
         do while (deck%next_line())
            mode = deck%integer('mode')
            associate (found => model%step(from_step)%n_modes) ! 0: unknown because of an error
               if (found > 0 .and. mode > found) call deck%wrong('mode', 'that step finds '//plural(found, 'mode')//' only')
            end associate
            model%step(s)%mode_offset = [model%step(s)%mode_offset, mode_offset_t(step=from_step, mode=mode, &
               amplitude=deck%real('amplitude'), element=chain%element, line=deck%at%card_at)]
         end do
      end do

   contains

      !> Finds the step that parameter STEP names: an earlier one with *BUCKLE.
      subroutine find_buckling_step(step)
         integer, intent(out) :: step      ! number of the step; 0: none
         step = deck%named('STEP', deck%names%step, 'step')
         if (step == 0) return
         if (step >= deck%at%step) then
            call deck%wrong('STEP', 'step '//trim(deck%names%step%name(step))//' does not come before this one')
         else if (.not. (deck%names%unknown_cards .or. deck%last_card('BUCKLE', step) > 0)) then
            call deck%wrong('STEP', 'step '//trim(deck%names%step%name(step))//' has no *BUCKLE')
         else
            return
         end if
         step = 0
      end subroutine find_buckling_step
   end subroutine read_mode_imperfection_cards

   !> Checks that the elements form one smooth chain of whole curves.
   subroutine follow_chain(deck, model, element, chain, ok)
      type(checked_deck_t), intent(inout) :: deck       !! position at the *IMPERFECTION; out: with the first error, at ELSET
      type(model_t), intent(in) :: model                !! model with the mesh, and with the imperfections of its curves so far
      integer, intent(in) :: element(:)                 !! elements in the order of their set
      type(chain_t), intent(out) :: chain
      logical, intent(out) :: ok !! false: the elements do not form such a chain, or the chain already has an imperfection
      character(:), allocatable :: problem
      integer :: i, n
      n = size(element)
      ok = .false.
      if (n == 0 .or. deck%names%mesh_incomplete) return
      allocate (chain%knot(n + 1), source=0.0_wp)
      associate (mesh => model%mesh)
         do i = 1, n
            problem = link_problem(i)
            if (problem /= '') exit
            chain%knot(i + 1) = chain%knot(i) + (mesh%s(2, element(i)) - mesh%s(1, element(i)))
         end do
         chain%element = element
         chain%node = [mesh%node(1, element), mesh%node(2, element(n))]
      end associate
      chain%closed = chain%node(n + 1) == chain%node(1)
      if (problem == '') then
         if (.not. ends_curve(element(n))) then
            problem = 'the chain must end with the last element of a curve, not with '//label(element(n))
         else if (chain%closed .and. corner(element(n), element(1)) > largest_corner) then
            problem = 'the closed chain has a corner where it begins'
         end if
      end if
      ok = problem == ''
      if (.not. ok) call deck%wrong('ELSET', problem)

   contains

      !> Reason why an element of a set cannot continue the chain of the preceding elements; '' if it can.
      function link_problem(i) result(problem)
         integer, intent(in) :: i          ! position of the element in the set
         character(:), allocatable :: problem
         logical :: begins
         problem = ''
         associate (mesh => model%mesh, e => element(i), before => element(max(1, i - 1)))
            if (mesh%curve(e) == 0) then
               problem = element_words(mesh, e)//' is not on a generated curve (*LINE, *ARC ...)'
               return
            else if (model%curve(mesh%curve(e))%imperfection > 0) then
               problem = element_words(mesh, e)//' has an imperfection already'
               return
            end if
            begins = .not. mesh%s(1, e) > 0.0_wp
            if (i == 1) then
               if (.not. begins) problem = 'the chain must begin with the first element of a curve, not with '//label(e)
            else if (ends_curve(before) .neqv. begins) then
               problem = 'the set must hold whole curves; after '//element_words(mesh, before)//' comes '//label(e)
            else if (mesh%node(2, before) /= mesh%node(1, e)) then
               problem = element_words(mesh, e)//' does not begin where '//element_words(mesh, before)//' ends'
            else if (begins .and. corner(before, e) > largest_corner) then
               problem = 'the chain has a corner between the elements '//label(before)//' and '//label(e)
            end if
         end associate
      end function link_problem

      pure function label(e) result(string)
         integer, intent(in) :: e
         character(:), allocatable :: string
         string = to_text(model%mesh%element_label(e))
      end function label

      !> True for the last element of a curve: elements of a curve have consecutive indices.
      pure logical function ends_curve(e)
         integer, intent(in) :: e
         ends_curve = e == model%mesh%n_elements
         if (.not. ends_curve) ends_curve = model%mesh%curve(e + 1) /= model%mesh%curve(e)
      end function ends_curve

      !> Angle between the end of one nominal curve and the beginning of the next one.
      pure real(wp) function corner(last, first)
         integer, intent(in) :: last, first ! last element of a curve; first element of the next curve
         real(wp) :: turn
         associate (one => model%curve(model%mesh%curve(last)), next => model%curve(model%mesh%curve(first)))
            turn = curve_angle(next, model%imperfection, 0.0_wp) - curve_angle(one, model%imperfection, one%length)
         end associate
         corner = abs(modulo(turn + pi, 2 * pi) - pi)
      end function corner
   end subroutine follow_chain
end module read_imperfections

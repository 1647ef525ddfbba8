!> Records of converged points: filled from the state, with the path tangent and the independent checks, and passed to the recorder.
module point_recording
   use kinds, only: wp
   use errors, only: error_t
   use problem, only: problem_t
   use rod_state, only: state_t, is_stress_free, pose_of, node_position
   use force_free_contact, only: count_opening
   use path_control, only: path_length, metric
   use monitors, only: monitor_rate, monitor_values
   use path_continuity, only: path_tangent_t, path_tangent_at
   use corrector, only: increment_t
   use path_point, only: path_point_t
   use path_state, only: path_state_t
   use path_outcome, only: outcome_t
   use contact_checks, only: span_sums_t, sum_spans
   use point_checks, only: check_point
   use span_regions, only: assign_place_bars, find_span_regions
   use error_bar, only: error_bars_t
   use error_report, only: note_load
   use path_record, only: recorder_t, point_t, place_t
   use timing, only: count_up, count_largest, counter_points, counter_largest
   use contact_labels, only: contact_gained, contact_lost
   use obstacle_pose, only: pose_t
   use linear_system, only: system_t
   use contact_regions, only: find_regions
   use span_forces, only: node_shares, point_pushes, line_pushes
   use ground_regions, only: ground_reaction, deck_ground_reaction, ground_pressure, foundation_totals
   use deck_nodes, only: deck_displacements, deck_section_forces, deck_gaps, find_node
   use model, only: obstacles_move
   implicit none
   private
   public :: record, report_point

   !> Labels of points at which the path may have a corner.
   character(2), parameter :: has_corner(3) = [contact_gained, contact_lost, 'BP']

contains

   !> Passes a converged point to the recorder and to the independent checks. If the point fails a check, the path ends at it, and
   !> outcome%why says why.
   subroutine record(problem, run, point, label, report, recorder, outcome, touching, bars, smooth, pivots)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(inout) :: run
      type(path_point_t), intent(in) :: point
      character(*), intent(in) :: label !! label of the point: LP, BP, ...; '' for an ordinary point
      type(increment_t), intent(in) :: report
      class(recorder_t), intent(inout) :: recorder
      type(outcome_t), intent(inout) :: outcome
      logical, intent(in), optional :: touching(:) !! (candidates) true: the result shows the node in contact, though its contact
      !! force is still zero
      type(error_bars_t), intent(in), optional :: bars
      logical, intent(in), optional :: smooth !! true: the path is smooth at the point; its tangent is that of the point; absent:
      !! unknown
      integer, intent(in), optional :: pivots !! number of negative pivots just before the point, needed where an eigenvalue may be
      !! zero; absent: the count of the point's own system
      type(point_t) :: row
      type(state_t) :: shown
      type(span_sums_t) :: spans
      type(error_t), allocatable :: error
      type(path_tangent_t) :: tangent
      character(:), allocatable :: wrong
      integer :: m
      integer :: opening                         ! number of unstable directions that open force-free contacts
      logical :: weak, has_tangent
      associate (state => point%state, system => point%system)
         shown = state
         if (present(touching)) shown%active = state%active .or. touching
         spans = sum_spans(problem, state)
         row = report_point(problem, shown, system, spans, run%points, label)
         if (present(pivots)) row%negative_pivots = pivots
         if (present(bars)) row%bars = bars
         has_tangent = present(smooth) .and. .not. any(label == has_corner)
         if (has_tangent) has_tangent = smooth
         if (has_tangent) then
            ! At a limit point rates by the load factor are unbounded; all rates are therefore taken by arc length.
            tangent = path_tangent_at(problem, system, point%tangent%u, point%tangent%load)
            if (metric(problem, tangent%u, tangent%u) > 0.0_wp) row%rate = tangent%load * &
               & [1.0_wp, (monitor_rate(problem, m, state, system), m=1, size(row%monitor))]
         end if
         row%iterations = report%iterations
         row%residual = max(report%residual, system%force_residual)
         row%lcp_size = report%lcp_size
         row%lcp_pivots = report%lcp_pivots
         row%arc_length = run%arc_length + path_length(problem, run%last%state, state)
         call count_opening(problem, state, system, opening, weak)
         row%free_pivots = row%negative_pivots + opening
         ! At the stress-free start no force exists to which the residual could be related; it is recorded as zero.
         if (is_stress_free(state)) row%residual = 0.0_wp
         run%points = run%points + 1
         run%recorded_load = state%load_factor
         if (allocated(run%onset%region) .and. label == contact_gained) row%region = [row%region, run%onset%region]
         if (allocated(row%bars) .and. allocated(row%region)) call assign_place_bars(problem, row%bars, row%region)
         call check_point(problem, state, system, spans, place_t(run%branch, problem%step, run%points, state%load_factor), &
            & merge(run%onset%element, 0, label == contact_gained), row, outcome%accuracy, wrong)
         call note_load(problem%step, state%load_factor, outcome%accuracy)
      end associate
      call count_up(counter_points)
      if (.not. problem%is_sampled()) call count_largest(counter_largest, problem%model%mesh%n_elements)
      call recorder%take(row, error)
      if (allocated(error)) then
         outcome%why = error%message
      else if (wrong /= '') then
         outcome%why = wrong
         outcome%wrong = .true.
      end if
   end subroutine record

   !> Record of a converged state, without iterations, residual and arc length, which `record` adds.
   function report_point(problem, state, system, spans, number, label) result(point)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system     !! assembled and factored at `state`
      type(span_sums_t), intent(in) :: spans   !! forces of the contact spans
      integer, intent(in) :: number !! count of points recorded before this one; every so many points fields (values at all nodes)
      !! are stored
      character(*), intent(in) :: label        !! label of the point; fields are always stored at a point with a label
      type(point_t) :: point
      real(wp), allocatable :: shares(:), u(:, :)
      type(pose_t) :: pose
      integer :: c
      associate (step => problem%model%step(problem%step))
         point%step = problem%step
         point%label = label
         point%load_factor = state%load_factor
         point%negative_pivots = system%negative_pivots
         point%active_contacts = count(state%active) + count(state%grounded)
         point%monitor = monitor_values(problem, state, system)
         if (size(problem%model%contact) > 0) call add_contacts()
         if (obstacles_move(problem%model)) then
            allocate (point%obstacle_shift(2, size(problem%model%obstacle)), point%obstacle_turn(size(problem%model%obstacle)))
            do c = 1, size(problem%model%obstacle)
               pose = pose_of(problem, state, c)
               point%obstacle_shift(:, c) = pose%shift
               point%obstacle_turn(c) = pose%turn
            end do
         end if
         if (step%field_every == 0) return
         if (mod(number, step%field_every) /= 0 .and. label == '') return
         if (allocated(spans%u)) then
            u = spans%u
         else
            u = deck_displacements(problem, state, [(c, c=1, problem%deck%mesh%n_nodes)])
         end if
         if (step%field_displacement) then
            point%displacement = u
            ! An imperfection at the start is part of the displacement, which is measured from the coordinates in the deck.
            point%displacement(1:2, :) = point%displacement(1:2, :) + (problem%deck%mesh%x - problem%coordinates)
         end if
         if (step%field_section_forces) point%section_forces = deck_section_forces(problem, state)
         if (size(problem%model%contact) == 0) return
         if (step%field_reaction .or. step%field_gap) call add_contact_fields()
         if (step%field_reaction .and. problem%has_spans()) then
            point%contact_force = point_pushes(problem, state)
            point%contact_pressure = line_pushes(problem, state)
         end if
      end associate

   contains

      !> Adds the contact regions and the sums of the contact forces.
      subroutine add_contacts()
         real(wp) :: totals(3, size(problem%model%obstacle))
         point%region = find_regions(problem, state)
         if (problem%has_spans()) then
            point%region = [find_span_regions(problem, state), point%region]
            ! A contact span counts as one contact, whatever the number of nodes on it.
            point%active_contacts = size(problem%contact_span) + count(state%active .and. problem%candidates%contact_span == 0) + &
               & count(state%grounded)
         end if
         call foundation_totals(problem, state, system%inner, totals)
         point%obstacle_force = totals(1:2, :) + sum(spans%force(1:2, :, :), 2)
         point%reaction_total = sum(spans%force(3, :, :), 2)
         do c = 1, problem%candidates%n
            if (problem%candidates%contact_span(c) > 0) cycle
            associate (total => point%reaction_total(problem%candidates%contact(c)), &
               & force => point%obstacle_force(:, problem%candidates%obstacle(c)))
               total = total + state%reaction(c)
               force = force + state%reaction(c) * system%normal(:, c)
            end associate
         end do
         allocate (shares(problem%ground%chain%n))
         if (size(shares) > 0) call ground_reaction(problem, state, system%inner, shares)
         do c = 1, size(shares)
            associate (total => point%reaction_total(problem%ground%chain%contact(c)))
               total = total + shares(c)
            end associate
         end do
      end subroutine add_contacts

      !> Adds reactions and gaps of all contacts at the deck's nodes, in the order of the results.
      subroutine add_contact_fields()
         real(wp), allocatable :: reaction(:), density(:), gap(:), place(:, :)
         integer :: n, rows, k
         ! The arrays for the mesh have one row for each node of each contact in the mesh's model. Contact spans have no rows in
         ! them.
         n = sum([(size(problem%model%contact(k)%node), k=1, size(problem%model%contact))])
         allocate (reaction(n), density(n), gap(n), place(2, n), source=0.0_wp)
         call measure_mesh(reaction, density, gap, place)
         if (problem%deck_mesh) then
            ! On the deck's mesh each row belongs to a node of the deck, even if this node has moved along the rod.
            call move_alloc(reaction, point%reaction)
            call move_alloc(density, point%reaction_density)
            call move_alloc(gap, point%gap)
            call move_alloc(place, point%contact_point)
         else
            if (allocated(spans%gap)) then
               point%gap = spans%gap
               point%contact_point = spans%place
            else
               call deck_gaps(problem, state, u, point%gap, point%contact_point)
            end if
            allocate (point%reaction(size(point%gap)), point%reaction_density(size(point%gap)), source=0.0_wp)
            n = 0
            rows = 0
            do k = 1, size(problem%deck%contact)
               associate (node => problem%deck%contact(k)%node)
                  if (problem%deck%contact(k)%spans) then
                     call node_shares(problem, state, k, point%reaction(n + 1:n + size(node)), &
                        & point%reaction_density(n + 1:n + size(node)))
                  else if (problem%model%contact(k)%distributed) then
                     call deck_ground_reaction(problem, state, system%inner, k, point%gap(n + 1:n + size(node)), &
                        & point%reaction(n + 1:n + size(node)), point%reaction_density(n + 1:n + size(node)))
                  else
                     call take_reactions(k, rows, n, reaction, density)
                  end if
                  n = n + size(node)
               end associate
               rows = rows + size(problem%model%contact(k)%node)
            end do
         end if
         if (.not. problem%model%step(problem%step)%field_reaction) deallocate (point%reaction, point%reaction_density)
         if (.not. problem%model%step(problem%step)%field_gap) deallocate (point%gap)
      end subroutine add_contact_fields

      !> Copies the reactions of a contact from nodes of the mesh that coincide with nodes of the deck.
      subroutine take_reactions(contact, mesh_rows, deck_rows, reaction, density)
         integer, intent(in) :: contact
         integer, intent(in) :: mesh_rows, deck_rows !! counts of rows before those of the contact, in the arrays of the mesh and of
         !! the deck
         real(wp), intent(in) :: reaction(:), density(:) !! (rows of the mesh) reaction, and reaction by length of the rod
         integer :: row(problem%model%mesh%n_nodes), i, mesh_node, element
         real(wp) :: tau
         row = 0
         row(problem%model%contact(contact)%node) = [(mesh_rows + i, i=1, size(problem%model%contact(contact)%node))]
         do i = 1, size(problem%deck%contact(contact)%node)
            call find_node(problem, state, problem%deck%contact(contact)%node(i), mesh_node, element, tau)
            if (mesh_node == 0) cycle
            if (row(mesh_node) == 0) cycle
            point%reaction(deck_rows + i) = reaction(row(mesh_node))
            point%reaction_density(deck_rows + i) = density(row(mesh_node))
         end do
      end subroutine take_reactions

      !> Computes reactions, reaction densities and gaps at the nodes of the mesh, with the positions of these nodes.
      subroutine measure_mesh(reaction, density, gap, place)
         real(wp), intent(inout) :: reaction(:), density(:), gap(:), place(:, :) !! reaction, reaction by length, gap (rows of the
         !! mesh); position (2, rows)
         real(wp) :: length
         real(wp), allocatable :: pressure(:), distance(:)
         integer :: side
         associate (list => problem%candidates)
            do c = 1, list%n
               if (list%row(c) == 0) cycle
               length = 0.0_wp
               do side = 1, 2
                  if (list%element(side, c) > 0) length = length + 0.5_wp * state%geometry%element(list%element(side, c))%length
               end do
               reaction(list%row(c)) = state%reaction(c)
               density(list%row(c)) = 0.0_wp
               if (length > 0.0_wp) density(list%row(c)) = state%reaction(c) / length
               gap(list%row(c)) = system%gap(c)
               place(:, list%row(c)) = node_position(state, list%node(c))
            end do
         end associate
         associate (chain => problem%ground%chain)
            allocate (pressure(chain%n), distance(chain%n))
            call ground_pressure(problem, state, pressure, distance)
            do c = 1, chain%n
               reaction(chain%row(c)) = shares(c)
               density(chain%row(c)) = pressure(c)
               gap(chain%row(c)) = distance(c)
               place(:, chain%row(c)) = node_position(state, chain%node(c))
            end do
         end associate
      end subroutine measure_mesh
   end function report_point
end module point_recording

!> Fills the record of one accepted point from the state.
module point_report
   use kinds, only: wp
   use problem, only: problem_t
   use rod_state, only: state_t, obstacle_shift, node_position
   use linear_system, only: system_t
   use monitors, only: monitor_values
   use contact_regions, only: find_regions
   use ground_regions, only: ground_reaction, ground_pressure, foundation_totals
   use deck_nodes, only: deck_node_displacement, deck_section_forces
   use path_record, only: point_t
   use model, only: obstacles_move
   implicit none
   private
   public :: report_point

contains

   !> What the results keep of a converged state; label, iterations and the like are the path loop's.
   function report_point(problem, state, system, number, label) result(point)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system     !! assembled and factored at `state`
      integer, intent(in) :: number            !! points recorded before this one: decides whether fields are due
      character(*), intent(in) :: label        !! points with a label always get their fields
      type(point_t) :: point
      real(wp), allocatable :: shares(:), totals(:, :)
      integer :: c, e
      associate (step => problem%model%step(problem%step))
         point%step = problem%step
         point%label = label
         point%load_factor = state%load_factor
         point%negative_pivots = system%negative_pivots
         point%active_contacts = count(state%active) + count(state%grounded)
         point%monitor = monitor_values(problem, state, system)
         if (size(problem%model%contact) > 0) then
            point%region = find_regions(problem, state)
            allocate (point%reaction_total(size(problem%model%contact)), source=0.0_wp)
            allocate (totals(3, size(problem%model%obstacle)))
            call foundation_totals(problem, state, totals)
            point%obstacle_force = totals(1:2, :)
            do c = 1, problem%candidates%n
               associate (total => point%reaction_total(problem%candidates%contact(c)), &
                  & force => point%obstacle_force(:, problem%candidates%obstacle(c)))
                  total = total + state%reaction(c)
                  force = force + state%reaction(c) * system%normal(:, c)
               end associate
            end do
            if (problem%ground%chain%n > 0) then
               allocate (shares(problem%ground%chain%n))
               call ground_reaction(problem, state, shares)
               do c = 1, problem%ground%chain%n
                  associate (total => point%reaction_total(problem%ground%chain%contact(c)))
                     total = total + shares(c)
                  end associate
               end do
            end if
         end if
         if (obstacles_move(problem%model)) then
            allocate (point%obstacle_shift(2, size(problem%model%obstacle)))
            do c = 1, size(problem%model%obstacle)
               point%obstacle_shift(:, c) = obstacle_shift(problem, state, c)
            end do
         end if
         if (step%field_every == 0) return
         if (mod(number, step%field_every) /= 0 .and. label == '') return
         if (step%field_displacement) then
            allocate (point%displacement(3, problem%model%mesh%n_nodes))
            do c = 1, problem%model%mesh%n_nodes
               point%displacement(:, c) = deck_node_displacement(problem, state, c)
            end do
            ! An imperfection that the path began with is a part of it: what takes the deck's node to where it is.
            point%displacement(1:2, :) = point%displacement(1:2, :) + (problem%model%mesh%x - problem%coordinates)
         end if
         if (step%field_section_forces) then
            allocate (point%section_forces(3, 2, problem%model%mesh%n_elements))
            do e = 1, problem%model%mesh%n_elements
               call deck_section_forces(problem, state, e, point%section_forces(:, :, e))
            end do
         end if
         if (size(problem%model%contact) == 0) return
         if (step%field_reaction .or. step%field_gap) call add_contact_fields()
      end associate

   contains

      !> Reactions and gaps at the nodes of all contacts, in the order of the results.
      subroutine add_contact_fields()
         real(wp) :: share, density, length
         real(wp), allocatable :: pressure(:), distance(:)
         integer :: n, side
         n = problem%candidates%n + problem%ground%chain%n
         allocate (point%reaction(n), point%reaction_density(n), point%gap(n), point%contact_point(2, n))
         associate (list => problem%candidates)
            do c = 1, list%n
               length = 0.0_wp
               do side = 1, 2
                  if (list%element(side, c) > 0) length = length + 0.5_wp * state%geometry%element(list%element(side, c))%length
               end do
               share = state%reaction(c)
               density = 0.0_wp
               if (length > 0.0_wp) density = share / length
               point%reaction(list%row(c)) = share
               point%reaction_density(list%row(c)) = density
               point%gap(list%row(c)) = system%gap(c)
               point%contact_point(:, list%row(c)) = node_position(state, list%node(c))
            end do
         end associate
         associate (chain => problem%ground%chain)
            allocate (pressure(chain%n), distance(chain%n))
            if (chain%n > 0) call ground_pressure(problem, state, pressure, distance)
            do c = 1, chain%n
               point%reaction(chain%row(c)) = shares(c)
               point%reaction_density(chain%row(c)) = pressure(c)
               point%gap(chain%row(c)) = distance(c)
               point%contact_point(:, chain%row(c)) = node_position(state, chain%node(c))
            end do
         end associate
         if (.not. problem%model%step(problem%step)%field_reaction) deallocate (point%reaction, point%reaction_density)
         if (.not. problem%model%step(problem%step)%field_gap) deallocate (point%gap)
      end subroutine add_contact_fields
   end function report_point
end module point_report

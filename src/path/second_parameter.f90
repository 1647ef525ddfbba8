!> The parameter that a limit curve varies besides the load factor: the problem for each of its values.
module second_parameter
   use kinds, only: wp
   use model, only: limit_curve_t, parameter_modulus, parameter_gap, parameter_imperfection, parameter_ea, parameter_ei, &
      & parameter_constant_load
   use text, only: same_name
   use imperfect_mesh, only: move_to_curves
   use problem, only: problem_t, new_problem
   use candidates, only: candidates_t
   use ground_regions, only: ground_reaction
   use rod_state, only: state_t
   use rod_geometry, only: new_geometry, slide_node
   implicit none
   private
   public :: present_value, problem_at, rigid_problem, carry_state

contains

   !> Value of the parameter in the problem of the deck: 1 for the factors.
   pure real(wp) function present_value(problem, curve) result(value)
      type(problem_t), intent(in) :: problem
      type(limit_curve_t), intent(in) :: curve
      integer :: i
      value = 1.0_wp
      select case (curve%parameter)
      case (parameter_modulus)
         value = problem%model%obstacle(curve%obstacle)%modulus
      case (parameter_gap)
         do i = 1, size(problem%model%contact)
            if (problem%model%contact(i)%obstacle == curve%obstacle) value = problem%model%contact(i)%gap
         end do
      case (parameter_ea, parameter_ei)
         do i = 1, size(problem%model%section)
            if (.not. same_name(problem%model%section(i)%name, curve%set)) cycle
            value = problem%model%section(i)%ea
            if (curve%parameter == parameter_ei) value = problem%model%section(i)%ei
         end do
      end select
   end function present_value

   !> The problem with another value of the parameter.
   function problem_at(base, curve, value) result(problem)
      type(problem_t), intent(in) :: base       !! of the deck
      type(limit_curve_t), intent(in) :: curve
      real(wp), intent(in) :: value
      type(problem_t) :: problem
      integer :: i, k
      problem = base
      select case (curve%parameter)
      case (parameter_modulus)
         problem%model%obstacle(curve%obstacle)%modulus = value
      case (parameter_gap)
         where (problem%model%contact%obstacle == curve%obstacle) problem%model%contact%gap = value
      case (parameter_imperfection)
         k = problem%model%curve(problem%model%mesh%curve(curve%element(1)))%imperfection
         associate (shape => problem%model%imperfection(k))
            shape%amplitude = value * shape%amplitude
            if (allocated(shape%bend)) shape%bend = value * shape%bend
         end associate
         call move_to_curves(problem%model)
      case (parameter_ea, parameter_ei)
         do i = 1, size(problem%model%section)
            associate (section => problem%model%section(i))
               if (.not. same_name(section%name, curve%set)) cycle
               if (curve%parameter == parameter_ea) section%ea = value
               if (curve%parameter == parameter_ei) section%ei = value
            end associate
         end do
      case (parameter_constant_load)
         problem%constant%node_force = value * base%constant%node_force
         problem%constant%line_force = value * base%constant%line_force
         problem%constant%pressure = value * base%constant%pressure
         problem%constant%strain = value * base%constant%strain
         problem%constant%curvature = value * base%constant%curvature
         problem%constant%displacement = value * base%constant%displacement
         problem%constant%motion = value * base%constant%motion
         problem%constant%closing = value * base%constant%closing
         problem%constant%resolved = value * base%constant%resolved
         return
      end select
      call derive_again(base, problem)
   end function problem_at

   !> The problem with the curve's obstacle rigid, its reactions at the nodes.
   function rigid_problem(base, curve) result(problem)
      type(problem_t), intent(in) :: base
      type(limit_curve_t), intent(in) :: curve
      type(problem_t) :: problem
      problem = base
      problem%model%obstacle(curve%obstacle)%rigid = .true.
      where (problem%model%contact%obstacle == curve%obstacle) problem%model%contact%distributed = .false.
      call derive_again(base, problem)
   end function rigid_problem

   !> Everything that follows from the model; what the steps before left behind stays.
   subroutine derive_again(base, problem)
      type(problem_t), intent(in) :: base
      type(problem_t), intent(inout) :: problem
      type(problem_t) :: fresh
      fresh = new_problem(problem%model)
      fresh%constant = base%constant
      fresh%step = base%step
      fresh%coordinates = base%coordinates
      ! One metric for the whole curve.
      fresh%weight = base%weight
      fresh%size = base%size
      problem = fresh
   end subroutine derive_again

   !> A state of one problem as a first guess for another one: every node stays where it is in space.
   function carry_state(from, to, state) result(carried)
      type(problem_t), intent(in) :: from, to
      type(state_t), intent(in) :: state
      type(state_t) :: carried
      real(wp) :: shift, turn
      integer :: c, e, i, node
      logical :: done(size(state%u, 2))
      carried = state
      carried%geometry = new_geometry(to%model, to%tableau)
      if (to%candidates%n /= from%candidates%n) call touch_nodes()
      do c = 1, from%candidates%n
         if (.not. from%candidates%may_slide(c)) cycle
         associate (element => from%candidates%element(:, c))
            shift = state%geometry%element(element(1))%s(2) - from%model%mesh%s(2, element(1))
            ! Candidates for two obstacles share their node.
            if (abs(carried%geometry%element(element(1))%s(2) - to%model%mesh%s(2, element(1))) > 0.0_wp) cycle
            if (abs(shift) > 0.0_wp) call slide_node(to%model, to%tableau, carried%geometry, element, shift)
         end associate
      end do
      carried%u(1:2, :) = state%u(1:2, :) + (state%geometry%x - carried%geometry%x)
      done = .false.
      do e = 1, to%model%mesh%n_elements
         do i = 1, 2
            node = to%model%mesh%node(i, e)
            if (done(node)) cycle
            done(node) = .true.
            turn = state%geometry%element(e)%end_angle(i) - carried%geometry%element(e)%end_angle(i)
            carried%u(3, node) = state%u(3, node) + turn
         end do
      end do

   contains

      !> Contact at nodes instead of inside elements: those that the foundation pushes.
      subroutine touch_nodes()
         integer :: k, place
         real(wp) :: share(from%ground%chain%n)
         call ground_reaction(from, state, share)
         carried%grounded = to%ground%founded
         ! The forces at the stages follow the others and are no longer stored.
         deallocate (carried%z)
         allocate (carried%z(maxval(to%z_size), size(state%z, 2)), source=0.0_wp)
         k = min(size(state%z, 1), size(carried%z, 1))
         carried%z(:k, :) = state%z(:k, :)
         deallocate (carried%active, carried%reaction)
         allocate (carried%active(to%candidates%n), source=.false.)
         allocate (carried%reaction(to%candidates%n), source=0.0_wp)
         do k = 1, to%candidates%n
            do place = 1, from%candidates%n
               if (.not. same_place(from%candidates, place, k)) cycle
               carried%active(k) = state%active(place)
               carried%reaction(k) = state%reaction(place)
            end do
            do place = 1, from%ground%chain%n
               if (.not. same_place(from%ground%chain, place, k)) cycle
               carried%active(k) = share(place) > 0.0_wp
               carried%reaction(k) = share(place)
            end do
         end do
      end subroutine touch_nodes

      logical function same_place(list, candidate, new)
         type(candidates_t), intent(in) :: list
         integer, intent(in) :: candidate, new
         same_place = list%node(candidate) == to%candidates%node(new) .and. &
            & list%contact(candidate) == to%candidates%contact(new)
      end function same_place
   end function carry_state
end module second_parameter

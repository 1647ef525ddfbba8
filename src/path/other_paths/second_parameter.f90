!> The second parameter of a limit curve, which varies besides the load factor, and the problem for each value of this parameter.
module second_parameter
   use kinds, only: wp
   use imperfection, only: scale_imperfection
   use model, only: model_t, limit_curve_t, parameter_modulus, parameter_gap, parameter_imperfection, parameter_ea, parameter_ei, &
      & parameter_constant_load
   use text, only: same_name
   use rod_layout, only: new_layout
   use imperfect_mesh, only: move_to_curves
   use problem, only: problem_t, copy_problem, new_problem, derive_problem
   use span_problem, only: same_spans, place_spans
   use candidates, only: candidates_t
   use element_foundation, only: all_foundation_forces
   use ground_regions, only: ground_reaction
   use force_law, only: segment_unknown
   use rod_state, only: state_t, unknown_push
   use rod_geometry, only: new_geometry, shift_nodes
   implicit none
   private
   public :: present_value, problem_at, rigid_problem, carry_state

contains

   !> Present value of the parameter; 1 for a parameter that is a factor of values given in the deck.
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
      type(problem_t), intent(in) :: base       !! the problem with the value of the parameter from the deck
      type(limit_curve_t), intent(in) :: curve
      real(wp), intent(in) :: value !! new value of the parameter
      type(problem_t) :: problem
      integer :: k
      call copy_problem(base, problem)
      if (curve%parameter == parameter_constant_load) then
         problem%constant = base%constant%scaled(value)
         return
      end if
      ! The deck's element numbers refer to the deck's mesh; *CURVE definitions have the same numbers on every mesh.
      k = 0
      if (curve%parameter == parameter_imperfection) k = base%deck%curve(base%deck%mesh%curve(curve%element(1)))%imperfection
      call set_value(problem%deck, curve, value, k)
      if (.not. base%moves_nodes()) call set_value(problem%model, curve, value, k, problem%deck)
      if (k > 0) problem%layout = new_layout(problem%deck)
      if (base%moves_nodes()) then
         call lay_spans_again(base, problem)
      else
         call derive_again(base, problem)
      end if
   end function problem_at

   !> Sets a parameter of a model; factors of the loads are set elsewhere.
   subroutine set_value(model, curve, value, imperfection, deck)
      type(model_t), intent(inout) :: model
      type(limit_curve_t), intent(in) :: curve
      real(wp), intent(in) :: value
      integer, intent(in) :: imperfection       !! index of the imperfection that is varied
      type(model_t), intent(in), optional :: deck !! the deck's model with this value; present if `model` is the model on another
      !! mesh
      integer :: i
      select case (curve%parameter)
      case (parameter_modulus)
         model%obstacle(curve%obstacle)%modulus = value
      case (parameter_gap)
         where (model%contact%obstacle == curve%obstacle) model%contact%gap = value
      case (parameter_imperfection)
         if (.not. present(deck)) call scale_imperfection(model%imperfection(imperfection), value)
         call move_to_curves(model, deck)
      case (parameter_ea, parameter_ei)
         do i = 1, size(model%section)
            associate (section => model%section(i))
               if (.not. same_name(section%name, curve%set)) cycle
               if (curve%parameter == parameter_ea) section%ea = value
               if (curve%parameter == parameter_ei) section%ei = value
            end associate
         end do
      end select
   end subroutine set_value

   !> The problem with a rigid obstacle in place of the curve's foundation, and contact at nodes.
   function rigid_problem(base, curve) result(problem)
      type(problem_t), intent(in) :: base
      type(limit_curve_t), intent(in) :: curve
      type(problem_t) :: problem
      call copy_problem(base, problem)
      problem%deck%obstacle(curve%obstacle)%rigid = .true.
      problem%model%obstacle(curve%obstacle)%rigid = .true.
      where (problem%deck%contact%obstacle == curve%obstacle) problem%deck%contact%distributed = .false.
      where (problem%model%contact%obstacle == curve%obstacle) problem%model%contact%distributed = .false.
      call derive_again(base, problem)
   end function rigid_problem

   !> Makes a mesh for a changed deck, with the contact spans of `base`.
   subroutine lay_spans_again(base, problem)
      type(problem_t), intent(in) :: base
      type(problem_t), intent(inout) :: problem !! the problem; in: its deck and layout are already changed; out: also its mesh
      call place_spans(new_problem(problem%deck), problem)
      problem = same_spans(problem, base)
      problem%weight = base%weight
   end subroutine lay_spans_again

   !> Derives the data that depend on the model; data left by previous steps are kept.
   subroutine derive_again(base, problem)
      type(problem_t), intent(in) :: base
      type(problem_t), intent(inout) :: problem
      call derive_problem(problem)
      ! All points of a limit curve use the same metric.
      problem%weight = base%weight
      problem%size = base%size
   end subroutine derive_again

   !> Transfers a state to another problem as a predictor. Every node keeps its deformed position.
   function carry_state(from, to, state) result(carried)
      type(problem_t), intent(in) :: from, to
      type(state_t), intent(in) :: state
      type(state_t) :: carried
      real(wp) :: turn, shifts(to%model%mesh%n_nodes)
      integer :: e, i, node
      logical :: done(size(state%u, 2))
      carried = state
      carried%geometry = new_geometry(to%model)
      if (to%moves_nodes()) then
         ! The nodes are moved along the rod to the material points at which they were in the former state.
         do node = 1, to%model%mesh%n_nodes
            e = from%beside(1, node)
            shifts(node) = 0.0_wp
            if (e > 0) shifts(node) = state%geometry%element(e)%s(2) - from%model%mesh%s(2, e)
         end do
         call shift_nodes(to%model, to%tableau, shifts, carried%geometry)
      else if (to%candidates%n /= from%candidates%n) then
         call touch_nodes()
      end if
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

      !> Replaces foundation contact inside elements by contact at nodes: those at which the foundation exerts pressure.
      subroutine touch_nodes()
         integer :: k, place
         real(wp) :: share(from%ground%chain%n)
         call ground_reaction(from, state, all_foundation_forces(from, state), share)
         carried%grounded = to%ground%founded
         carried%segment = spread(segment_unknown, 1, to%ground%chain%n)
         carried%push = spread(spread(unknown_push, 1, size(state%push, 1)), 2, to%ground%chain%n)
         ! The foundation forces at the Gauss points are stored behind all other unknowns of an element; the new problem has no such
         ! forces.
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

      !> True if two candidates belong to the same node and the same contact.
      logical function same_place(list, candidate, new)
         type(candidates_t), intent(in) :: list
         integer, intent(in) :: candidate, new
         same_place = list%node(candidate) == to%candidates%node(new) .and. list%contact(candidate) == to%candidates%contact(new)
      end function same_place
   end function carry_state
end module second_parameter

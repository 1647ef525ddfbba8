!> Resultants of the loads on elements, computed directly from the definition of the loads.
module rod_load_sum
   use kinds, only: wp
   use problem, only: problem_t
   use rod_state, only: state_t, node_position, element_load
   use element_families, only: collocates
   use gauss_tableau, only: max_stages
   use rod_load, only: ge_load_t, line_at_stage
   use ge_in_state, only: ge_at
   use ge_stages, only: ge_directions
   use conforming_span, only: conforming_state_t, conforming_forces
   implicit none
   private
   public :: load_on_rod

contains

   !> Resultant force (x, y) of the loads on an element, and their moment about a point.
   function load_on_rod(problem, state, e, middle) result(total)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: e
      real(wp), intent(in) :: middle(2)        !! the point
      real(wp) :: total(3), x(2, 2), place(2, max_stages), direction(2, max_stages), line(2), rate(2)
      type(ge_load_t) :: load
      integer :: i, s
      load = element_load(problem, state, e)
      total = 0.0_wp
      if (.not. allocated(load%more) .and. all(abs([load%line, load%pressure, load%gradient]) <= 0.0_wp)) return
      do i = 1, 2
         x(:, i) = node_position(state, problem%model%mesh%node(i, e)) - middle
      end do
      s = problem%model%mesh%stages(e)
      associate (g => state%geometry%element(e), tab => problem%tableau(max(s, 1)))
         if (.not. collocates(problem%model%mesh%family(e))) then
            call line_at_stage(load, 1, line, rate)
            call add(0.5_wp * (x(:, 1) + x(:, 2)), g%length * line + load%pressure * [x(2, 1) - x(2, 2), x(1, 2) - x(1, 1)])
            return
         end if
         if (problem%conforms(e) > 0) then
            place(:, :s) = conforming_places(problem, state, e, tab%c(:s)) - spread(middle, 2, s)
         else
            direction = ge_directions(tab, ge_at(problem, state, e))
            direction(:, :s) = g%scale * direction(:, :s)
            place(:, :s) = spread(x(:, 1), 2, s) + g%length * matmul(direction(:, :s), transpose(tab%a(:s, :s)))
         end if
         do i = 1, s
            call line_at_stage(load, i, line, rate)
            if (problem%conforms(e) == 0) line = line + (load%pressure + dot_product(load%gradient, place(:, i) - x(:, 1))) * &
               & [-direction(2, i), direction(1, i)]
            call add(place(:, i), g%length * tab%b(i) * line)
         end do
      end associate
      ! The resultant of the pressure on a conforming element depends only on the positions of the ends.
      if (problem%conforms(e) > 0) total = total + load%pressure * [x(2, 1) - x(2, 2), x(1, 2) - x(1, 1), &
         & 0.5_wp * (dot_product(x(:, 2), x(:, 2)) - dot_product(x(:, 1), x(:, 1)))]

   contains

      !> Adds a force at a place, measured from the point.
      subroutine add(place, force)
         real(wp), intent(in) :: place(2), force(2)
         total = total + [force, place(1) * force(2) - place(2) * force(1)]
      end subroutine add
   end function load_on_rod

   !> Deformed positions of points of a conforming element. A separate procedure, because its work arrays take time to set up.
   pure function conforming_places(problem, state, e, tau) result(place)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: e
      real(wp), intent(in) :: tau(:)           !! places in the element, 0 to 1 of its stress-free length
      real(wp) :: place(2, size(tau)), local(3)
      type(conforming_state_t) :: kept
      integer :: i
      do i = 1, size(tau)
         call conforming_forces(problem, state, e, tau(i), local, place(:, i), kept=kept)
      end do
   end function conforming_places
end module rod_load_sum

!> End of a limit curve over the modulus of a foundation: the limit point with a rigid obstacle. The parts of the rods that carry
!> pressure become contact spans, or contact at nodes if rods or deck do not allow contact spans.
module limit_rigid
   use kinds, only: wp
   use model, only: model_t, limit_curve_t
   use problem, only: problem_t, copy_problem, new_problem
   use rod_state, only: state_t
   use contact_spans, only: contact_span_t, choose_spans
   use span_problem, only: new_span_problem, place_spans
   use span_candidates, only: present_contact_spans
   use ground_mark, only: cut_t
   use ground_cuts, only: find_cuts
   use ground_segments, only: segment_at
   use force_law, only: carries
   use second_parameter, only: rigid_problem, carry_state
   use limit_marks, only: take_marks_off, transfer_and_solve
   implicit none
   private
   public :: make_rigid

contains

   !> Makes the obstacle of the curve rigid. With contact spans the returned state is in equilibrium; with contact at nodes it is
   !> only a predictor.
   subroutine make_rigid(curve, problem, state, direction, ok)
      type(limit_curve_t), intent(in) :: curve
      type(problem_t), intent(inout) :: problem  !! in: problem at the last limit point; out: the problem with a rigid obstacle
      type(state_t), intent(inout) :: state
      real(wp), allocatable, intent(inout) :: direction(:, :) !! (3, nodes) displacements of the direction along the path
      logical, intent(out) :: ok                 !! false: no equilibrium was found
      type(model_t) :: deck
      deck = problem%deck
      deck%obstacle(curve%obstacle)%rigid = .true.
      where (deck%contact%obstacle == curve%obstacle)
         deck%contact%along = deck%contact%distributed
         deck%contact%distributed = .false.
      end where
      call choose_spans(deck)
      if (all(deck%contact%along .or. deck%contact%obstacle /= curve%obstacle)) then
         call make_line_contacts()
      else
         call take_marks_off(problem, state, direction, ok)
         if (ok) call use_contact_at_nodes()
      end if

   contains

      !> Makes contact at the nodes instead of contact spans.
      subroutine use_contact_at_nodes()
         type(problem_t) :: next
         next = rigid_problem(problem, curve)
         state = carry_state(problem, next, state)
         call copy_problem(next, problem)
      end subroutine use_contact_at_nodes

      !> Replaces the foundation contact that carries pressure by line contacts.
      subroutine make_line_contacts()
         type(problem_t) :: base
         type(contact_span_t), allocatable :: contact_span(:)
         call copy_problem(problem, base)
         base%deck = deck
         call place_spans(new_problem(deck), base)
         contact_span = present_contact_spans(problem, state)
         call transfer_and_solve(new_span_problem(base, [contact_span, pressed_lines(maxval([0, contact_span%number]))], state), &
            & problem, state, direction, ok)
      end subroutine make_line_contacts

      !> Line contacts on the obstacle of the curve: the parts of each rod segment that carry pressure.
      function pressed_lines(last) result(line)
         integer, intent(in) :: last !! largest identity number of a contact span so far; new line contacts continue from it
         type(contact_span_t), allocatable :: line(:)
         type(cut_t), allocatable :: cut(:)
         real(wp), allocatable :: at(:)
         real(wp) :: stiffness
         integer :: contact, rod_segment, k, i, segment
         logical :: before
         allocate (line(0))
         cut = find_cuts(problem, state)
         do contact = 1, size(problem%deck%contact)
            if (problem%deck%contact(contact)%obstacle /= curve%obstacle) cycle
            do rod_segment = 1, size(problem%layout%rod_segment)
               at = [0.0_wp, pack(cut%at, cut%rod_segment == rod_segment .and. cut%contact == contact .and. .not. cut%at_end), &
                  & problem%layout%rod_segment(rod_segment)%length]
               before = .false.
               do k = 1, size(at) - 1
                  call segment_at(problem, state, rod_segment, contact, 0.5_wp * (at(k) + at(k + 1)), segment, stiffness)
                  i = size(line)
                  if (carries(segment) .and. before) then
                     line(i)%at(2) = at(k + 1)
                  else if (carries(segment)) then
                     line = [line, contact_span_t(number=last + i + 1, contact=contact, rod_segment=rod_segment, at=at(k:k + 1), &
                        & line=.true.)]
                  end if
                  before = carries(segment)
               end do
            end do
         end do
      end function pressed_lines
   end subroutine make_rigid
end module limit_rigid

!> Change of the contact set at the zero of a test function by a rule, and the path tangent with which the run continues.
module span_set
   use kinds, only: wp
   use problem, only: problem_t
   use contact_spans, only: contact_span_t
   use span_candidates, only: present_contact_spans
   use test_kinds, only: span_test_t, test_words, test_length
   use span_answer, only: answer_t
   use span_mesh, only: mesh_for_spans
   use held_openings, only: begin_span
   use beginning_contacts, only: candidate_of
   use shrunk_line, only: come_to_rest
   use flat_points, only: curving_rate
   use path_control, only: is_arc_length
   use path_continuity, only: path_tangent_at
   use path_point, only: evaluate_tests
   use path_state, only: path_state_t, path_tangent_of
   implicit none
   private
   public :: change_set

contains

   !> Continues with the set that the test's rule gives, in the sense in which the path arrives or, behind a line contact that has
   !> become a point contact, in which the relative curvature grows.
   subroutine change_set(problem, run, test, answer, reach, why)
      type(problem_t), intent(inout) :: problem  !! undefined if no equilibrium is found
      type(path_state_t), intent(inout) :: run   !! in: at the zero of the test; undefined if no equilibrium is found
      type(span_test_t), intent(in) :: test      !! the test at this zero, a length or a distance from a segment boundary
      type(answer_t), intent(in) :: answer       !! rule's answer to the test
      real(wp), intent(in) :: reach              !! largest path distance to the equilibrium with the new set
      character(:), allocatable, intent(out) :: why !! reason why no equilibrium was found; not allocated: it was found
      type(contact_span_t) :: old, now(size(problem%contact_span))
      integer :: pivots
      logical :: ok
      logical :: leaves                          ! a line contact became a point, and the run has moved past this point
      now = present_contact_spans(problem, run%last%state)
      old = now(test%contact_span)
      pivots = run%last%test_values%negative_pivots
      leaves = .false.
      run%spans_begun = max(run%spans_begun, maxval(answer%contact_span%number))
      call mesh_for_spans(problem, run, answer%contact_span)
      ok = run%last%system%ok
      if (ok) then
         if (size(answer%crosses, 2) > 0) then
            call begin_span(problem, run, answer%crosses(:, 1), ok, answer%crosses(:, 2:))
         else
            call come_to_rest(problem, run, candidate_of(problem, old%number), reach, leaves)
         end if
      end if
      if (.not. ok) then
         why = 'no way on from where '//trim(test_words(test%kind))
         return
      end if
      if (leaves) then
         run%last%tangent = path_tangent_at(problem, run%last%system, 0.0_wp * run%last%state%u, &
            & sign(1.0_wp, curving_rate(problem, run%last, candidate_of(problem, old%number))))
      else if (is_arc_length(run%control%method)) then
         run%last%tangent = path_tangent_at(problem, run%last%system, run%last%tangent%u, run%last%tangent%load)
      else
         run%last%tangent = path_tangent_of(problem, run, run%last)
      end if
      call evaluate_tests(problem, run%last)
      ! Where a line contact has become a point contact, a free span beside it may be in neutral equilibrium, so that its pivot has
      ! no certain sign; the pivot count with the line contact is kept.
      run%since_change%shrunk = test%kind == test_length
      if (run%since_change%shrunk) run%last%test_values%negative_pivots = pivots
      run%since_change%arrives = .true.
   end subroutine change_set
end module span_set

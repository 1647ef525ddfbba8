!> Stored pressures of foundations that are too stiff for pressures computed from displacements.
!>
!> A pressure computed from the gap has the rounding error of the displacements times the stiffness. Newton's equations also give
!> the change of each pressure, with the rounding error of the increment only. Each pressure is therefore stored with the state and
!> updated in each step, as in mixed formulations, as long as it agrees with its gap up to rounding.
!>
!> Newton's method may fail on foundations that are too stiff for the length of their elements or for the rounding error of gaps.
module ground_pressures
   use kinds, only: wp
   use problem, only: problem_t
   use rod_state, only: state_t
   use linear_system, only: system_t, worst_round_off, to_global
   use bordered_system, only: resultant_rates
   use rod_profile, only: profile_t, new_profile, profile_rate
   use force_law, only: carries
   use text, only: to_text, rounded
   use element_families, only: collocates
   use ground_segments, only: stiffest, decay_length
   implicit none
   private
   public :: advance_pressures, why_too_stiff

   character(*), parameter :: remedy = ' a smaller MODULUS, or a rigid *OBSTACLE (without FOUNDATION)'

contains

   !> Updates the stored pressures after a Newton step.
   subroutine advance_pressures(problem, system, x, y, before, after)
      type(problem_t), intent(in) :: problem
      type(system_t), intent(in) :: system          !! assembled at `before`
      real(wp), intent(in) :: x(:), y               !! unknowns and load factor of the step, as returned by solve_bordered
      type(state_t), intent(in) :: before
      type(state_t), intent(inout) :: after
      type(profile_t) :: profile
      real(wp) :: rate(size(system%op, 1), problem%model%mesh%n_elements), du(6), change(3)
      integer :: e, i, q, z, place(problem%ground%chain%n)
      rate = resultant_rates(problem, system, x, y)
      place = 0
      do e = 1, problem%model%mesh%n_elements
         if (.not. problem%ground%founded(e)) cycle
         if (.not. any([(carries(before%segment(problem%ground%candidate(i))), &
            & i=problem%ground%first(e), problem%ground%first(e + 1) - 1)])) cycle
         profile = new_profile(problem, before, e)
         z = problem%z_size(e)
         rate(:z, e) = rate(:z, e) + system%op(:z, 7, e)
         du(1:3) = to_global(problem, system, x, problem%model%mesh%node(1, e))
         du(4:6) = to_global(problem, system, x, problem%model%mesh%node(2, e))
         do q = 1, system%inner(e)%n
            associate (at => system%inner(e)%at(q), c => system%inner(e)%at(q)%source)
               if (.not. carries(before%segment(c))) cycle
               place(c) = place(c) + 1
               change = profile_rate(problem, before, profile, at%tau, du, rate(:z, e), y)
               after%push(place(c), c) = at%pressure + at%spring * (y * at%approach - dot_product(at%normal, change(1:2)))
            end associate
         end do
      end do
   end subroutine advance_pressures

   !> Message that explains why Newton's method may fail because of a foundation; '' if no foundation is too stiff.
   function why_too_stiff(problem, state, system) result(why)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system     !! assembled at `state`
      character(:), allocatable :: why
      real(wp) :: number, worst
      integer :: e, i, element, obstacle
      why = ''
      if (system%gap_noise > worst_round_off) then
         why = 'foundations are so stiff that the rounding of their gaps makes '//rounded(system%gap_noise)// &
            & ' of all forces; give larger loads,'//remedy
         return
      end if
      worst = 1.0_wp
      element = 0
      obstacle = 0
      do e = 1, problem%model%mesh%n_elements
         if (.not. (state%grounded(e) .or. system%inner(e)%n > 0)) cycle
         if (.not. collocates(problem%model%mesh%family(e))) cycle
         do i = problem%ground%first(e), problem%ground%first(e + 1) - 1
            associate (o => problem%ground%chain%obstacle(problem%ground%candidate(i)))
               number = (state%geometry%element(e)%length / decay_length(problem%model%section(problem%model%mesh%section(e)), &
                  & problem%model%obstacle(o), problem%ground%slope(o)))**4 / stiffest(problem%model%mesh%stages(e))
               if (number <= worst) cycle
               worst = number
               element = e
               obstacle = o
            end associate
         end do
      end do
      if (element == 0) return
      associate (along => problem%model%obstacle(obstacle)%along_rod, most => stiffest(problem%model%mesh%stages(element)))
         why = 'foundation '//trim(problem%model%obstacle(obstacle)%name)//' is too stiff for element '// &
            & to_text(problem%model%mesh%element_label(element))//': '//trim(merge('k h^2/EA', 'k h^4/EI', along))//' is '// &
            & rounded(merge(sqrt(worst * most), worst * most, along))//', its order resolves up to '// &
            & rounded(merge(sqrt(most), most, along))//'; give shorter elements,'//remedy
      end associate
   end function why_too_stiff
end module ground_pressures

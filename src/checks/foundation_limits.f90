!> Foundations that are too stiff for the length of their elements or for the rounding error of gaps.
module foundation_limits
   use kinds, only: wp
   use text, only: to_text, rounded
   use problem, only: problem_t
   use element_families, only: collocates
   use rod_state, only: state_t
   use linear_system, only: system_t, worst_round_off
   use ground_segments, only: stiffest, decay_length
   implicit none
   private
   public :: why_too_stiff

   character(*), parameter :: remedy = ' a smaller MODULUS, or a rigid *OBSTACLE (without FOUNDATION)'

contains

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
         if (.not. (state%grounded(e) .or. system%grip(e) > 0)) cycle
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
end module foundation_limits

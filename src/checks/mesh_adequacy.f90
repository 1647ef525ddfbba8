!> Adequacy of the mesh where an obstacle constrains a rod at its nodes only.
!>
!> Between the nodes the rod bends freely although the obstacle would support it, and a compressed rod bends in waves of the length
!> 2 pi (EI/N)^(1/2). With mu = N h^2/EI (N > 0 in compression), an element of length h can be inadequate in four ways. Each has a
!> measure and a limit of this measure; `wanted` is the accepted relative error of a load:
!>
!> - buckled:  with both nodes in contact the element buckles through the obstacle between them, alternately to both sides, at
!>             mu = pi^2 (elements whose stages represent bending: GE4 and higher).
!> - unheld:   where contact ends on a node, the next node to lift leaves a span of 2 h, in the worst case hinged at both ends, that
!>             buckles at 4 mu = pi^2. At half of this load the span's deflection by lateral forces is doubled.
!> - unbent:   an element represents waves with a relative error of the load of mu/12 (order 2: its stress stiffness is that of
!>             a string) or 2 mu^s s!^2 / ((2s)! (2s + 1)!) (s Gauss stages: twice the phase error of the diagonal Pade
!>             approximant). This applies to elements that lift and to elements between two contacts.
!> - slack:    in contact along a curve kappa, the obstacle's force N kappa bends the element outwards, N kappa h^4/(720 EI) on
!>             average, and shortens it like an axial flexibility kappa^2 h^4/(720 EI) (GE6 and higher: two stages are where
!>             this moment vanishes). Loads at which rods lift from a rigid wall are proportional to EA^(2/5) (Glock 1977), so
!>             the strain energy of this deflection may be 5/2 of `wanted` of the whole strain energy.
module mesh_adequacy
   use kinds, only: wp, pi
   use text, only: to_text
   use problem, only: problem_t
   use rod_state, only: state_t, candidate_gap, rod_direction
   use rod_equations, only: end_forces, local_forces
   use columns, only: scientific
   implicit none
   private
   public :: adequacy_t, measure_adequacy, adequacy_words, compression

   real(wp), parameter :: wanted = 0.01_wp !! accepted relative error of a load
   integer, parameter :: buckled = 1, unheld = 2, unbent = 3, slack = 4
   real(wp), parameter :: limits(4) = [pi**2, pi**2 / 8.0_wp, wanted, 2.5_wp * wanted]

   !> That one of the four measures of the header that is worst in a state, relative to its limit.
   type :: adequacy_t
      real(wp) :: ratio = 0.0_wp              !! worst measure over its limit; above 1 the mesh is too coarse
      real(wp) :: value = 0.0_wp              !! value of the worst measure
      real(wp) :: limit = 0.0_wp
      integer :: kind = 0
      integer, allocatable :: element(:) !! labels of the elements beyond the limit; if there are none, the label of the worst
      !! element
   end type adequacy_t

contains

   !> Evaluates the four measures for all elements between neighbouring candidates of contact at nodes, and finds the worst.
   subroutine measure_adequacy(problem, state, verdict)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state     !! converged
      type(adequacy_t), intent(out) :: verdict
      real(wp), allocatable :: measure(:, :), spent(:)
      real(wp) :: mu, energy
      integer :: c, next, e, stages, held
      allocate (verdict%element(0))
      if (problem%candidates%n == 0) return
      allocate (measure(problem%model%mesh%n_elements, size(limits)), spent(problem%model%mesh%n_elements), source=0.0_wp)
      do c = 1, problem%candidates%n
         next = problem%candidates%neighbour(2, c)
         if (next == 0 .or. problem%candidates%contact_span(c) > 0) cycle
         e = problem%candidates%element(2, c)
         stages = problem%model%mesh%stages(e)
         mu = compression(problem, state, e)
         held = count(state%active([c, next]))
         if (held == 2) then
            if (stages > 1) measure(e, buckled) = mu
            if (stages > 2) spent(e) = slack_energy(problem, state, e)
         else
            if (held == 1) measure(e, unheld) = max(measure(e, unheld), mu)
            measure(e, unbent) = wave_error(stages, mu)
         end if
      end do
      if (any(spent > 0.0_wp)) then
         energy = strain_energy(problem, state)
         where (spent > 0.0_wp) measure(:, slack) = sum(spent) / (sum(spent) + energy)
      end if
      verdict%kind = maxloc(maxval(measure, 1) / limits, 1)
      verdict%limit = limits(verdict%kind)
      verdict%value = maxval(measure(:, verdict%kind))
      verdict%ratio = verdict%value / verdict%limit
      associate (worst => measure(:, verdict%kind), label => problem%model%mesh%element_label)
         if (verdict%kind == slack) worst = spent
         e = maxloc(worst, 1)
         verdict%element = [label(e)]
         if (verdict%ratio <= 1.0_wp) return
         ! The measure `slack` is the same for all elements; the elements that contribute more than the average to the measure are
         ! listed.
         if (verdict%kind == slack) worst = (spent / sum(spent)) * (count(spent > 0.0_wp) * verdict%limit)
         verdict%element = pack(label, worst > verdict%limit .or. label == label(e))
      end associate
   end subroutine measure_adequacy

   !> mu of an element: normal force in the element's middle, > 0 in compression, times h^2/EI; zero in tension.
   real(wp) function compression(problem, state, e) result(mu)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: e
      mu = max(-middle_force(problem, state, e), 0.0_wp) * state%geometry%element(e)%length**2 * problem%compliance(e)%bending
   end function compression

   !> Normal force in the middle of an element, > 0 in tension: the mean of the end forces in the mean direction. (The mean of the
   !> two normal forces would cancel in an element that turns by half a circle.)
   real(wp) function middle_force(problem, state, e) result(force)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: e
      real(wp) :: first(3), second(3), angle
      call end_forces(problem, state, e, first, second)
      angle = 0.5_wp * (rod_direction(problem, state, e, 1) + rod_direction(problem, state, e, 2))
      force = 0.5_wp * dot_product(first(1:2) + second(1:2), [cos(angle), sin(angle)])
   end function middle_force

   !> Relative error of the critical load at which a rod of elements with the given mu bends in waves, see `unbent` in the header.
   pure real(wp) function wave_error(stages, mu) result(error)
      integer, intent(in) :: stages          !! number of stages; 0: UL2 element
      real(wp), intent(in) :: mu
      integer :: i
      error = mu / 12.0_wp
      if (stages < 2) return
      error = 2.0_wp / (2 * stages + 1)
      do i = 1, stages
         ! s!^2 / (2s)!^2, factor by factor
         error = error * mu / real(stages + i, wp)**2
      end do
   end function wave_error

   !> Twice the strain energy of the deflection between the nodes of an element in contact along a curve.
   real(wp) function slack_energy(problem, state, e) result(energy)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: e
      real(wp) :: turn
      turn = rod_direction(problem, state, e, 2) - rod_direction(problem, state, e, 1)
      energy = (middle_force(problem, state, e) * turn)**2 * state%geometry%element(e)%length**3 * problem%compliance(e)%bending / &
         & 720.0_wp
   end function slack_energy

   !> Twice the strain energy of the structure, its springs and foundations; force and moment are linear in each element.
   real(wp) function strain_energy(problem, state) result(energy)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      real(wp) :: local(3, 2), gap, normal(2), bend
      integer :: e, c
      energy = sum(problem%model%spring * state%u**2)
      do c = 1, problem%candidates%n
         call candidate_gap(problem, state, c, gap, normal, bend)
         energy = energy + abs(state%reaction(c) * gap)
      end do
      do e = 1, problem%model%mesh%n_elements
         call local_forces(problem, state, e, local)
         associate (h => state%geometry%element(e)%length)
            energy = energy + h * problem%compliance(e)%axial * mean_square(local(1, :)) + &
               & h * problem%compliance(e)%bending * mean_square(local(3, :))
         end associate
      end do
   contains
      pure real(wp) function mean_square(ends)
         real(wp), intent(in) :: ends(2)
         mean_square = (ends(1)**2 + ends(1) * ends(2) + ends(2)**2) / 3.0_wp
      end function mean_square
   end function strain_energy

   !> Message for the user in one sentence: the elements, their defect, the remedy.
   pure function adequacy_words(verdict) result(words)
      type(adequacy_t), intent(in) :: verdict !! verdict with a ratio above 1
      character(:), allocatable :: words
      words = trim(merge('element ', 'elements', size(verdict%element) == 1))//' '//ranges(verdict%element)
      select case (verdict%kind)
      case (buckled)
         words = words//' may buckle through the obstacle between the nodes that it holds (N h^2/EI '//number(verdict%value)// &
            & ', they buckle at '//number(verdict%limit)//')'
      case (unheld)
         words = words//' too long for where contact ends (N h^2/EI '//number(verdict%value)//', at most '// &
            & number(verdict%limit)//')'
      case (unbent)
         words = words//' too long for the waves of the compressed rod (loads are wrong by '//number(verdict%value)//')'
      case (slack)
         words = words//' bend through the curved obstacle between the nodes that it holds (this is '// &
            & number(verdict%value)//' of the strain energy, at most '//number(verdict%limit)//')'
      end select
      words = words//': more elements are needed there'
   contains
      pure function number(x) result(text)
         real(wp), intent(in) :: x
         character(:), allocatable :: text
         text = scientific(x, 2)
      end function number
   end function adequacy_words

   !> Labels of elements as ranges, at most the first few: "3-7, 12".
   pure function ranges(label) result(text)
      integer, intent(in) :: label(:)        !! labels, increasing within each run of neighbouring elements
      character(:), allocatable :: text
      integer, parameter :: most = 5         ! largest number of ranges in a message
      integer :: i, first, n
      text = ''
      n = 0
      i = 1
      do while (i <= size(label))
         first = i
         do while (i < size(label))
            if (label(i + 1) /= label(i) + 1) exit
            i = i + 1
         end do
         n = n + 1
         if (n > most) then
            text = text//', ...'
            return
         end if
         if (n > 1) text = text//', '
         text = text//to_text(label(first))
         if (i > first) text = text//'-'//to_text(label(i))
         i = i + 1
      end do
   end function ranges
end module mesh_adequacy

!> Chain of whole curves on which an imperfection is defined.
module imperfection_chain
   use kinds, only: wp, pi
   use text, only: to_text
   use model, only: model_t
   use checked_deck, only: checked_deck_t
   use deck_names, only: element_words
   implicit none
   private
   public :: chain_t, follow_chain

   real(wp), parameter :: largest_corner = 1.0e-4_wp !! [rad] smaller angles between curves are rounding of typed coordinates

   !> Connected elements on whole curves.
   type :: chain_t
      integer, allocatable :: element(:)  !! in order
      integer, allocatable :: node(:)     !! in order, one more than elements; closed: the last node is the first
      real(wp), allocatable :: knot(:)    !! chain coordinate of the nodes
      logical :: closed = .false.         !! true: the chain ends at its beginning
   end type chain_t

contains

   !> Checks that the elements form one smooth chain of whole curves.
   subroutine follow_chain(deck, model, element, chain, ok)
      type(checked_deck_t), intent(inout) :: deck       !! at the *IMPERFECTION; receives the first error, at ELSET
      type(model_t), intent(in) :: model                !! with the mesh, and the imperfections of its curves so far
      integer, intent(in) :: element(:)                 !! in the order of their set
      type(chain_t), intent(out) :: chain
      logical, intent(out) :: ok                        !! false: no such chain, or it has an imperfection already
      character(:), allocatable :: problem
      integer :: i, n
      n = size(element)
      ok = .false.
      if (n == 0 .or. deck%names%mesh_incomplete) return
      allocate (chain%knot(n + 1), source=0.0_wp)
      associate (mesh => model%mesh)
         do i = 1, n
            problem = link_problem(i)
            if (problem /= '') exit
            chain%knot(i + 1) = chain%knot(i) + (mesh%s(2, element(i)) - mesh%s(1, element(i)))
         end do
         chain%element = element
         chain%node = [mesh%node(1, element), mesh%node(2, element(n))]
      end associate
      chain%closed = chain%node(n + 1) == chain%node(1)
      if (problem == '') then
         if (.not. ends_curve(element(n))) then
            problem = 'the chain must end with the last element of a curve, not with '//label(element(n))
         else if (chain%closed .and. corner(element(n), element(1)) > largest_corner) then
            problem = 'the closed chain has a corner where it begins'
         end if
      end if
      ok = problem == ''
      if (.not. ok) call deck%wrong('ELSET', problem)

   contains

      !> Reason why an element of a set cannot continue the chain of those before it; '' if it can.
      function link_problem(i) result(problem)
         integer, intent(in) :: i          ! position in the set
         character(:), allocatable :: problem
         logical :: begins
         problem = ''
         associate (mesh => model%mesh, e => element(i), before => element(max(1, i - 1)))
            if (mesh%curve(e) == 0) then
               problem = element_words(mesh, e)//' is not on a generated curve (*LINE, *ARC ...)'
               return
            else if (model%curve(mesh%curve(e))%imperfection > 0) then
               problem = element_words(mesh, e)//' has an imperfection already'
               return
            end if
            begins = .not. mesh%s(1, e) > 0.0_wp
            if (i == 1) then
               if (.not. begins) problem = 'the chain must begin with the first element of a curve, not with '//label(e)
            else if (ends_curve(before) .neqv. begins) then
               problem = 'the set must hold whole curves; after '//element_words(mesh, before)//' comes '//label(e)
            else if (mesh%node(2, before) /= mesh%node(1, e)) then
               problem = element_words(mesh, e)//' does not begin where '//element_words(mesh, before)//' ends'
            else if (begins .and. corner(before, e) > largest_corner) then
               problem = 'the chain has a corner between the elements '//label(before)//' and '//label(e)
            end if
         end associate
      end function link_problem

      pure function label(e) result(string)
         integer, intent(in) :: e
         character(:), allocatable :: string
         string = to_text(model%mesh%element_label(e))
      end function label

      !> True for the last element of a curve: elements of a curve have consecutive indices.
      pure logical function ends_curve(e)
         integer, intent(in) :: e
         ends_curve = e == model%mesh%n_elements
         if (.not. ends_curve) ends_curve = model%mesh%curve(e + 1) /= model%mesh%curve(e)
      end function ends_curve

      !> Angle between the end of one nominal curve and the beginning of the next one.
      pure real(wp) function corner(last, first)
         integer, intent(in) :: last, first ! last element of one curve, first of the next
         real(wp) :: turn
         associate (one => model%curve(model%mesh%curve(last)), next => model%curve(model%mesh%curve(first)))
            turn = next%angle - (one%angle + one%curvature * one%length)
         end associate
         corner = abs(modulo(turn + pi, 2 * pi) - pi)
      end function corner
   end subroutine follow_chain
end module imperfection_chain

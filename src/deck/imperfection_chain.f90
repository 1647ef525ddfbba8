!> Chain of whole curves on which an imperfection is defined.
module imperfection_chain
   use kinds, only: wp, pi
   use text, only: to_text
   use model, only: model_t
   use diagnostics, only: diagnostics_t
   use deck_cards, only: deck_t, complain
   use card_values, only: parameter_place
   implicit none
   private
   public :: chain_t, follow_chain

   real(wp), parameter :: largest_corner = 1.0e-4_wp !! [rad] smaller angles between curves are rounding of typed coordinates

   !> Connected elements on whole curves.
   type :: chain_t
      integer, allocatable :: element(:)  !! in order
      integer, allocatable :: node(:)     !! in order, one more than elements; closed: the last node is the first
      real(wp), allocatable :: knot(:)    !! chain coordinate of the nodes
      logical :: closed = .false.         !! the chain ends at its beginning
   end type chain_t

contains

   !> Checks that the elements form one smooth chain of whole curves.
   subroutine follow_chain(deck, model, diagnostics, card, element, chain, ok)
      type(deck_t), intent(in) :: deck
      type(model_t), intent(in) :: model                !! with the mesh, and the imperfections of its curves so far
      type(diagnostics_t), intent(inout) :: diagnostics !! receives the errors, at ELSET
      integer, intent(in) :: card                       !! the *IMPERFECTION
      integer, intent(in) :: element(:)                 !! in the order of their set
      type(chain_t), intent(out) :: chain
      logical, intent(out) :: ok                        !! false: no such chain, or it has an imperfection already
      integer :: i, n, e, before
      logical :: begins
      n = size(element)
      ok = .false.
      if (n == 0) return
      associate (mesh => model%mesh, curve => model%curve)
         allocate (chain%knot(n + 1), source=0.0_wp)
         before = 0
         do i = 1, n
            e = element(i)
            if (mesh%curve(e) == 0) then
               call wrong('element '//label(e)//' is not on a *LINE, *ARC or *RING')
               return
            else if (curve(mesh%curve(e))%imperfection > 0) then
               call wrong('element '//label(e)//' has an imperfection already')
               return
            end if
            begins = .not. mesh%s(1, e) > 0.0_wp
            if (i == 1) then
               if (.not. begins) call wrong('the chain must begin with the first element of a curve, not with '// &
                  label(e))
               if (.not. begins) return
            else
               if (ends_curve(before) .neqv. begins) then
                  call wrong('the set must hold whole curves; after element '//label(before)//' comes '//label(e))
                  return
               else if (mesh%node(2, before) /= mesh%node(1, e)) then
                  call wrong('element '//label(e)//' does not begin where element '//label(before)//' ends')
                  return
               else if (begins .and. corner(before, e) > largest_corner) then
                  call wrong('the chain has a corner between the elements '//label(before)//' and '//label(e))
                  return
               end if
            end if
            before = e
            chain%knot(i + 1) = chain%knot(i) + (mesh%s(2, e) - mesh%s(1, e))
         end do
         e = element(n)
         if (.not. ends_curve(e)) then
            call wrong('the chain must end with the last element of a curve, not with '//label(e))
            return
         end if
         chain%element = element
         chain%node = [mesh%node(1, element), mesh%node(2, e)]
         chain%closed = chain%node(n + 1) == chain%node(1)
         if (chain%closed .and. corner(e, element(1)) > largest_corner) then
            call wrong('the closed chain has a corner where it begins')
            return
         end if
      end associate
      ok = .true.

   contains

      subroutine wrong(message)
         character(*), intent(in) :: message
         call complain(deck, diagnostics, card, parameter_place(deck, card, 'ELSET'), message)
      end subroutine wrong

      function label(e) result(string)
         integer, intent(in) :: e
         character(:), allocatable :: string
         string = to_text(model%mesh%element_label(e))
      end function label

      !> Elements of a curve have consecutive indices.
      logical function ends_curve(e)
         integer, intent(in) :: e
         ends_curve = e == model%mesh%n_elements
         if (.not. ends_curve) ends_curve = model%mesh%curve(e + 1) /= model%mesh%curve(e)
      end function ends_curve

      !> Angle between the end of one nominal curve and the beginning of the next one.
      pure real(wp) function corner(last, first)
         integer, intent(in) :: last, first
         real(wp) :: turn
         associate (one => model%curve(model%mesh%curve(last)), next => model%curve(model%mesh%curve(first)))
            turn = next%angle - (one%angle + one%curvature * one%length)
         end associate
         corner = abs(modulo(turn + pi, 2 * pi) - pi)
      end function corner
   end subroutine follow_chain
end module imperfection_chain

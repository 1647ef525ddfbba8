!> Reads *DISTRIBUTION, values that vary along chains of rods, and fields of other cards that name a distribution.
module read_distributions
   use kinds, only: wp
   use text, only: to_text
   use model, only: model_t
   use distribution, only: distribution_t, distributed_t, same_length
   use element_families, only: collocates
   use reference_curve, only: curve_point
   use checked_deck, only: checked_deck_t
   use deck_names, only: element_words
   implicit none
   private
   public :: read_distribution_cards, read_distributed, value_inside

   integer, parameter :: looks = 8                !! number of places of an element at which a formula is evaluated for its check

contains

   !> Reads the distributions.
   subroutine read_distribution_cards(deck, model)
      type(checked_deck_t), intent(inout) :: deck       !! in: contains the mesh; out: also the names
      type(model_t), intent(inout) :: model             !! in: contains imperfections; out: also distribution
      type(distribution_t) :: new
      real(wp) :: length
      logical :: ok
      do while (deck%next_card('DISTRIBUTION'))
         if (.not. deck%defines(deck%names%distribution, deck%text('NAME'))) cycle
         new = distribution_t(name=deck%text('NAME'))
         call lay_chain(length, ok)
         allocate (new%at(0), new%value(0))
         new%formula = '0'
         do while (deck%next_line())
            if (deck%given('FORMULA')) then
               new%formula = deck%text('formula')
            else
               new%at = [new%at, deck%real('s')]
               new%value = [new%value, deck%real('value')]
               if (ok) call check_line()
            end if
         end do
         if (ok .and. deck%lines_sound()) call check_values()
         model%distribution = [model%distribution, new]
      end do

   contains

      !> Sets the positions of a chain of elements; an error is added if the elements do not form a chain.
      subroutine lay_chain(length, ok)
         real(wp), intent(out) :: length                   ! length of the chain
         logical, intent(out) :: ok
         integer, allocatable :: element(:)
         character(:), allocatable :: problem
         integer :: i, n
         allocate (new%range(2, size(model%curve)), new%offset(size(model%curve)), source=0.0_wp)
         element = deck%elements('ELSET')
         n = size(element)
         length = 0.0_wp
         problem = ''
         associate (mesh => model%mesh)
            do i = 1, n
               associate (e => element(i), c => mesh%curve(element(i)), before => element(max(1, i - 1)))
                  if (c == 0) then
                     problem = element_words(mesh, e)//' is not on a generated curve (*LINE, *ARC ...)'
                  else if (.not. collocates(mesh%family(e))) then
                     problem = element_words(mesh, e)//' is UL2; what varies needs GE elements'
                  else if (i > 1 .and. mesh%node(2, before) /= mesh%node(1, e)) then
                     problem = element_words(mesh, e)//' does not begin where '//element_words(mesh, before)//' ends'
                  else if (new%range(2, c) > 0.0_wp .and. abs(new%range(2, c) - mesh%s(1, e)) > 0.0_wp) then
                     problem = 'the chain comes back to the curve of '//element_words(mesh, e)
                  end if
                  if (problem /= '') exit
                  if (.not. new%range(2, c) > 0.0_wp) then
                     new%range(:, c) = mesh%s(1, e)
                     new%offset(c) = length - mesh%s(1, e)
                  end if
                  new%range(2, c) = mesh%s(2, e)
                  length = new%offset(c) + mesh%s(2, e)
               end associate
            end do
         end associate
         ok = problem == '' .and. n > 0
         if (problem /= '') call deck%wrong('ELSET', problem)
      end subroutine lay_chain

      !> Checks the last line of a table: the arc length must not decrease, and there must be a node at a corner.
      subroutine check_line()
         integer :: c, e, n
         logical :: on_node
         n = size(new%at)
         if (n == 1) then
            if (abs(new%at(1)) > 0.0_wp) call deck%wrong('s', 'the table must begin with s = 0')
            return
         else if (new%at(n) < new%at(n - 1)) then
            call deck%wrong('s', 's must not fall from line to line')
            return
         else if (n > 2) then
            if (new%at(n) <= new%at(n - 2)) call deck%wrong('s', 'more than two values for one s')
         end if
         if (new%at(n) > length * (1.0_wp + same_length)) then
            call deck%wrong('s', 'the elements of ELSET are only '//to_text(length)//' long')
            return
         end if
         on_node = abs(new%at(n) - length) <= same_length * length
         do e = 1, model%mesh%n_elements
            c = model%mesh%curve(e)
            if (on_node .or. c == 0) cycle
            if (new%contains_place(c, 0.5_wp * sum(model%mesh%s(:, e)))) &
               & on_node = any(abs(model%mesh%s(:, e) + new%offset(c) - new%at(n)) <= same_length * length)
         end do
         if (.not. on_node) call deck%wrong('s', 'a table has its corners at nodes, and there is none at this s; nodes are put '// &
            'where a generated curve (*LINE, *ARC ...) itself has this ELSET')
      end subroutine check_line

      !> Checks the values along the chain: the end of a table, places where a formula has no value; determines smallest and mean
      !> value.
      subroutine check_values()
         character(:), allocatable :: wrong
         real(wp) :: x(2), angle, speed, value, s
         integer :: c, e, k
         if (.not. deck%given('FORMULA')) then
            if (size(new%at) > 0) then
               if (new%at(size(new%at)) < length * (1.0_wp - same_length)) call deck%wrong_card('the table ends at s = '// &
                  to_text(new%at(size(new%at)))//', the elements of ELSET are '//to_text(length)//' long')
            end if
         end if
         new%least = huge(1.0_wp)
         do e = 1, model%mesh%n_elements
            c = model%mesh%curve(e)
            if (.not. new%contains_place(c, 0.5_wp * sum(model%mesh%s(:, e)))) cycle
            do k = 0, looks
               s = model%mesh%s(1, e) + k * (model%mesh%s(2, e) - model%mesh%s(1, e)) / looks
               call curve_point(model%curve(c), model%imperfection, s, x, angle, speed)
               call new%value_at(s + new%offset(c), x, value, wrong)
               if (wrong /= '') then
                  call deck%wrong_card('at s = '//to_text(s + new%offset(c))//' the formula of s, x, y has no value: '//wrong)
                  return
               end if
               new%least = min(new%least, value)
               if (k < looks) new%mean = new%mean + value * (model%mesh%s(2, e) - model%mesh%s(1, e)) / (looks * length)
            end do
         end do
         if (size(new%value) > 0) new%least = min(new%least, minval(new%value))
      end subroutine check_values
   end subroutine read_distribution_cards

   !> The value of a field: a number or a distribution, which must be defined on the given elements.
   subroutine read_distributed(deck, model, name, elements, value, positive)
      type(checked_deck_t), intent(inout) :: deck
      type(model_t), intent(in) :: model                !! contains distributions
      character(*), intent(in) :: name                  !! name of the field in the card table
      integer, intent(in) :: elements(:)
      type(distributed_t), intent(out) :: value
      logical, intent(in), optional :: positive         !! true: the value must be positive everywhere
      integer :: d, i
      value%value = deck%real(name)
      if (.not. deck%given(name)) return
      if (scan(deck%text(name), '0123456789.+-') == 1) return
      d = deck%named(name, deck%names%distribution, 'distribution')
      if (d == 0 .or. d > size(model%distribution)) return
      value = distributed_t(model%distribution(d)%mean, d)
      associate (varied => model%distribution(d), mesh => model%mesh)
         do i = 1, size(elements)
            if (varied%contains_place(mesh%curve(elements(i)), 0.5_wp * sum(mesh%s(:, elements(i))))) cycle
            call deck%wrong(name, element_words(mesh, elements(i))//' is not in the ELSET of '//trim(varied%name))
            exit
         end do
         if (.not. present(positive)) return
         if (positive .and. varied%least <= 0.0_wp) call deck%wrong(name, trim(varied%name)// &
            ' must be positive everywhere; its least value is '//to_text(varied%least))
      end associate
   end subroutine read_distributed

   !> A number or a varying value at a place of an element.
   function value_inside(model, value, e, tau) result(inside)
      type(model_t), intent(in) :: model
      type(distributed_t), intent(in) :: value
      integer, intent(in) :: e
      real(wp), intent(in) :: tau                       !! places in the element, 0 to 1 of its stress-free length
      real(wp) :: inside
      character(:), allocatable :: wrong
      real(wp) :: x(2), angle, speed, s
      integer :: c
      inside = value%value
      c = model%mesh%curve(e)
      if (value%distribution == 0 .or. c == 0) return
      s = model%mesh%s(1, e) + tau * (model%mesh%s(2, e) - model%mesh%s(1, e))
      call curve_point(model%curve(c), model%imperfection, s, x, angle, speed)
      associate (varied => model%distribution(value%distribution))
         call varied%value_at(s + varied%offset(c), x, inside, wrong)
      end associate
   end function value_inside
end module read_distributions

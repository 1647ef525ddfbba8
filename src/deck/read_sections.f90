!> Reads *MATERIAL, *ELASTIC, *DENSITY, *EXPANSION and *BEAM SECTION: the material and section of every element. Reads
!> *DISTRIBUTION, too, values that vary along chains of rods, and fields of other cards that name a distribution.
module read_sections
   use, intrinsic :: ieee_arithmetic, only: ieee_value, ieee_positive_inf
   use kinds, only: wp
   use text, only: to_text, word_index
   use model, only: model_t
   use cross_section, only: section_t, local_section
   use element_families, only: collocates
   use checked_deck, only: checked_deck_t, element_words
   use distribution, only: distribution_t, distributed_t, same_length
   use reference_curve, only: curve_point
   implicit none
   private
   public :: read_section_cards, read_distribution_cards, read_distributed

   !> Constants of a material: Young's modulus, Poisson's ratio, density, coefficient of thermal expansion.
   type :: material_t
      real(wp) :: e = 1.0_wp, nu = 0.0_wp, rho = 0.0_wp, alpha = 0.0_wp
      integer :: line(3) = 0 !! lines of the deck with *ELASTIC, *DENSITY and *EXPANSION; 0: not given
   end type material_t

   integer, parameter :: looks = 8                !! number of places of an element at which a formula is evaluated for its check

contains

   !> Reads materials and sections; every element must have one section.
   subroutine read_section_cards(deck, model)
      type(checked_deck_t), intent(inout) :: deck       !! out: with the names of the materials added
      type(model_t), intent(inout) :: model             !! out: with section and mesh%section added
      type(material_t), allocatable :: material(:)
      character(:), allocatable :: message
      integer :: e, n
      call read_materials(deck, material)
      call read_beam_sections(deck, material, model)
      n = count(model%mesh%section == 0)
      if (n == 0 .or. deck%names%mesh_incomplete .or. deck%names%sections_incomplete) return
      e = findloc(model%mesh%section, 0, 1)
      message = element_words(model%mesh, e)//' has no *BEAM SECTION'
      if (n > 1) message = to_text(n)//' elements have no *BEAM SECTION, the first is '//element_words(model%mesh, e)
      call deck%wrong_at_line(deck%names%element%line(e), message)
   end subroutine read_section_cards

   subroutine read_materials(deck, material)
      type(checked_deck_t), intent(inout) :: deck
      type(material_t), allocatable, intent(out) :: material(:) !! materials in the order of names%material
      logical :: ok
      allocate (material(0))
      ok = .false.                                      ! false: the cards belong to a material that cannot be read
      do while (deck%next_card('MATERIAL|ELASTIC|DENSITY|EXPANSION'))
         if (deck%at%keyword == 'MATERIAL') then
            ok = deck%defines(deck%names%material, deck%text('NAME'))
            if (ok) material = [material, material_t()]
         else if (ok) then
            call read_constants(deck, material(size(material)))
         end if
      end do
   end subroutine read_materials

   !> Reads a card with constants of a material.
   subroutine read_constants(deck, material)
      type(checked_deck_t), intent(inout) :: deck
      type(material_t), intent(inout) :: material
      integer :: kind ! number of the card in the order of material%line
      kind = word_index('ELASTIC|DENSITY|EXPANSION', deck%at%keyword)
      associate (list => deck%names%material, earlier => material%line(kind))
         if (earlier > 0) call deck%wrong_card('material '//trim(list%name(list%n))//' has it already, from '// &
            deck%source%line_words(earlier))
         earlier = deck%at%card_at
      end associate
      if (.not. deck%next_line()) return
      select case (deck%at%keyword)
      case ('ELASTIC')
         material%e = deck%real('E')
         material%nu = deck%real('nu')
      case ('DENSITY')
         material%rho = deck%real('rho')
      case ('EXPANSION')
         material%alpha = deck%real('alpha')
      end select
   end subroutine read_constants

   subroutine read_beam_sections(deck, material, model)
      type(checked_deck_t), intent(inout) :: deck
      type(material_t), intent(in) :: material(:)
      type(model_t), intent(inout) :: model
      type(section_t) :: section
      integer, allocatable :: elements(:)
      integer :: section_line(deck%n_cards)              ! (sections) line of the deck with the section's card
      integer :: i, m
      do while (deck%next_card('BEAM SECTION'))
         elements = deck%elements('ELSET')
         m = 0
         if (deck%given('MATERIAL')) then
            m = deck%named('MATERIAL', deck%names%material, 'material')
            if (m > 0) then
               if (material(m)%line(1) == 0) call deck%wrong('MATERIAL', 'material '//trim(deck%names%material%name(m))// &
                  ' has no *ELASTIC')
            end if
         end if
         section = section_t(shape=deck%word('SECTION'))
         section_line(size(model%section) + 1) = deck%at%card_at
         if (deck%next_line()) then
            if (m > 0) call section_of_material(material(m))
            if (.not. deck%given('MATERIAL')) call section_of_stiffness()
            section%name = deck%text('ELSET')
            section = local_section(section, [real(wp) ::])
         end if
         model%section = [model%section, section]
         do i = 1, size(elements)
            associate (of_element => model%mesh%section(elements(i)))
               if (of_element > 0) then
                  call deck%wrong('ELSET', element_words(model%mesh, elements(i))//' has a section already, from '// &
                     deck%source%line_words(section_line(of_element)))
                  exit
               end if
               of_element = size(model%section)
            end associate
         end do
         i = findloc(collocates(model%mesh%family(elements)), .false., 1)
         if (deck%word('SECTION') == 'INEXTENSIBLE' .and. i > 0) call deck%wrong('SECTION', &
            element_words(model%mesh, elements(i))//' is UL2, whose force is EA times its stretch; INEXTENSIBLE needs GE elements')
      end do

   contains

      !> Computes a section from the dimensions of a shape and a material.
      subroutine section_of_material(material)
         type(material_t), intent(in) :: material
         integer :: j
         section%shear_rigid = deck%word('SHEAR') == 'RIGID'
         select case (section%shape)
         case ('RECT')
            call read_dimension(1, 'width')
            call read_dimension(2, 'height')
         case ('CIRC')
            call read_dimension(1, 'radius')
         case ('PIPE')
            call read_dimension(1, 'radius')
            call read_dimension(2, 'thickness')
            if (any([(too_thick(elements(j), 0.0_wp) .or. too_thick(elements(j), 1.0_wp), j=1, size(elements))])) &
               call deck%wrong('thickness', 'the thickness must not be larger than the radius')
         case default
            call read_dimension(1, 'A')
            call read_dimension(2, 'I')
            if (section%shear_rigid .and. deck%given('shear area')) then
               call deck%wrong('shear area', 'a shear area goes with SHEAR=FLEXIBLE only')
            else if (.not. (section%shear_rigid .or. deck%given('shear area'))) then
               call deck%wrong('shear area', 'shear area is missing; required with SHEAR=FLEXIBLE')
            else if (.not. section%shear_rigid) then
               call read_dimension(3, 'shear area')
            end if
         end select
         section%young = material%e
         section%rigidity = 0.5_wp * material%e / (1.0_wp + material%nu)
         section%density = material%rho
         section%expansion = material%alpha
      end subroutine section_of_material

      !> Reads SECTION=STIFFNESS or INEXTENSIBLE, with given stiffnesses.
      subroutine section_of_stiffness()
         section%inextensible = deck%word('SECTION') == 'INEXTENSIBLE'
         if (section%inextensible) then
            section%ea = ieee_value(section%ea, ieee_positive_inf)
         else
            call read_dimension(1, 'EA')
         end if
         call read_dimension(2, 'EI')
         section%shear_rigid = .not. deck%given('GA')
         if (.not. section%shear_rigid) call read_dimension(3, 'GA')
         call read_dimension(4, 'mass')
         section%expansion = deck%real('alpha')
      end subroutine section_of_stiffness

      !> True if the wall of a pipe is thicker than its radius at a place of an element.
      logical function too_thick(e, tau)
         integer, intent(in) :: e
         real(wp), intent(in) :: tau
         too_thick = value_inside(model, section%dimension(2), e, tau) > value_inside(model, section%dimension(1), e, tau)
      end function too_thick

      subroutine read_dimension(i, name)
         integer, intent(in) :: i
         character(*), intent(in) :: name
         call read_distributed(deck, model, name, elements, section%dimension(i), positive=.true.)
      end subroutine read_dimension
   end subroutine read_beam_sections

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
end module read_sections

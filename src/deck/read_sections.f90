!> Reads *MATERIAL, *ELASTIC, *DENSITY, *EXPANSION and *BEAM SECTION: the material and section of every element.
module read_sections
   use, intrinsic :: ieee_arithmetic, only: ieee_value, ieee_positive_inf
   use kinds, only: wp
   use text, only: to_text, word_index
   use model, only: model_t
   use cross_section, only: section_t, local_section
   use element_families, only: collocates
   use checked_deck, only: checked_deck_t
   use read_distributions, only: read_distributed, value_inside
   use deck_names, only: element_words
   implicit none
   private
   public :: read_section_cards

   !> Constants of a material: Young's modulus, Poisson's ratio, density, coefficient of thermal expansion.
   type :: material_t
      real(wp) :: e = 1.0_wp, nu = 0.0_wp, rho = 0.0_wp, alpha = 0.0_wp
      integer :: line(3) = 0 !! lines of the deck with *ELASTIC, *DENSITY and *EXPANSION; 0: not given
   end type material_t

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
end module read_sections

!> Reads *MATERIAL, *ELASTIC, *DENSITY, *EXPANSION and *BEAM SECTION: the material and section of every element.
module read_sections
   use, intrinsic :: ieee_arithmetic, only: ieee_value, ieee_positive_inf
   use kinds, only: wp, pi
   use text, only: to_text
   use model, only: model_t, section_t
   use element_families, only: collocates
   use checked_deck, only: checked_deck_t
   use deck_names, only: element_words
   implicit none
   private
   public :: read_section_cards

   !> Constants of a material: Young's modulus, Poisson's ratio, density, coefficient of thermal expansion.
   type :: material_t
      real(wp) :: e = 1.0_wp, nu = 0.0_wp, rho = 0.0_wp, alpha = 0.0_wp
      integer :: elastic_line = 0, density_line = 0, expansion_line = 0 !! lines of the deck with the cards, 0: not given
   end type material_t

contains

   !> Reads materials and sections; every element must have one section.
   subroutine read_section_cards(deck, model)
      type(checked_deck_t), intent(inout) :: deck       !! receives the names of the materials
      type(model_t), intent(inout) :: model             !! receives section and mesh%section
      type(material_t), allocatable :: material(:)
      call read_materials(deck, material)
      call read_beam_sections(deck, material, model)
      if (.not. (deck%names%mesh_incomplete .or. deck%names%sections_incomplete)) call check_complete(deck, model)
   end subroutine read_section_cards

   subroutine read_materials(deck, material)
      type(checked_deck_t), intent(inout) :: deck
      type(material_t), allocatable, intent(out) :: material(:) !! in the order of names%material
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
      logical :: sound
      sound = deck%next_line()
      select case (deck%at%keyword)
      case ('ELASTIC')
         call only_once(material%elastic_line)
         if (sound) material%e = deck%real('E')
         if (sound) material%nu = deck%real('nu')
      case ('DENSITY')
         call only_once(material%density_line)
         if (sound) material%rho = deck%real('rho')
      case ('EXPANSION')
         call only_once(material%expansion_line)
         if (sound) material%alpha = deck%real('alpha')
      end select

   contains

      subroutine only_once(earlier)
         integer, intent(inout) :: earlier
         associate (list => deck%names%material)
            if (earlier > 0) call deck%wrong_card('material '//trim(list%name(list%n))//' has it already, from '// &
               deck%source%line_words(earlier))
         end associate
         earlier = deck%at%card_at
      end subroutine only_once
   end subroutine read_constants

   subroutine read_beam_sections(deck, material, model)
      type(checked_deck_t), intent(inout) :: deck
      type(material_t), intent(in) :: material(:)
      type(model_t), intent(inout) :: model
      type(section_t) :: section
      integer, allocatable :: elements(:)
      integer :: section_line(size(deck%card))          ! (sections) line of the section's card
      integer :: i, m
      allocate (model%section(0))
      do while (deck%next_card('BEAM SECTION'))
         elements = deck%elements('ELSET')
         m = 0
         if (deck%given('MATERIAL')) then
            m = deck%named('MATERIAL', deck%names%material, 'material')
            if (m > 0) then
               if (material(m)%elastic_line == 0) call deck%wrong('MATERIAL', 'material '//trim(deck%names%material%name(m))// &
                  ' has no *ELASTIC')
            end if
         end if
         section = section_t()
         section_line(size(model%section) + 1) = deck%at%card_at
         if (deck%next_line()) then
            if (m > 0) call section_of_material(material(m))
            if (.not. deck%given('MATERIAL')) call section_of_stiffness()
            section%name = deck%text('ELSET')
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

      !> EA, EI, GA, mass and expansion of a shape made of a material.
      subroutine section_of_material(material)
         type(material_t), intent(in) :: material
         real(wp) :: area, inertia, shear_area, a, b
         section%shear_rigid = deck%word('SHEAR') == 'RIGID'
         select case (deck%word('SECTION'))
         case ('RECT')
            a = deck%real('width')
            b = deck%real('height')
            area = a * b
            inertia = a * b**3 / 12
            shear_area = area * 5 / 6
         case ('CIRC')
            a = deck%real('radius')
            area = pi * a**2
            inertia = pi * a**4 / 4
            shear_area = 0.9_wp * area
         case ('PIPE')
            a = deck%real('radius')
            b = deck%real('thickness')
            if (b > a) call deck%wrong('thickness', 'the thickness must not be larger than the radius')
            ! Differences of powers, without cancellation for thin walls.
            area = pi * b * (2 * a - b)
            inertia = area * (a**2 + (a - b)**2) / 4
            shear_area = 0.5_wp * area
         case default
            area = deck%real('A')
            inertia = deck%real('I')
            shear_area = deck%real('shear area')
            if (section%shear_rigid .and. shear_area > 0.0_wp) then
               call deck%wrong('shear area', 'a shear area goes with SHEAR=FLEXIBLE only')
            else if (.not. (section%shear_rigid .or. shear_area > 0.0_wp)) then
               call deck%wrong('shear area', 'shear area is missing; required with SHEAR=FLEXIBLE')
            end if
         end select
         section%ea = material%e * area
         section%ei = material%e * inertia
         section%ga = 0.5_wp * material%e / (1.0_wp + material%nu) * shear_area
         section%mass = material%rho * area
         section%expansion = material%alpha
      end subroutine section_of_material

      !> Reads SECTION=STIFFNESS, INEXTENSIBLE: given stiffnesses.
      subroutine section_of_stiffness()
         section%inextensible = deck%word('SECTION') == 'INEXTENSIBLE'
         if (section%inextensible) then
            section%ea = ieee_value(section%ea, ieee_positive_inf)
         else
            section%ea = deck%real('EA')
         end if
         section%ei = deck%real('EI')
         section%shear_rigid = .not. deck%given('GA')
         section%ga = deck%real('GA')
         section%mass = deck%real('mass')
         section%expansion = deck%real('alpha')
      end subroutine section_of_stiffness
   end subroutine read_beam_sections

   !> Reports elements without a section, at the line that defines the first of these.
   subroutine check_complete(deck, model)
      type(checked_deck_t), intent(inout) :: deck
      type(model_t), intent(in) :: model
      character(:), allocatable :: message
      integer :: e, n
      n = count(model%mesh%section == 0)
      if (n == 0) return
      e = findloc(model%mesh%section, 0, 1)
      message = element_words(model%mesh, e)//' has no *BEAM SECTION'
      if (n > 1) message = to_text(n)//' elements have no *BEAM SECTION, the first is '//element_words(model%mesh, e)
      call deck%wrong_at_line(deck%names%element%line(e), message)
   end subroutine check_complete
end module read_sections

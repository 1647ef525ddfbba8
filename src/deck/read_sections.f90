!> Reads *MATERIAL, *ELASTIC, *DENSITY, *EXPANSION and *BEAM SECTION: the material and section of every element.
module read_sections
   use, intrinsic :: ieee_arithmetic, only: ieee_value, ieee_positive_inf
   use kinds, only: wp, pi
   use text, only: to_text
   use model, only: model_t, section_t
   use element_families, only: collocates
   use diagnostics, only: diagnostics_t, place_t
   use deck_cards, only: deck_t, complain, line_end
   use card_values, only: given, parameter_text, parameter_word, parameter_place, value_place, field_given, &
      field_place, field_real
   use deck_names, only: deck_names_t, find_set, find_named
   implicit none
   private
   public :: read_section_cards

   type :: material_t
      real(wp) :: e = 1.0_wp, nu = 0.0_wp, rho = 0.0_wp, alpha = 0.0_wp
      integer :: card = 0, elastic_card = 0, density_card = 0, expansion_card = 0 !! positions of the cards, 0: not given
   end type material_t

contains

   !> Reads materials and sections; every element must have one section.
   subroutine read_section_cards(deck, names, model, diagnostics)
      type(deck_t), intent(in) :: deck
      type(deck_names_t), intent(inout) :: names        !! receives the materials
      type(model_t), intent(inout) :: model             !! receives section and mesh%section
      type(diagnostics_t), intent(inout) :: diagnostics
      type(material_t), allocatable :: material(:)
      call read_materials(deck, names, diagnostics, material)
      call read_beam_sections(deck, names, material, model, diagnostics)
   end subroutine read_section_cards

   subroutine read_materials(deck, names, diagnostics, material)
      type(deck_t), intent(in) :: deck
      type(deck_names_t), intent(inout) :: names
      type(diagnostics_t), intent(inout) :: diagnostics
      type(material_t), allocatable, intent(out) :: material(:)
      integer :: card, m, line
      logical :: is_new
      allocate (material(count_cards(deck, 'MATERIAL')))
      m = 0
      do card = 1, deck%n_cards
         if (.not. deck%card(card)%sound) cycle
         line = deck%card(card)%first_line
         select case (deck%card(card)%keyword)
         case ('MATERIAL')
            call names%material%add(parameter_text(deck, card, 'NAME'), m, is_new)
            if (.not. is_new) call complain(deck, diagnostics, card, parameter_place(deck, card, 'NAME'), &
               'the name was used in '//deck%source%line_words(deck%card(material(m)%card)%place%line))
            if (is_new) material(m)%card = card
            if (.not. is_new) m = 0
         case ('ELASTIC')
            if (m == 0) cycle
            call only_once(material(m)%elastic_card)
            if (.not. deck%data_line(line)%sound) cycle
            material(m)%e = field_real(deck, line, 1)
            material(m)%nu = field_real(deck, line, 2)
            if (material(m)%nu <= -1.0_wp .or. material(m)%nu > 0.5_wp) call complain(deck, diagnostics, card, &
               field_place(deck, line, 2), 'nu must be above -1 and at most 0.5')
         case ('DENSITY')
            if (m == 0) cycle
            call only_once(material(m)%density_card)
            if (deck%data_line(line)%sound) material(m)%rho = field_real(deck, line, 1)
         case ('EXPANSION')
            if (m == 0) cycle
            call only_once(material(m)%expansion_card)
            if (deck%data_line(line)%sound) material(m)%alpha = field_real(deck, line, 1)
         end select
      end do

   contains

      subroutine only_once(earlier)
         integer, intent(inout) :: earlier
         if (earlier > 0) call complain(deck, diagnostics, card, deck%card(card)%place, 'material '// &
            trim(names%material%name(m))//' has it already, from '//deck%source%line_words(deck%card(earlier)%place%line))
         earlier = card
      end subroutine only_once
   end subroutine read_materials

   subroutine read_beam_sections(deck, names, material, model, diagnostics)
      type(deck_t), intent(in) :: deck
      type(deck_names_t), intent(in) :: names
      type(material_t), intent(in) :: material(:)
      type(model_t), intent(inout) :: model
      type(diagnostics_t), intent(inout) :: diagnostics
      type(section_t) :: section
      type(place_t) :: place
      integer, allocatable :: from_card(:), elements(:)
      integer :: card, i, m, n, set
      n = count_cards(deck, 'BEAM SECTION')
      allocate (model%section(n), from_card(n))
      n = 0
      do card = 1, deck%n_cards
         if (.not. deck%card(card)%sound .or. deck%card(card)%keyword /= 'BEAM SECTION') cycle
         call find_set(deck, names, diagnostics, card, 'ELSET', 'element', set)
         m = 0
         if (given(deck, card, 'MATERIAL')) then
            place = value_place(deck, card, 'MATERIAL')
            call find_named(deck, names%material, diagnostics, card, place, 'material', m)
            if (m > 0) then
               if (material(m)%elastic_card == 0) call complain(deck, diagnostics, card, place, &
                  'material '//trim(names%material%name(m))//' has no *ELASTIC')
            end if
         end if
         n = n + 1
         from_card(n) = card
         if (deck%data_line(deck%card(card)%first_line)%sound) then
            if (m > 0) call section_of_material(deck, diagnostics, card, material(m), section)
            if (.not. given(deck, card, 'MATERIAL')) call section_of_stiffness(deck, card, section)
            section%name = parameter_text(deck, card, 'ELSET')
            model%section(n) = section
         end if
         elements = names%element_set%members(set)
         do i = 1, size(elements)
            if (model%mesh%section(elements(i)) > 0) then
               call complain(deck, diagnostics, card, parameter_place(deck, card, 'ELSET'), &
                  'element '//to_text(model%mesh%element_label(elements(i)))//' has a section already, from '// &
                  deck%source%line_words(deck%card(from_card(model%mesh%section(elements(i))))%place%line))
               exit
            end if
            model%mesh%section(elements(i)) = n
         end do
         if (parameter_word(deck, card, 'SECTION') /= 'INEXTENSIBLE') cycle
         i = findloc(collocates(model%mesh%family(elements)), .false., 1)
         if (i > 0) call complain(deck, diagnostics, card, parameter_place(deck, card, 'SECTION'), 'element '// &
            to_text(model%mesh%element_label(elements(i)))// &
            ' is UL2, whose force is EA times its stretch; INEXTENSIBLE needs GE elements')
      end do
      model%section = model%section(:n)
      if (.not. (names%mesh_incomplete .or. names%sections_incomplete)) call check_complete(deck, names, model, diagnostics)
   end subroutine read_beam_sections

   !> EA, EI, GA, mass and expansion of a shape made of a material.
   subroutine section_of_material(deck, diagnostics, card, material, section)
      type(deck_t), intent(in) :: deck
      type(diagnostics_t), intent(inout) :: diagnostics
      integer, intent(in) :: card
      type(material_t), intent(in) :: material
      type(section_t), intent(out) :: section
      real(wp) :: area, inertia, shear_area, a, b
      integer :: line
      line = deck%card(card)%first_line
      a = field_real(deck, line, 1)
      b = field_real(deck, line, 2)
      section%shear_rigid = parameter_word(deck, card, 'SHEAR') == 'RIGID'
      select case (parameter_word(deck, card, 'SECTION'))
      case ('RECT')
         area = a * b
         inertia = a * b**3 / 12
         shear_area = area * 5 / 6
      case ('CIRC')
         area = pi * a**2
         inertia = pi * a**4 / 4
         shear_area = 0.9_wp * area
      case ('PIPE')
         if (b > a) call complain(deck, diagnostics, card, field_place(deck, line, 2), &
            'the thickness must not be larger than the radius')
         ! Differences of powers, without cancellation for thin walls.
         area = pi * b * (2 * a - b)
         inertia = area * (a**2 + (a - b)**2) / 4
         shear_area = 0.5_wp * area
      case default
         area = a
         inertia = b
         shear_area = 0.0_wp
         if (field_given(deck, line, 3)) shear_area = field_real(deck, line, 3)
         if (section%shear_rigid .and. field_given(deck, line, 3)) then
            call complain(deck, diagnostics, card, field_place(deck, line, 3), &
               'a shear area goes with SHEAR=FLEXIBLE only')
         else if (.not. (section%shear_rigid .or. field_given(deck, line, 3))) then
            call complain(deck, diagnostics, card, field_place(deck, line, 3), &
               'shear area is missing; required with SHEAR=FLEXIBLE')
         end if
      end select
      section%ea = material%e * area
      section%ei = material%e * inertia
      section%ga = 0.5_wp * material%e / (1.0_wp + material%nu) * shear_area
      section%mass = material%rho * area
      section%expansion = material%alpha
   end subroutine section_of_material

   !> Reads SECTION=STIFFNESS, INEXTENSIBLE: given stiffnesses.
   subroutine section_of_stiffness(deck, card, section)
      type(deck_t), intent(in) :: deck
      integer, intent(in) :: card
      type(section_t), intent(out) :: section
      integer :: line, before
      line = deck%card(card)%first_line
      section%inextensible = parameter_word(deck, card, 'SECTION') == 'INEXTENSIBLE'
      before = merge(0, 1, section%inextensible)
      if (section%inextensible) then
         section%ea = ieee_value(section%ea, ieee_positive_inf)
      else
         section%ea = field_real(deck, line, 1)
      end if
      section%ei = field_real(deck, line, before + 1)
      section%shear_rigid = .not. field_given(deck, line, before + 2)
      if (.not. section%shear_rigid) section%ga = field_real(deck, line, before + 2)
      section%mass = field_real(deck, line, before + 3)
      section%expansion = field_real(deck, line, before + 4)
   end subroutine section_of_stiffness

   !> Reports elements without a section.
   subroutine check_complete(deck, names, model, diagnostics)
      type(deck_t), intent(in) :: deck
      type(deck_names_t), intent(in) :: names
      type(model_t), intent(in) :: model
      type(diagnostics_t), intent(inout) :: diagnostics
      type(place_t) :: place
      integer :: e, n
      n = count(model%mesh%section == 0)
      if (n == 0) return
      e = findloc(model%mesh%section, 0, 1)
      ! The line that defines the first of these elements.
      place = place_t(names%element_line(e), 1, line_end(deck%source, names%element_line(e)))
      if (n == 1) then
         call diagnostics%add(place, 'element '//to_text(model%mesh%element_label(e))//' has no *BEAM SECTION')
      else
         call diagnostics%add(place, to_text(n)//' elements have no *BEAM SECTION, the first is element '// &
            to_text(model%mesh%element_label(e)))
      end if
   end subroutine check_complete

   pure integer function count_cards(deck, keyword) result(n)
      type(deck_t), intent(in) :: deck
      character(*), intent(in) :: keyword
      integer :: card
      n = 0
      do card = 1, deck%n_cards
         if (deck%card(card)%keyword == keyword) n = n + 1
      end do
   end function count_cards
end module read_sections

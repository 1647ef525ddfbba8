!> A geometrically exact element with its loads and displacements (all data on which its equations depend, apart from the Gauss
!> points and foundations), and its stages: section forces, strains and directions there, and their derivatives. Notation and
!> equations are those of ge_element.
module ge_stages
   use kinds, only: wp
   use gauss_tableau, only: tableau_t, max_stages
   use rod_load, only: line_before, ge_load_t
   use rod_geometry, only: element_geometry_t
   implicit none
   private
   public :: ge_stages_t, find_stages, press_section, find_stage_force, ge_directions, ge_direction_changes, ge_direction_rates, &
      & ge_data_t, ge_stiffness_t, ge_compliance, forbid_stretch

   !> Compliances of an element; zero means rigid. If the section varies along the element, the values at its middle are scales.
   type :: ge_stiffness_t
      real(wp) :: axial = 0.0_wp   !! 1/EA
      real(wp) :: bending = 0.0_wp !! 1/EI
      real(wp) :: shear = 0.0_wp   !! 1/GA, exactly zero for shear-rigid rods
      real(wp) :: give = 0.0_wp !! axial compliance of the tangent of an inextensible element (1/EA = 0), whose tangent would
      !! otherwise be singular if the element is straight
      real(wp) :: part(3, max_stages) = 1.0_wp !! axial, bending and shear compliance at the stages, over the compliances above
   end type ge_stiffness_t

   !> The element in one state. Notation and equations are those of ge_element.
   type :: ge_data_t
      type(element_geometry_t) :: g               !! stress-free geometry; its length is h, its scale is the factor C
      type(ge_stiffness_t) :: compliance
      type(ge_load_t) :: load
      real(wp) :: u(6) = 0.0_wp                   !! node displacements (u, v, rotation) at the first and the second node
      integer :: unknowns = 0                     !! number of stored unknowns, see ge_size
      real(wp) :: z(3 + 3 * max_stages) = 0.0_wp  !! (unknowns) stored unknowns; entries behind the last one are zero
   end type ge_data_t

   !> Values at the stages of one element in one state. rho is r'/C, g is m'/C.
   type :: ge_stages_t
      integer :: s
      real(wp) :: h, hc                       !! stress-free length h; h times C
      logical :: stored                       !! true: the stored unknowns include n at the stages
      logical :: pressed                      !! true: pressure acts on the element
      real(wp) :: bending(max_stages)         !! bending compliance 1/EI
      real(wp) :: turn(max_stages, max_stages) !! (j, i) derivative of the rotation at stage i by m at stage j
      real(wp), dimension(2, max_stages) :: drop, drop_rate !! dead load between the first end and the stages; its derivative by the
      !! load factor
      real(wp), dimension(2, max_stages) :: nn, t !! section force n; unit normal t of the cross section
      real(wp), dimension(2, max_stages) :: rho, change !! rho, and rho minus its value in the stress-free element
      real(wp) :: g(max_stages)
      real(wp) :: d(2, max_stages), bnn(3, max_stages) !! derivatives of rho by the rotation and by n (components xx, xy, yy); the
      !! derivative of g by n is -d
      real(wp) :: g_phi(max_stages)           !! derivative of g by the rotation
      real(wp) :: heat(2, max_stages), g_heat(max_stages) !! derivatives of rho and g by the load factor, caused by temperature
      real(wp) :: pressure(max_stages), pressure_rate(max_stages) !! pressure p; its derivative by the load factor. Set only if
      !! `pressed`
   end type ge_stages_t

contains

   !> Computes section forces, strains and their derivatives at the stages.
   pure subroutine find_stages(tab, element, stages, more_force)
      type(tableau_t), intent(in) :: tab
      type(ge_data_t), intent(in) :: element
      type(ge_stages_t), intent(out) :: stages
      real(wp), intent(in), optional :: more_force(:, :) !! (2, stages) additional n that enters the derivatives only
      real(wp) :: phi, free, t(2), nu(2), axial, shear, axial_give, shear_give, beta, more(2), along, across, position(2)
      integer :: i, j, s
      s = tab%stages
      free = 1.0_wp + element%load%strain
      associate (a => stages, h => element%g%length, tangent => element%g%tangent, u => element%u, &
         & compliance => element%compliance, load => element%load, z => element%z)
         a%s = s
         a%h = h
         a%hc = h * element%g%scale
         a%stored = element%unknowns > 3 + s
         a%pressed = a%stored .and. (abs(load%pressure) > 0.0_wp .or. abs(load%pressure_rate) > 0.0_wp .or. &
            & any(abs(load%gradient) > 0.0_wp) .or. any(abs(load%gradient_rate) > 0.0_wp))
         do i = 1, s
            axial_give = compliance%axial * compliance%part(1, i)
            shear_give = compliance%shear * compliance%part(3, i)
            beta = axial_give - shear_give
            call line_before(tab, load, i, a%drop(:, i), a%drop_rate(:, i))
            a%drop(:, i) = h * a%drop(:, i)
            a%drop_rate(:, i) = h * a%drop_rate(:, i)
            phi = u(3) + (tab%c(i) * h) * load%curvature
            a%bending(i) = compliance%bending * compliance%part(2, i)
            do j = 1, s
               a%turn(j, i) = h * tab%a(i, j) * (compliance%bending * compliance%part(2, j))
               phi = phi + a%turn(j, i) * z(3 + j)
            end do
            if (a%stored) then
               a%nn(:, i) = z(2 + s + 2 * i:3 + s + 2 * i)
            else
               a%nn(:, i) = z(1:2) - a%drop(:, i)
            end if
            call turn_section(phi, tangent(:, i), a%nn(:, i), load%strain, axial_give, shear_give, t, axial, shear, a%change(:, i))
            nu = [-t(2), t(1)]
            a%t(:, i) = t
            a%rho(:, i) = (free + axial * axial_give) * t + (shear * shear_give) * nu
            a%g(i) = -free * shear - axial * shear * beta
            a%g_phi(i) = free * axial + beta * (axial**2 - shear**2)
            a%d(:, i) = (beta * shear) * t + (free + beta * axial) * nu
            if (present(more_force)) then
               ! The strains do not change; but a section with shear flexibility shears when it rotates under an axial force
               ! (Haringx).
               more = [dot_product(more_force(:, i), t), dot_product(more_force(:, i), nu)]
               across = free + beta * axial - shear_give * more(1)
               along = beta * shear
               a%d(:, i) = along * t + across * nu
               a%g_phi(i) = across * (axial + more(1)) - along * (shear + more(2))
            end if
            a%heat(:, i) = load%strain_rate * t + (tab%c(i) * h * load%curvature_rate) * a%d(:, i)
            a%g_heat(i) = -load%strain_rate * shear + (tab%c(i) * h * load%curvature_rate) * a%g_phi(i)
            a%bnn(1, i) = axial_give * t(1) * t(1) + shear_give * nu(1) * nu(1)
            a%bnn(2, i) = axial_give * t(1) * t(2) + shear_give * nu(1) * nu(2)
            a%bnn(3, i) = axial_give * t(2) * t(2) + shear_give * nu(2) * nu(2)
         end do
         if (.not. a%pressed) return
         do i = 1, s
            position = a%hc * matmul(a%rho(:, :s), tab%a(i, :s))
            a%pressure(i) = load%pressure + dot_product(load%gradient, position)
            a%pressure_rate(i) = load%pressure_rate + dot_product(load%gradient_rate, position)
         end do
      end associate
   end subroutine find_stages

   !> A cross section rotated by phi under a force: its normal, the components of the force, and rho minus its stress-free value,
   !> accurate to the rounding of displacements.
   pure subroutine turn_section(phi, tangent, nn, strain, axial_give, shear_give, t, axial, shear, change)
      real(wp), intent(in) :: phi              !! rotation of the cross section [rad]
      real(wp), intent(in) :: tangent(2)       !! unit normal of the stress-free cross section
      real(wp), intent(in) :: nn(2), strain    !! force n; thermal strain
      real(wp), intent(in) :: axial_give, shear_give !! axial and shear compliance
      real(wp), intent(out) :: t(2), axial, shear, change(2)
      real(wp) :: half
      half = 0.5_wp * phi
      change = (2.0_wp * sin(half)) * (cos(half) * [-tangent(2), tangent(1)] - sin(half) * tangent)
      t = tangent + change
      axial = nn(1) * t(1) + nn(2) * t(2)
      shear = nn(2) * t(1) - nn(1) * t(2)
      change = change + (strain + axial * axial_give) * t + (shear * shear_give) * [-t(2), t(1)]
   end subroutine turn_section

   !> Force of the pressure on a part of the element (sum over the stages of weight p J r'), and its derivatives.
   pure subroutine press_section(tab, element, stages, weight, force, force_rate, by_slope, by_shift)
      type(tableau_t), intent(in) :: tab
      type(ge_data_t), intent(in) :: element
      type(ge_stages_t), intent(in) :: stages
      real(wp), intent(in) :: weight(:)                 !! (stages) quadrature weights of the part
      real(wp), intent(out) :: force(2), force_rate(2)  !! force; its derivative by the load factor
      real(wp), intent(out) :: by_slope(2, 2, max_stages) !! derivatives by r'/C at the stages
      real(wp), intent(out) :: by_shift(2, 2)           !! derivative by the position of the first node
      real(wp) :: side(2)
      integer :: b, c
      force = 0.0_wp
      force_rate = 0.0_wp
      by_slope = 0.0_wp
      by_shift = 0.0_wp
      do b = 1, stages%s
         side = (stages%hc * weight(b)) * [-stages%rho(2, b), stages%rho(1, b)]
         force = force + stages%pressure(b) * side
         force_rate = force_rate + stages%pressure_rate(b) * side
         by_slope(1, 2, b) = by_slope(1, 2, b) - stages%hc * weight(b) * stages%pressure(b)
         by_slope(2, 1, b) = by_slope(2, 1, b) + stages%hc * weight(b) * stages%pressure(b)
         if (.not. any(abs(element%load%gradient) > 0.0_wp)) cycle
         by_shift(1, :) = by_shift(1, :) + side(1) * element%load%gradient
         by_shift(2, :) = by_shift(2, :) + side(2) * element%load%gradient
         do c = 1, stages%s
            by_slope(1, :, c) = by_slope(1, :, c) + (stages%hc * tab%a(b, c) * side(1)) * element%load%gradient
            by_slope(2, :, c) = by_slope(2, :, c) + (stages%hc * tab%a(b, c) * side(2)) * element%load%gradient
         end do
      end do
   end subroutine press_section

   !> Finds the force n at a stage.
   pure subroutine find_stage_force(tab, element, i, nn)
      type(tableau_t), intent(in) :: tab
      type(ge_data_t), intent(in) :: element
      integer, intent(in) :: i
      real(wp), intent(out) :: nn(2)
      real(wp) :: rate(2)
      associate (s => tab%stages, z => element%z)
         if (element%unknowns > 3 + s) then
            nn = z(2 + s + 2 * i:3 + s + 2 * i)
         else
            call line_before(tab, element%load, i, nn, rate)
            nn = z(1:2) - element%g%length * nn
         end if
      end associate
   end subroutine find_stage_force

   !> rho at the stages: derivative of the position by the stress-free arc length, divided by C.
   pure function ge_directions(tab, element) result(rho)
      type(tableau_t), intent(in) :: tab
      type(ge_data_t), intent(in) :: element
      real(wp) :: rho(2, max_stages)           !! (2, stages) only the element's stages are set
      rho = ge_direction_changes(tab, element)
      associate (s => tab%stages)
         rho(:, :s) = rho(:, :s) + element%g%tangent(:, :s)
      end associate
   end function ge_directions

   !> Change of rho from the stress-free element, accurate to the rounding of displacements.
   pure function ge_direction_changes(tab, element) result(change)
      type(tableau_t), intent(in) :: tab
      type(ge_data_t), intent(in) :: element
      real(wp) :: change(2, max_stages)        !! (2, stages) only the element's stages are set
      real(wp) :: phi, nn(2), t(2), axial, shear
      integer :: i
      associate (s => tab%stages, h => element%g%length, compliance => element%compliance, load => element%load)
         do i = 1, s
            phi = element%u(3) + h * compliance%bending * dot_product(tab%a(i, :s) * compliance%part(2, :s), element%z(4:3 + s)) + &
               & (tab%c(i) * h) * load%curvature
            call find_stage_force(tab, element, i, nn)
            call turn_section(phi, element%g%tangent(:, i), nn, load%strain, &
               & compliance%axial * compliance%part(1, i), compliance%shear * compliance%part(3, i), t, axial, shear, change(:, i))
         end do
      end associate
   end function ge_direction_changes

   !> Change of rho caused by changes of the first node's rotation, the stored unknowns and the load factor.
   pure function ge_direction_rates(at, du, dz, load_change) result(rate)
      type(ge_stages_t), intent(in) :: at      !! from find_stages
      real(wp), intent(in) :: du(6), dz(:)     !! changes of the displacements and of the stored unknowns
      real(wp), intent(in) :: load_change      !! change of the load factor
      real(wp) :: rate(2, max_stages)          !! (2, stages) only the element's stages are set
      real(wp) :: dn(2)
      integer :: i
      associate (s => at%s)
         do i = 1, s
            dn = dz(1:2) - load_change * at%drop_rate(:, i)
            if (at%stored) dn = dz(2 + s + 2 * i:3 + s + 2 * i)
            rate(:, i) = (du(3) + dot_product(at%turn(:s, i), dz(4:3 + s))) * at%d(:, i) + load_change * at%heat(:, i) + &
               & [dot_product(at%bnn(1:2, i), dn), dot_product(at%bnn(2:3, i), dn)]
         end do
      end associate
   end function ge_direction_rates

   !> Compliances of an element with the stiffnesses EA, EI and, if it shears, GA.
   pure function ge_compliance(stages, h, ea, ei, ga, shear_rigid) result(compliance)
      integer, intent(in) :: stages
      real(wp), intent(in) :: h, ea, ei, ga   !! stress-free length; stiffnesses EA, EI and GA
      logical, intent(in) :: shear_rigid      !! true: the element has no shear flexibility, and GA is not used
      type(ge_stiffness_t) :: compliance
      compliance%axial = 1.0_wp / ea
      compliance%bending = 1.0_wp / ei
      if (.not. shear_rigid) compliance%shear = 1.0_wp / ga
      if (stages == 1) compliance%shear = compliance%shear + h**2 / (12.0_wp * ei)
   end function ge_compliance

   !> Makes an element inextensible. Its tangent gets an axial compliance of size**2/EI times the root of the rounding unit. Two
   !> errors are then equally small: the rounding error multiplied by the remaining stiffness, and the artificial extension left in
   !> a solution.
   pure subroutine forbid_stretch(compliance, size)
      type(ge_stiffness_t), intent(inout) :: compliance
      real(wp), intent(in) :: size             !! size of the structure [length]
      compliance%axial = 0.0_wp
      compliance%give = sqrt(epsilon(size)) * size**2 * compliance%bending
   end subroutine forbid_stretch
end module ge_stages

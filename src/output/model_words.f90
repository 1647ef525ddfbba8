!> Monitors, parameters of limit curves, obstacles and contacts in words, for the result file and the listing.
module model_words
   use kinds, only: wp, degree
   use model, only: model_t, monitor_t, limit_curve_t, quantity_displacement, quantity_reaction, quantity_contact, &
      & quantity_section, contact_t
   use section_kinds, only: section_kind
   use text, only: to_text, plural
   use obstacle_types, only: obstacle_t, obstacle_line, obstacle_circle, obstacle_arc, obstacle_polyline, ground_half_space, &
      & ground_pasternak
   use columns, only: brief, pair
   implicit none
   private
   public :: monitor_units, monitor_description, parameter_units, parameter_object, obstacle_text, contact_text, kind_name, &
      & side_name, points_name

   !> Units, in words, of the parameters of limit curves, in the order of the parameters' words in the deck; '1' for a factor.
   character(*), parameter :: parameter_units(6) = [character(16) :: 'force / length^2', 'length', '1', 'force', &
      & 'force length^2', '1']

   !> Words for the kinds of obstacles, in the order of the constants obstacle_... of module obstacle_types.
   character(*), parameter :: obstacle_name(5) = [character(8) :: 'line', 'circle', 'arc', 'polyline', 'spline']

contains

   !> Units of a monitor in words; if its factor is not 1, they are called "scaled".
   pure function monitor_units(monitor) result(units)
      type(monitor_t), intent(in) :: monitor
      character(:), allocatable :: units
      if (monitor%quantity == quantity_section) then
         units = trim(section_kind(monitor%component)%units)
         if (monitor%where) units = 'length'
      else if (monitor%quantity == quantity_displacement) then
         units = 'length'
         if (monitor%component == 3) units = 'radian'
      else
         units = 'force'
         if (monitor%component == 3 .and. monitor%quantity == quantity_reaction) units = 'moment'
      end if
      if (abs(abs(monitor%factor) - 1.0_wp) > 0.0_wp) units = 'scaled '//units
   end function monitor_units

   !> Description of a monitor, such as "mean displacement v of 3 nodes, times -1".
   pure function monitor_description(monitor, model) result(description)
      type(monitor_t), intent(in) :: monitor
      type(model_t), intent(in) :: model          !! model, which has the label of the node and the name of the obstacle
      character(:), allocatable :: description
      character(*), parameter :: of_nodes(3, 2) = reshape([character(15) :: 'displacement u', 'displacement v', 'rotation', &
         & 'reaction in x', 'reaction in y', 'reaction moment'], [3, 2]) ! in the order of quantity_...
      character(*), parameter :: contact(2) = ['in x', 'in y']
      if (monitor%quantity == quantity_section) then
         description = trim(section_kind(monitor%component)%name)
         if (monitor%where) then
            description = 'place of the largest '//description
         else if (monitor%largest) then
            description = 'largest '//description
         else
            description = description//' at s = '//to_text(monitor%place)
         end if
         description = description//' along '//to_text(size(monitor%element))//' elements'
      else if (monitor%quantity == quantity_contact) then
         description = 'sum of normal contact reactions of '//trim(model%obstacle(monitor%obstacle)%name)
         if (monitor%component < 3) description = 'sum of contact reactions '//contact(monitor%component)//' of '// &
            & trim(model%obstacle(monitor%obstacle)%name)
      else
         description = trim(of_nodes(monitor%component, monitor%quantity))//' of '
         if (size(monitor%node) == 1) then
            description = description//'node '//to_text(model%mesh%node_label(monitor%node(1)))
         else
            description = trim(merge('mean  ', 'sum of', monitor%quantity == quantity_displacement))//' '//description// &
               & to_text(size(monitor%node))//' nodes'
         end if
      end if
      if (abs(monitor%factor - 1.0_wp) > 0.0_wp) description = description//', times '//to_text(monitor%factor)
      if (abs(monitor%offset) > 0.0_wp) description = description//', plus '//to_text(monitor%offset)
   end function monitor_description

   !> Name of the obstacle or element set whose parameter varies; blank for the constant load.
   pure function parameter_object(curve, model) result(name)
      type(limit_curve_t), intent(in) :: curve
      type(model_t), intent(in) :: model
      character(:), allocatable :: name
      name = trim(curve%set)
      if (curve%obstacle > 0) name = trim(model%obstacle(curve%obstacle)%name)
   end function parameter_object

   !> An obstacle: name, shape and foundation.
   pure function obstacle_text(model, number) result(text)
      type(model_t), intent(in) :: model
      integer, intent(in) :: number             !! index of the obstacle
      character(:), allocatable :: text
      associate (obstacle => model%obstacle(number))
         if (obstacle%at_nodes) then
            text = trim(obstacle%name)//stop_text(obstacle)//foundation_text(model, obstacle, ', stiffness ', ', by the law ')
         else
            text = trim(obstacle%name)//': '//kind_name(obstacle)//shape_text(obstacle)//foundation_text(model, obstacle, &
               & ', Winkler foundation of modulus ', ', foundation by the law ')
            if (obstacle%bilateral) text = text//', bilateral'
            if (obstacle%carrier > 0) text = text//', moves with node '//to_text(model%mesh%node_label(obstacle%carrier))
         end if
      end associate
      if (.not. is_touched(model, number)) text = text//'; no *CONTACT names it, rods go through it'
   end function obstacle_text

   !> Shape and place of an obstacle that is not at nodes.
   pure function shape_text(obstacle) result(text)
      type(obstacle_t), intent(in) :: obstacle
      character(:), allocatable :: text
      select case (merge(0, obstacle%kind, obstacle%along_rod))
      case (0)
         text = ' along '//pair([-obstacle%point(2, 2), obstacle%point(1, 2)])
      case (obstacle_line)
         text = ' from '//pair(obstacle%point(:, 1))//' to '//pair(obstacle%point(:, 2))//', structure on its left'
      case (obstacle_circle)
         text = ' of radius '//brief(obstacle%radius)//' about '//pair(obstacle%centre) //', structure '// &
            side_name(obstacle)//', angles from '//brief(obstacle%reference_angle / degree) //' degrees'
      case (obstacle_arc)
         text = ' of radius '//brief(obstacle%radius)//' about '//pair(obstacle%centre)//' from '// &
            & brief(obstacle%angle(1) / degree)//' to '//brief(obstacle%angle(2) / degree)//' degrees, structure on its left' &
            & //', angles from '//brief(obstacle%reference_angle / degree)//' degrees'
      case default
         text = ' through '//plural(size(obstacle%point, 2), 'point')//' from '//pair(obstacle%point(:, 1))//' to '// &
            & pair(obstacle%point(:, size(obstacle%point, 2)))
         if (obstacle%kind == obstacle_polyline) text = text//', corners of radius '//brief(obstacle%radius)
         text = text//', structure on its left'
      end select
   end function shape_text

   !> Stiffness of an obstacle.
   pure function foundation_text(model, obstacle, linear, by_law) result(text)
      type(model_t), intent(in) :: model
      type(obstacle_t), intent(in) :: obstacle
      character(*), intent(in) :: linear, by_law !! words before the stiffness and before the name of a law
      character(:), allocatable :: text
      if (obstacle%rigid) then
         text = ', rigid'
      else if (obstacle%law > 0) then
         text = by_law//trim(model%law(obstacle%law)%name)
      else if (obstacle%ground == ground_half_space) then
         text = ', elastic half-space with E = '//brief(obstacle%young)//', nu = '//brief(obstacle%poisson)// &
            & ' under a strip of width '//brief(obstacle%width)
      else if (obstacle%ground == ground_pasternak) then
         text = ', Pasternak foundation of modulus '//brief(obstacle%modulus)//', shear '//brief(obstacle%shear)
      else
         text = linear//brief(obstacle%modulus)
      end if
   end function foundation_text

   !> Description of stops or springs at nodes.
   pure function stop_text(obstacle) result(text)
      type(obstacle_t), intent(in) :: obstacle
      character(:), allocatable :: text
      if (obstacle%kind == obstacle_circle) then
         text = 'presses'
         if (obstacle%inside) text = 'pulls'
         if (obstacle%bilateral) text = 'pulls and presses'
         text = ': member of length '//brief(obstacle%radius)//' that '//text
      else
         text = ': stops at nodes, they push towards '
         if (obstacle%bilateral) text = ': springs at nodes, they act along '
         associate (d => obstacle%point(:, 2) - obstacle%point(:, 1))
            text = text//pair([-d(2), d(1)])
         end associate
      end if
   end function stop_text

   !> True if a contact names an obstacle.
   pure logical function is_touched(model, obstacle)
      type(model_t), intent(in) :: model
      integer, intent(in) :: obstacle           !! index of the obstacle
      integer :: k
      is_touched = any(model%contact%obstacle == obstacle)
      do k = 1, size(model%contact)
         if (allocated(model%contact(k)%part)) is_touched = is_touched .or. any(model%contact(k)%part%obstacle == obstacle)
      end do
   end function is_touched

   !> A contact: candidates, obstacle, and where its reactions act.
   pure function contact_text(model, contact) result(text)
      type(model_t), intent(in) :: model
      type(contact_t), intent(in) :: contact
      character(:), allocatable :: text
      integer :: k
      text = trim(model%obstacle(contact%obstacle)%name)
      if (allocated(contact%part)) then
         do k = 2, size(contact%part)
            text = text//', '//trim(model%obstacle(contact%part(k)%obstacle)%name)
         end do
         text = 'one wall of '//text
      end if
      text = plural(size(contact%node), 'candidate')//' for '//text
      if (abs(contact%gap) > 0.0_wp) text = text//', gap '//brief(contact%gap)
      if (contact%along) text = text//', points and lines anywhere along the rod'
      if (contact%distributed) text = text//', all along the elements'
      if (.not. (contact%along .or. contact%distributed)) text = text//', at the nodes'
      if (allocated(contact%needs)) text = text//': along the rod it needs '//contact%needs
   end function contact_text

   !> Kind of an obstacle in words: "line" ..., "gap" for stops at nodes, "soil" for soil along a rod.
   pure function kind_name(obstacle) result(name)
      type(obstacle_t), intent(in) :: obstacle
      character(:), allocatable :: name
      name = trim(obstacle_name(obstacle%kind))
      if (obstacle%along_rod) name = 'soil'
      if (obstacle%at_nodes) name = 'gap'
   end function kind_name

   !> The side of an obstacle on which the structure may be: "inside" or "outside" of a circle, "left" of the others.
   pure function side_name(obstacle) result(name)
      type(obstacle_t), intent(in) :: obstacle
      character(:), allocatable :: name
      if (obstacle%kind /= obstacle_circle) then
         name = 'left'
      else if (obstacle%inside) then
         name = 'inside'
      else
         name = 'outside'
      end if
   end function side_name

   !> Where the reactions of a contact act: at "nodes", at points and lines of contact "spans", or "distributed" along elements.
   elemental function points_name(contact) result(name)
      type(contact_t), intent(in) :: contact
      character(11) :: name
      name = 'nodes'
      if (contact%along) name = 'spans'
      if (contact%distributed) name = 'distributed'
   end function points_name
end module model_words

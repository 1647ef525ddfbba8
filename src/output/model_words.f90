!> Components of the model in words, for the result file and the listing.
module model_words
   use kinds, only: wp
   use model, only: model_t, monitor_t, contact_t, limit_curve_t, quantity_displacement, quantity_reaction, &
      & quantity_contact, quantity_section, &
      & method_load, method_displacement, method_cylindrical, method_spherical, method_linearised, &
      & method_minimum_residual, method_variable_load, method_generalised, method_largest, &
      & parameter_modulus, parameter_gap, parameter_imperfection, parameter_ea, parameter_ei
   use obstacle_types, only: obstacle_t, obstacle_line, obstacle_circle, obstacle_arc, obstacle_polyline
   use text, only: to_text
   implicit none
   private
   public :: monitor_units, monitor_description, method_name, side_name, kind_name, points_name
   public :: parameter_name, parameter_units, parameter_object

   !> Quantities of sections and their units, in the order of monitor_t%component.
   character(*), parameter :: section_quantity(5) = [character(12) :: 'normal force', 'shear force', 'moment', 'strain', 'stress']
   character(*), parameter :: section_unit(5) = [character(14) :: 'force', 'force', 'moment', '1', 'force/length^2']

contains

   !> Units of a monitor in words; a factor other than 1 makes them "scaled".
   pure function monitor_units(monitor) result(units)
      type(monitor_t), intent(in) :: monitor
      character(:), allocatable :: units
      if (monitor%quantity == quantity_section) then
         units = trim(section_unit(monitor%component))
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
      type(model_t), intent(in) :: model          !! for the node's label and the obstacle's name
      character(:), allocatable :: description
      character(*), parameter :: displacement(3) = [character(14) :: 'displacement u', 'displacement v', 'rotation']
      character(*), parameter :: reaction(3) = [character(15) :: 'reaction in x', 'reaction in y', 'reaction moment']
      character(*), parameter :: contact(2) = ['in x', 'in y']
      if (monitor%quantity == quantity_section) then
         description = ''
      else if (monitor%quantity == quantity_displacement) then
         description = trim(displacement(monitor%component))
         if (size(monitor%node) > 1) description = 'mean '//description
      else
         description = trim(reaction(monitor%component))
         if (size(monitor%node) > 1) description = 'sum of '//description
      end if
      if (monitor%quantity == quantity_section) then
         description = trim(section_quantity(monitor%component))
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
      else if (size(monitor%node) == 1) then
         description = description//' of node '//to_text(model%mesh%node_label(monitor%node(1)))
      else
         description = description//' of '//to_text(size(monitor%node))//' nodes'
      end if
      if (abs(monitor%factor - 1.0_wp) > 0.0_wp) description = description//', times '//to_text(monitor%factor)
      if (abs(monitor%offset) > 0.0_wp) description = description//', plus '//to_text(monitor%offset)
   end function monitor_description

   !> The deck's word for an increment strategy.
   pure function method_name(method) result(name)
      integer, intent(in) :: method               !! method_...
      character(:), allocatable :: name
      select case (method)
      case (method_load)
         name = 'LOAD'
      case (method_displacement)
         name = 'DISPLACEMENT'
      case (method_cylindrical)
         name = 'CYLINDRICAL'
      case (method_spherical)
         name = 'SPHERICAL'
      case (method_linearised)
         name = 'LINEARISED'
      case (method_minimum_residual)
         name = 'MINIMUM RESIDUAL'
      case (method_variable_load)
         name = 'VARIABLE LOAD'
      case (method_generalised)
         name = 'GENERALISED DISPLACEMENT'
      case (method_largest)
         name = 'LARGEST DISPLACEMENT'
      end select
   end function method_name

   !> Kind of an obstacle: "line", "circle", "arc", "polyline", "spline", or "gap" for stops at nodes.
   pure function kind_name(obstacle) result(name)
      type(obstacle_t), intent(in) :: obstacle
      character(:), allocatable :: name
      if (obstacle%at_nodes) then
         name = 'gap'
         return
      end if
      if (obstacle%along_rod) then
         name = 'soil'
         return
      end if
      select case (obstacle%kind)
      case (obstacle_line)
         name = 'line'
      case (obstacle_circle)
         name = 'circle'
      case (obstacle_arc)
         name = 'arc'
      case (obstacle_polyline)
         name = 'polyline'
      case default
         name = 'spline'
      end select
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

   !> Places at which the reactions of a contact act: at "nodes", at points and lines of "spans", or "distributed" along elements.
   elemental function points_name(contact) result(name)
      type(contact_t), intent(in) :: contact
      character(11) :: name
      name = 'nodes'
      if (contact%along) name = 'spans'
      if (contact%distributed) name = 'distributed'
   end function points_name

   !> The deck's word for the parameter that a limit curve varies.
   pure function parameter_name(parameter) result(name)
      integer, intent(in) :: parameter            !! parameter_...
      character(:), allocatable :: name
      select case (parameter)
      case (parameter_modulus)
         name = 'MODULUS'
      case (parameter_gap)
         name = 'GAP'
      case (parameter_imperfection)
         name = 'IMPERFECTION'
      case (parameter_ea)
         name = 'EA'
      case (parameter_ei)
         name = 'EI'
      case default
         name = 'CONSTANT LOAD'
      end select
   end function parameter_name

   !> Units of such a parameter in words; '1' for a factor.
   pure function parameter_units(parameter) result(units)
      integer, intent(in) :: parameter            !! parameter_...
      character(:), allocatable :: units
      select case (parameter)
      case (parameter_modulus)
         units = 'force / length^2'
      case (parameter_gap)
         units = 'length'
      case (parameter_ea)
         units = 'force'
      case (parameter_ei)
         units = 'force length^2'
      case default
         units = '1'
      end select
   end function parameter_units

   !> Name of the obstacle or element set whose parameter varies; blank for the constant load.
   pure function parameter_object(curve, model) result(name)
      type(limit_curve_t), intent(in) :: curve
      type(model_t), intent(in) :: model
      character(:), allocatable :: name
      name = trim(curve%set)
      if (curve%obstacle > 0) name = trim(model%obstacle(curve%obstacle)%name)
   end function parameter_object
end module model_words

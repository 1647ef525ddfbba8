!> Monitors and parameters of limit curves in words, for the result file and the listing.
module model_words
   use kinds, only: wp
   use model, only: model_t, monitor_t, limit_curve_t, quantity_displacement, quantity_reaction, quantity_contact, &
      & quantity_section, section_stress
   use text, only: to_text
   implicit none
   private
   public :: monitor_units, monitor_description, parameter_units, parameter_object

   !> Section quantities and their units, in the order of monitor_t%component.
   character(*), parameter :: section_quantity(section_stress) = [character(12) :: 'normal force', 'shear force', 'moment', &
      & 'strain', 'stress']
   character(*), parameter :: section_unit(section_stress) = [character(14) :: 'force', 'force', 'moment', '1', &
      & 'force/length^2']

   !> Units, in words, of the parameters of limit curves, in the order of the parameters' words in the deck; '1' for a factor.
   character(*), parameter :: parameter_units(6) = [character(16) :: 'force / length^2', 'length', '1', 'force', &
      & 'force length^2', '1']

contains

   !> Units of a monitor in words; if its factor is not 1, they are called "scaled".
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
      type(model_t), intent(in) :: model          !! model, which has the label of the node and the name of the obstacle
      character(:), allocatable :: description
      character(*), parameter :: of_nodes(3, 2) = reshape([character(15) :: 'displacement u', 'displacement v', 'rotation', &
         & 'reaction in x', 'reaction in y', 'reaction moment'], [3, 2]) ! in the order of quantity_...
      character(*), parameter :: contact(2) = ['in x', 'in y']
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
end module model_words

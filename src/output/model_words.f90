!> Words for what the model holds, used by the result file and the listing.
module model_words
   use kinds, only: wp
   use model, only: mesh_t, monitor_t, obstacle_t, family_ul2, quantity_displacement, &
      & method_load, method_displacement, method_cylindrical, method_spherical, method_minimum_residual
   use text, only: to_text
   implicit none
   private
   public :: monitor_units, monitor_description, family_name, method_name, side_name

contains

   !> Units of a monitor in words; a factor other than 1 makes them "scaled".
   pure function monitor_units(monitor) result(units)
      type(monitor_t), intent(in) :: monitor
      character(:), allocatable :: units
      if (monitor%quantity == quantity_displacement) then
         units = 'length'
         if (monitor%component == 3) units = 'radian'
      else
         units = 'force'
         if (monitor%component == 3) units = 'moment'
      end if
      if (abs(abs(monitor%factor) - 1.0_wp) > 0.0_wp) units = 'scaled '//units
   end function monitor_units

   !> What a monitor is: "mean displacement v of 3 nodes, times -1".
   pure function monitor_description(monitor, mesh) result(description)
      type(monitor_t), intent(in) :: monitor
      type(mesh_t), intent(in) :: mesh            !! for the node's label
      character(:), allocatable :: description
      character(*), parameter :: displacement(3) = [character(14) :: 'displacement u', 'displacement v', 'rotation']
      character(*), parameter :: reaction(3) = [character(15) :: 'reaction in x', 'reaction in y', 'reaction moment']
      if (monitor%quantity == quantity_displacement) then
         description = trim(displacement(monitor%component))
         if (size(monitor%node) > 1) description = 'mean '//description
      else
         description = trim(reaction(monitor%component))
         if (size(monitor%node) > 1) description = 'sum of '//description
      end if
      if (size(monitor%node) == 1) then
         description = description//' of node '//to_text(mesh%node_label(monitor%node(1)))
      else
         description = description//' of '//to_text(size(monitor%node))//' nodes'
      end if
      if (abs(monitor%factor - 1.0_wp) > 0.0_wp) description = description//', times '//to_text(monitor%factor)
      if (abs(monitor%offset) > 0.0_wp) description = description//', plus '//to_text(monitor%offset)
   end function monitor_description

   !> The deck's word for an element family: UL2, GE2, GE4, ...
   pure function family_name(family, stages) result(name)
      integer, intent(in) :: family, stages       !! of mesh_t
      character(:), allocatable :: name
      if (family == family_ul2) then
         name = 'UL2'
      else
         name = 'GE'//to_text(2 * stages)
      end if
   end function family_name

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
      case default
         name = 'LINEARISED'
      case (method_minimum_residual)
         name = 'MINIMUM RESIDUAL'
      end select
   end function method_name

   !> The side of an obstacle on which the structure may be: "inside" or "outside" of a circle, "left" of a line.
   pure function side_name(obstacle) result(name)
      type(obstacle_t), intent(in) :: obstacle
      character(:), allocatable :: name
      if (.not. obstacle%is_circle) then
         name = 'left'
      else if (obstacle%inside) then
         name = 'inside'
      else
         name = 'outside'
      end if
   end function side_name
end module model_words

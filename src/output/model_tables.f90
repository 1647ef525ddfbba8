!> Writes supports, springs, loads of the steps and node sets to the result file. A failure is stored in the file, see hdf5_file.
module model_tables
   use kinds, only: wp
   use text, only: to_text
   use rod_geometry, only: geometry_t, new_geometry
   use rod_samples, only: add_line_loads
   use gauss_tableau, only: max_stages
   use model, only: model_t, step_t, supports
   use hdf5_file, only: hdf5_file_t, hdf5_group
   use hdf5_attributes, only: hdf5_attribute
   use hdf5_datasets, only: hdf5_write
   use result_tables, only: link_name
   implicit none
   private
   public :: write_supports, write_loads, write_sets

   character(*), parameter :: node_rows = 'rows of /mesh/coordinates (from 0)', element_rows = 'rows of /mesh/elements (from 0)'

contains

   !> Writes the group /supports: fixed unknowns and springs.
   subroutine write_supports(file, model)
      type(hdf5_file_t), intent(inout) :: file
      type(model_t), intent(in) :: model
      integer, allocatable :: held(:)
      logical :: fixed(3, model%mesh%n_nodes)
      integer :: i
      call hdf5_group(file, '/supports')
      fixed = supports(model)
      held = where_any(fixed)
      if (size(held) > 0) then
         call hdf5_write(file, '/supports/node', held - 1, '1', 'supported nodes: '//node_rows)
         call hdf5_write(file, '/supports/fixed', reshape(merge(1, 0, fixed(:, held)), [3, size(held)]), '1', &
            & '1 where u, v, rotation of the node are held')
      end if
      held = where_any(model%spring > 0.0_wp)
      if (size(held) > 0) then
         call hdf5_write(file, '/supports/spring_node', held - 1, '1', 'nodes with springs to the ground: '//node_rows)
         call hdf5_write(file, '/supports/spring', model%spring(:, held), 'force/length, force/length, moment/radian', &
            & 'their stiffness for u, v, rotation')
      end if
      associate (pair => pack([(i, i=1, size(model%relative, 2))], model%relative(3, :) > 0))
         if (size(pair) > 0) call hdf5_write(file, '/supports/relative_node', model%relative(2:, pair) - 1, '1', &
            & 'stops, springs by a law and members between two nodes: '//node_rows)
      end associate
      associate (spring => model%joint_spring)
         if (size(spring) == 0) return
         call hdf5_write(file, '/supports/joint_spring_node', reshape([(spring(i)%node - 1, i=1, size(spring))], &
            & [2, size(spring)]), '1', 'springs between two nodes: '//node_rows)
         call hdf5_write(file, '/supports/joint_spring', spring%stiffness, 'force/length, moment/radian', 'their stiffness')
      end associate
   end subroutine write_supports

   !> Writes the group /loads, one group for each step: the loads that the step's load factor multiplies, without zeros.
   subroutine write_loads(file, model)
      type(hdf5_file_t), intent(inout) :: file
      type(model_t), intent(in) :: model
      type(geometry_t) :: home
      integer :: i
      home = new_geometry(model)
      call hdf5_group(file, '/loads')
      do i = 1, size(model%step)
         call write_step_loads(file, model, home, model%step(i), '/loads/'//to_text(i))
      end do
   end subroutine write_loads

   !> Writes the loads of one step.
   subroutine write_step_loads(file, model, home, step, group)
      type(hdf5_file_t), intent(inout) :: file
      type(model_t), intent(in) :: model
      type(geometry_t), intent(in) :: home
      type(step_t), intent(in) :: step
      character(*), intent(in) :: group
      integer, allocatable :: at(:)
      real(wp), allocatable :: pole(:, :), line(:, :), pressure(:)
      real(wp) :: stages(2, max_stages)
      logical :: varies
      integer :: i
      call hdf5_group(file, group)
      call hdf5_attribute(file, group, 'name', step%name)
      call hdf5_attribute(file, group, 'stress_free_start', merge(1, 0, size(step%mode_offset) > 0))
      associate (load => step%load)
         at = where_any(abs(load%node_force) > 0.0_wp)
         if (size(at) > 0) then
            call hdf5_write(file, group//'/node', at - 1, '1', 'nodes with forces: '//node_rows)
            call hdf5_write(file, group//'/force', load%node_force(:, at), 'force, force, moment', 'in x, in y, and the couple')
         end if
         allocate (line(2, model%mesh%n_elements), pressure(model%mesh%n_elements))
         do i = 1, model%mesh%n_elements
            associate (n => max(1, model%mesh%stages(i)), ends => model%mesh%node(:, i))
               stages = 0.0_wp
               call add_line_loads(model, home, i, load, stages(:, :n), varies)
               line(:, i) = load%line_force(:, i) + sum(stages(:, :n), 2) / n
               pressure(i) = load%pressure(i) + 0.5_wp * dot_product(load%gradient(:, i), home%x(:, ends(1)) + home%x(:, ends(2)))
            end associate
         end do
         at = where_any(abs(line) > 0.0_wp)
         if (size(at) > 0) then
            call hdf5_write(file, group//'/element', at - 1, '1', 'elements with dead loads: '//element_rows)
            call hdf5_write(file, group//'/line_force', line(:, at), 'force/length', &
               & 'in x and y, per stress-free length, at the middle of the element')
         end if
         at = pack([(i, i=1, size(pressure))], abs(pressure) > 0.0_wp)
         if (size(at) > 0) then
            call hdf5_write(file, group//'/pressed_element', at - 1, '1', 'elements with pressure: '//element_rows)
            call hdf5_write(file, group//'/pressure', pressure(at), 'force/length', &
               & 'to the left of the element, follows it; at the middle of the stress-free element')
         end if
         at = pack([(i, i=1, size(load%strain))], abs(load%strain) > 0.0_wp .or. abs(load%curvature) > 0.0_wp)
         if (size(at) > 0) then
            call hdf5_write(file, group//'/heated_element', at - 1, '1', 'elements with a change of temperature: '//element_rows)
            call hdf5_write(file, group//'/strain', load%strain(at), '1', 'strain that it would give a free element')
            call hdf5_write(file, group//'/curvature', load%curvature(at), '1/length', 'and its change of curvature')
         end if
         at = where_any(abs(load%displacement) > 0.0_wp)
         if (size(at) > 0) then
            call hdf5_write(file, group//'/displaced_node', at - 1, '1', 'nodes with prescribed displacements: '//node_rows)
            call hdf5_write(file, group//'/displacement', load%displacement(:, at), 'length, length, radian', &
               & 'u, v, rotation')
         end if
         at = where_any(abs(load%motion) > 0.0_wp)
         if (size(at) > 0) then
            call hdf5_write(file, group//'/moved_obstacle', at, '1', 'obstacles that move, from 1')
            call hdf5_write(file, group//'/motion', load%motion(:, at), 'length', 'how far, in x and y')
         end if
         allocate (pole(4, size(load%pole_load)))
         do i = 1, size(load%pole_load)
            pole(:, i) = [load%pole_load(i)%node - 1.0_wp, load%pole_load(i)%pole, load%pole_load(i)%magnitude]
         end do
         if (size(pole) > 0) call hdf5_write(file, group//'/pole', pole, '1, length, length, force', &
            & 'forces whose line passes through a fixed point: node (row of /mesh/coordinates, from 0), that point, the force '// &
            & 'towards it')
      end associate
   end subroutine write_step_loads

   !> Writes the group /sets: the nodes of each set.
   subroutine write_sets(file, model)
      type(hdf5_file_t), intent(inout) :: file
      type(model_t), intent(in) :: model
      integer :: i
      call hdf5_group(file, '/sets')
      do i = 1, size(model%node_set)
         if (size(model%node_set(i)%node) == 0) cycle
         call hdf5_write(file, '/sets/'//link_name(model%node_set(i)%name), model%node_set(i)%node - 1, '1', &
            & 'nodes of the set: '//node_rows)
      end do
   end subroutine write_sets

   !> Indices of the columns with at least one true entry.
   pure function where_any(mask) result(columns)
      logical, intent(in) :: mask(:, :)
      integer, allocatable :: columns(:)
      integer :: i
      columns = pack([(i, i=1, size(mask, 2))], any(mask, 1))
   end function where_any
end module model_tables

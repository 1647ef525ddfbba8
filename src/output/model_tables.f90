!> Writes supports, springs, loads of the steps and node sets to the result file.
module model_tables
   use kinds, only: wp
   use text, only: to_text
   use rod_geometry, only: geometry_t
   use rod_samples, only: add_line_loads
   use gauss_tableau, only: max_stages
   use model, only: model_t, step_t, supports
   use file_items, only: data_t, data_of
   use result_file, only: result_file_t, put_group, put_data, put_attribute
   use result_tables, only: link_name
   implicit none
   private
   public :: write_supports, write_loads, write_sets

   character(*), parameter :: node_rows = 'rows of /mesh/coordinates (from 0)', element_rows = 'rows of /mesh/elements (from 0)'

contains

   !> Writes the group /supports: fixed unknowns and springs.
   subroutine write_supports(file, model)
      type(result_file_t), intent(inout) :: file
      type(model_t), intent(in) :: model
      integer, allocatable :: held(:)
      logical :: fixed(3, model%mesh%n_nodes)
      integer :: i
      call put_group(file, '/supports')
      fixed = supports(model)
      held = where_any(fixed)
      call put_some(file, '/supports/node', data_of(held - 1), '1', 'supported nodes: '//node_rows)
      call put_some(file, '/supports/fixed', data_of(merge(1, 0, fixed(:, held))), '1', &
         & '1 where u, v, rotation of the node are held')
      held = where_any(model%spring > 0.0_wp)
      call put_some(file, '/supports/spring_node', data_of(held - 1), '1', 'nodes with springs to the ground: '//node_rows)
      call put_some(file, '/supports/spring', data_of(model%spring(:, held)), 'force/length, force/length, moment/radian', &
         & 'their stiffness for u, v, rotation')
      held = pack([(i, i=1, size(model%relative, 2))], model%relative(3, :) > 0)
      call put_some(file, '/supports/relative_node', data_of(model%relative(2:, held) - 1), '1', &
         & 'stops, springs by a law and members between two nodes: '//node_rows)
      associate (spring => model%joint_spring)
         call put_some(file, '/supports/joint_spring_node', data_of(reshape([(spring(i)%node - 1, i=1, size(spring))], &
            & [2, size(spring)])), '1', 'springs between two nodes: '//node_rows)
         call put_some(file, '/supports/joint_spring', data_of(spring%stiffness), 'force/length, moment/radian', 'their stiffness')
      end associate
   end subroutine write_supports

   !> As put_data, unless there are no values.
   subroutine put_some(file, path, values, units, description)
      type(result_file_t), intent(inout) :: file
      character(*), intent(in) :: path, units, description
      type(data_t), intent(in) :: values
      if (size(values%bytes) > 0) call put_data(file, path, values, units, description)
   end subroutine put_some

   !> Writes the group /loads, one group for each step: the loads that the step's load factor multiplies, without zeros.
   subroutine write_loads(file, model, home)
      type(result_file_t), intent(inout) :: file
      type(model_t), intent(in) :: model
      type(geometry_t), intent(in) :: home     !! geometry of the model
      integer :: i
      call put_group(file, '/loads')
      do i = 1, size(model%step)
         call write_step_loads(file, model, home, model%step(i), '/loads/'//to_text(i))
      end do
   end subroutine write_loads

   !> Writes the loads of one step.
   subroutine write_step_loads(file, model, home, step, group)
      type(result_file_t), intent(inout) :: file
      type(model_t), intent(in) :: model
      type(geometry_t), intent(in) :: home
      type(step_t), intent(in) :: step
      character(*), intent(in) :: group
      integer, allocatable :: at(:)
      real(wp), allocatable :: pole(:, :), line(:, :), pressure(:)
      real(wp) :: stages(2, max_stages)
      logical :: varies
      integer :: i
      call put_group(file, group)
      call put_attribute(file, group, 'name', data_of(step%name))
      call put_attribute(file, group, 'stress_free_start', data_of(merge(1, 0, size(step%mode_offset) > 0)))
      associate (load => step%load)
         at = where_any(abs(load%node_force) > 0.0_wp)
         call put_some(file, group//'/node', data_of(at - 1), '1', 'nodes with forces: '//node_rows)
         call put_some(file, group//'/force', data_of(load%node_force(:, at)), 'force, force, moment', 'in x, in y, and the couple')
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
         call put_some(file, group//'/element', data_of(at - 1), '1', 'elements with dead loads: '//element_rows)
         call put_some(file, group//'/line_force', data_of(line(:, at)), 'force/length', &
            & 'in x and y, per stress-free length, at the middle of the element')
         at = pack([(i, i=1, size(pressure))], abs(pressure) > 0.0_wp)
         call put_some(file, group//'/pressed_element', data_of(at - 1), '1', 'elements with pressure: '//element_rows)
         call put_some(file, group//'/pressure', data_of(pressure(at)), 'force/length', &
            & 'to the left of the element, follows it; at the middle of the stress-free element')
         at = pack([(i, i=1, size(load%strain))], abs(load%strain) > 0.0_wp .or. abs(load%curvature) > 0.0_wp)
         call put_some(file, group//'/heated_element', data_of(at - 1), '1', 'elements with a change of temperature: '// &
            & element_rows)
         call put_some(file, group//'/strain', data_of(load%strain(at)), '1', 'strain that it would give a free element')
         call put_some(file, group//'/curvature', data_of(load%curvature(at)), '1/length', 'and its change of curvature')
         at = where_any(abs(load%displacement) > 0.0_wp)
         call put_some(file, group//'/displaced_node', data_of(at - 1), '1', 'nodes with prescribed displacements: '//node_rows)
         call put_some(file, group//'/displacement', data_of(load%displacement(:, at)), 'length, length, radian', 'u, v, rotation')
         at = where_any(abs(load%motion) > 0.0_wp)
         call put_some(file, group//'/moved_obstacle', data_of(at), '1', 'obstacles that move, from 1')
         call put_some(file, group//'/motion', data_of(load%motion(:, at)), 'length', 'how far, in x and y')
         allocate (pole(4, size(load%pole_load)))
         do i = 1, size(load%pole_load)
            pole(:, i) = [load%pole_load(i)%node - 1.0_wp, load%pole_load(i)%pole, load%pole_load(i)%magnitude]
         end do
         call put_some(file, group//'/pole', data_of(pole), '1, length, length, force', 'forces whose line passes through a '// &
            & 'fixed point: node (row of /mesh/coordinates, from 0), that point, the force towards it')
      end associate
   end subroutine write_step_loads

   !> Writes the group /sets: the nodes of each set.
   subroutine write_sets(file, model)
      type(result_file_t), intent(inout) :: file
      type(model_t), intent(in) :: model
      integer :: i
      call put_group(file, '/sets')
      do i = 1, size(model%node_set)
         if (size(model%node_set(i)%node) == 0) cycle
         call put_data(file, '/sets/'//link_name(model%node_set(i)%name), data_of(model%node_set(i)%node - 1), '1', &
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

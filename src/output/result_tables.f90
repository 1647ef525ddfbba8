!> Parts of the result file that are written once: at its start, at the start of a branch, after a buckling step, and at its end.
module result_tables
   use kinds, only: wp, i8, degree
   use text, only: to_text
   use timing, only: timing_seconds, timing_calls, counted, n_phases, phase_name, n_counters, counter_name
   use model, only: model_t
   use obstacle_types, only: obstacle_line, obstacle_circle, obstacle_arc, obstacle_polyline, ground_half_space, &
      & ground_pasternak
   use obstacle_curve, only: curve_samples
   use obstacle_geometry, only: obstacle_gap
   use element_families, only: follows_curves
   use rod_geometry, only: geometry_t
   use cross_section, only: section_t
   use rod_samples, only: middle_section
   use candidates, only: candidates_t, new_candidates
   use model_words, only: side_name, kind_name, points_name
   use path_record, only: branch_start_t, buckling_t, accuracy_t, check_t, checks_of
   use error_text, only: stored_bar, stored_correction, bar_description, corrected_description
   use file_items, only: data_of
   use result_file, only: result_file_t, put_group, put_data, put_attribute, text_with_room
   implicit none
   private
   public :: write_root, write_mesh, write_obstacles, write_candidates, write_branch, branch_group
   public :: write_buckling, write_performance, write_accuracy, link_name

contains

   !> Writes the root attributes; the status is "running".
   subroutine write_root(file, model, deck, version)
      type(result_file_t), intent(inout) :: file
      type(model_t), intent(in) :: model
      character(*), intent(in) :: deck            !! full text of the deck
      character(*), intent(in) :: version         !! of the program
      call put_attribute(file, '', 'status', data_of(text_with_room('running')))
      call put_attribute(file, '', 'title', data_of(model%title))
      call put_attribute(file, '', 'program', data_of('unilat'))
      call put_attribute(file, '', 'version', data_of(version))
      call put_attribute(file, '', 'created', data_of(iso_time()))
      call put_attribute(file, '', 'deck', data_of(deck))
      if (model%length_unit /= '') then
         call put_attribute(file, '', 'length_unit', data_of(model%length_unit))
         call put_attribute(file, '', 'force_unit', data_of(model%force_unit))
      end if
   end subroutine write_root

   !> Writes nodes and elements.
   subroutine write_mesh(file, model, home)
      type(result_file_t), intent(inout) :: file
      type(model_t), intent(in) :: model
      type(geometry_t), intent(in) :: home     !! geometry of the model
      type(section_t) :: section(model%mesh%n_elements)
      integer :: i
      call put_group(file, '/mesh')
      call put_data(file, '/mesh/coordinates', data_of(model%mesh%x), 'length', 'stress-free position (x, y) of every node')
      call put_data(file, '/mesh/elements', data_of(model%mesh%node - 1), '1', &
         & 'rows of coordinates (from 0) of the first and second node of every element')
      call put_data(file, '/mesh/node_label', data_of(model%mesh%node_label), '1', 'node numbers of the deck')
      call put_data(file, '/mesh/element_label', data_of(model%mesh%element_label), '1', 'element numbers of the deck')
      do i = 1, model%mesh%n_elements
         section(i) = middle_section(model, home, i)
      end do
      call put_data(file, '/mesh/bending_stiffness', data_of(section%ei), 'force length^2', 'EI of every element, at its middle')
      ! Coordinates of few elements do not tell an arc from a polygon.
      if (any(follows_curves(model%mesh%family))) call put_data(file, '/mesh/direction', &
         & data_of(reshape([(home%element(i)%end_angle, i=1, size(section))], [2, size(section)])), 'radian', &
         & 'direction of the stress-free axis at both ends of every element, from the x axis to the left')
      call write_joints(file, model)
   end subroutine write_mesh

   !> Writes /joints: released ends and rigid links. The jump at a release is the difference of the displacements of its two nodes.
   subroutine write_joints(file, model)
      type(result_file_t), intent(inout) :: file
      type(model_t), intent(in) :: model
      integer, allocatable :: link(:, :)
      integer :: i
      allocate (link(2, 0))
      do i = 1, size(model%tie)
         associate (tie => model%tie(i))
            if (tie%turner > 0 .and. tie%component == 1) link = reshape([link, tie%turner, tie%node], [2, size(link, 2) + 1])
         end associate
      end do
      if (size(model%release) == 0 .and. size(link, 2) == 0) return
      call put_group(file, '/joints')
      if (size(model%release) > 0) then
         call put_data(file, '/joints/release', data_of(reshape([([model%release(i)%node, model%release(i)%own], i=1, &
            & size(model%release))], [2, size(model%release)]) - 1), '1', &
            & 'node of each joint, and that at its place which the released ends have (rows of /mesh/coordinates, from 0)')
         call put_data(file, '/joints/released', data_of(reshape([(merge(1, 0, model%release(i)%free), i=1, size(model%release))], &
            & [3, size(model%release)])), '1', '1 where u, v, rotation are released, 0 where they are the same')
      end if
      if (size(link, 2) > 0) call put_data(file, '/joints/link', data_of(link - 1), '1', &
         & 'rigid bars: the node that turns them and the node they carry (rows of /mesh/coordinates, from 0)')
   end subroutine write_joints

   !> Writes a group for every obstacle: attributes, and for curves their points and the surface for drawing.
   subroutine write_obstacles(file, model)
      type(result_file_t), intent(inout) :: file
      type(model_t), intent(in) :: model
      character(:), allocatable :: group
      integer :: i
      call put_group(file, '/obstacles')
      associate (obstacle => model%obstacle)
         do i = 1, size(model%obstacle)
            group = '/obstacles/'//link_name(obstacle(i)%name)
            call put_group(file, group)
            call put_attribute(file, group, 'side', data_of(side_name(obstacle(i))))
            call put_attribute(file, group, 'type', data_of(kind_name(obstacle(i))))
            call put_attribute(file, group, 'number', data_of(i))
            if (obstacle(i)%at_nodes) call write_stops(file, model, i, group)
            select case (obstacle(i)%kind)
            case (obstacle_line)
               if (.not. obstacle(i)%at_nodes) call put_attribute(file, group, 'points', data_of(obstacle(i)%point))
            case (obstacle_circle, obstacle_arc)
               call put_attribute(file, group, 'centre', data_of(obstacle(i)%centre))
               call put_attribute(file, group, 'radius', data_of(obstacle(i)%radius))
            case default
               if (obstacle(i)%kind == obstacle_polyline) call put_attribute(file, group, 'radius', data_of(obstacle(i)%radius))
               call put_data(file, group//'/points', data_of(obstacle(i)%point), 'length', 'points of the deck')
            end select
            if (obstacle(i)%kind == obstacle_arc) call put_attribute(file, group, 'angles', data_of(obstacle(i)%angle / degree))
            if (.not. any(obstacle(i)%kind == [obstacle_line, obstacle_circle])) call put_data(file, group//'/surface', &
               & data_of(curve_samples(obstacle(i)%curve)), 'length', &
               & 'points along the surface, which goes on straight beyond its ends unless they meet')
            call put_attribute(file, group, 'reference_angle', data_of(obstacle(i)%reference_angle / degree))
            if (obstacle(i)%carrier > 0) then
               call put_attribute(file, group, 'node', data_of(model%mesh%node_label(obstacle(i)%carrier)))
               call put_attribute(file, group, 'pivot', data_of(model%mesh%x(:, obstacle(i)%carrier)))
            end if
            if (obstacle(i)%rigid) then
               call put_attribute(file, group, 'foundation', data_of('rigid'))
            else if (obstacle(i)%law > 0) then
               call put_attribute(file, group, 'foundation', data_of('law'))
               associate (curve => model%law(obstacle(i)%law))
                  call put_data(file, group//'/law', data_of(transpose(reshape([curve%penetration, obstacle(i)%width * &
                     & curve%force], [size(curve%force), 2]))), 'length, force/length', 'penetration and force per length of rod')
               end associate
            else if (obstacle(i)%ground == ground_half_space) then
               call put_attribute(file, group, 'foundation', data_of('half-space'))
               call put_attribute(file, group, 'young', data_of(obstacle(i)%young))
               call put_attribute(file, group, 'poisson', data_of(obstacle(i)%poisson))
               call put_attribute(file, group, 'width', data_of(obstacle(i)%width))
            else if (obstacle(i)%ground == ground_pasternak) then
               call put_attribute(file, group, 'foundation', data_of('pasternak'))
               call put_attribute(file, group, 'shear', data_of(obstacle(i)%shear))
            else
               call put_attribute(file, group, 'foundation', data_of('winkler'))
            end if
            call put_attribute(file, group, 'modulus', data_of(obstacle(i)%modulus))
            call put_attribute(file, group, 'bilateral', data_of(merge(1, 0, obstacle(i)%bilateral)))
         end do
      end associate
   end subroutine write_obstacles

   !> Writes the stops of a *GAP: their positions, and the direction in which they push.
   subroutine write_stops(file, model, number, group)
      type(result_file_t), intent(inout) :: file
      type(model_t), intent(in) :: model
      integer, intent(in) :: number               !! number of the obstacle
      character(*), intent(in) :: group           !! group of the obstacle
      real(wp), allocatable :: place(:, :)
      real(wp) :: gap, normal(2), bend
      integer :: c, i
      call obstacle_gap(model%obstacle(number), [0.0_wp, 0.0_wp], gap, normal, bend)
      allocate (place(2, 0))
      do c = 1, size(model%contact)
         if (model%contact(c)%obstacle /= number) cycle
         do i = 1, size(model%contact(c)%node)
            if (any(model%relative(1, :) == model%contact(c)%node(i))) cycle
            associate (home => model%mesh%x(:, model%contact(c)%node(i)))
               place = reshape([place, home - model%contact(c)%gap * normal], [2, size(place, 2) + 1])
            end associate
         end do
      end do
      call put_attribute(file, group, 'normal', data_of(normal))
      call put_data(file, group//'/points', data_of(place), 'length', 'where the nodes meet their stops on the ground')
   end subroutine write_stops

   !> Writes the candidates for contact and their obstacles.
   subroutine write_candidates(file, model, home)
      type(result_file_t), intent(inout) :: file
      type(model_t), intent(in) :: model
      type(geometry_t), intent(in) :: home     !! geometry of the model
      real(wp), allocatable :: along(:), round(:)
      integer :: i, k
      call put_group(file, '/contact')
      call measure_contacts(model, home, along, round)
      associate (contact => model%contact)
         call put_data(file, '/contact/candidates', &
            & data_of([(model%mesh%node_label(contact(i)%node), i=1, size(contact))]), '1', &
            & 'node numbers (of the deck) of the candidates, contact after contact')
         call put_data(file, '/contact/candidate_contact', &
            & data_of([((i, k=1, size(contact(i)%node)), i=1, size(contact))]), '1', 'contact of each candidate, from 1')
         call put_data(file, '/contact/obstacle', data_of(model%obstacle(contact%obstacle)%name), '1', &
            & 'name of the obstacle of each contact')
         call put_data(file, '/contact/points', data_of(points_name(contact)), '1', 'where the reactions of each contact act: at ' &
            & //'nodes, anywhere along the rod (spans), all along the elements (distributed)')
      end associate
      call put_data(file, '/contact/arc_length', data_of(along), 'length', 'stress-free arc length along the contact of each ' &
         & //'candidate')
      call put_data(file, '/contact/chain_length', data_of(round), 'length', 'once round, of contacts whose candidates are a ' &
         & //'closed chain; 0: open')
   end subroutine write_candidates

   !> Arc lengths of the candidates along their contacts, in the order of the file.
   subroutine measure_contacts(model, home, along, round)
      type(model_t), intent(in) :: model
      type(geometry_t), intent(in) :: home     !! geometry of the model
      real(wp), allocatable, intent(out) :: along(:) !! (candidates) stress-free arc length from the start of the contact
      real(wp), allocatable, intent(out) :: round(:) !! (contacts) length of a closed chain, 0: open
      type(candidates_t) :: list
      logical, parameter :: distributed(2) = [.false., .true.]
      integer :: i
      allocate (along(sum([(size(model%contact(i)%node), i=1, size(model%contact))])))
      allocate (round(size(model%contact)), source=0.0_wp)
      do i = 1, 2
         list = new_candidates(model, home, distributed(i))
         along(list%row) = list%s
         round = round + list%chain_length
      end do
   end subroutine measure_contacts

   !> Stores the group of a branch with its attributes; the group /branch must exist.
   subroutine write_branch(file, start)
      type(result_file_t), intent(inout) :: file
      type(branch_start_t), intent(in) :: start
      character(:), allocatable :: group
      group = branch_group(start)
      call put_group(file, group)
      call put_attribute(file, group, 'name', data_of(start%name))
      call put_attribute(file, group, 'step', data_of(start%step))
      call put_attribute(file, group, 'of', data_of(start%of))
      call put_attribute(file, group, 'bifurcation', data_of(start%bifurcation))
      call put_attribute(file, group, 'mode', data_of(start%mode))
      call put_attribute(file, group, 'side', data_of(start%side))
      call put_attribute(file, group, 'point', data_of(start%point))
   end subroutine write_branch

   !> Full path of the group of a branch.
   pure function branch_group(start) result(group)
      type(branch_start_t), intent(in) :: start
      character(:), allocatable :: group
      group = '/branch/'//to_text(start%branch)
   end function branch_group

   !> Writes the modes of a buckling step; the group /buckling must exist.
   subroutine write_buckling(file, model, buckling)
      type(result_file_t), intent(inout) :: file
      type(model_t), intent(in) :: model
      type(buckling_t), intent(in) :: buckling
      character(:), allocatable :: group
      group = '/buckling/'//link_name(model%step(buckling%step)%name)
      call put_group(file, group)
      call put_attribute(file, group, 'step', data_of(buckling%step))
      call put_data(file, group//'/load_factor', data_of(buckling%load_factor), '1', &
         & 'factors of the loads of the step at which it buckles, the smallest in size first')
      if (allocated(buckling%bar)) then
         call put_data(file, group//'/error', data_of(stored_bar(buckling%bar)), '1', bar_description)
         call put_data(file, group//'/corrected', data_of(stored_correction(buckling%load_factor, buckling%bar)), '1', &
            & corrected_description)
      end if
      call put_data(file, group//'/residual', data_of(buckling%residual), '1', 'relative residual of the eigenvalue problem')
      call put_data(file, group//'/mode', data_of(buckling%mode), '1, 1, radian / length', &
         & 'u, v and rotation of every node in each mode, the largest translation is 1')
   end subroutine write_buckling

   !> Writes seconds and calls of the phases, and the counters.
   subroutine write_performance(file)
      type(result_file_t), intent(inout) :: file
      integer :: i
      call put_group(file, '/performance')
      call put_data(file, '/performance/phase', data_of(phase_name), '1', 'phases of the run')
      call put_data(file, '/performance/seconds', data_of([(timing_seconds(i), i=1, n_phases)]), 'second', &
         & 'time spent in each phase, without the phases called from it')
      call put_data(file, '/performance/calls', data_of([(default_integer(timing_calls(i)), i=1, n_phases)]), '1', &
         & 'how often each phase was started')
      call put_data(file, '/performance/counter', data_of(counter_name), '1', 'what was counted')
      call put_data(file, '/performance/value', data_of([(default_integer(counted(i)), i=1, n_counters)]), '1', 'the counts')
   end subroutine write_performance

   !> Writes the worst values of all checks and their places, a row each.
   subroutine write_accuracy(file, accuracy)
      type(result_file_t), intent(inout) :: file
      type(accuracy_t), intent(in) :: accuracy
      type(check_t), allocatable :: check(:)
      check = checks_of(accuracy)
      call put_group(file, '/accuracy')
      call put_data(file, '/accuracy/check', data_of(check%name), '1', 'what was checked')
      call put_data(file, '/accuracy/description', data_of(check%description), '1', 'what its value is')
      call put_data(file, '/accuracy/value', data_of(check%worst%value), '1', 'worst value of all points')
      call put_data(file, '/accuracy/load_factor', data_of(check%worst%at%load_factor), '1', 'load factor where it is worst')
      associate (at => check%worst%at)
         call put_data(file, '/accuracy/place', data_of(transpose(reshape([at%branch, at%step, at%point, at%node, at%element], &
            & [size(check), 5]))), '1', 'where it is worst: branch, step, point; label of a node or an element, 0: none')
      end associate
   end subroutine write_accuracy

   !> A count as an integer of the file; a larger value is replaced by the largest integer.
   pure integer function default_integer(count)
      integer(i8), intent(in) :: count
      default_integer = int(min(count, int(huge(1), i8)))
   end function default_integer

   !> A name of the deck as a name in the file, where '/' separates groups and a single dot is the group itself.
   pure function link_name(name) result(link)
      character(*), intent(in) :: name
      character(:), allocatable :: link
      integer :: i
      link = trim(name)
      do i = 1, len(link)
         if (link(i:i) == '/') link(i:i) = '_'
      end do
      if (link == '.') link = '_'
   end function link_name

   !> The time now, ISO 8601 with the offset from UTC: 2024-02-29T13:05:09+01:00.
   function iso_time() result(time)
      character(25) :: time
      character(8) :: day
      character(10) :: clock
      character(5) :: zone
      call date_and_time(day, clock, zone)
      time = day(1:4)//'-'//day(5:6)//'-'//day(7:8)//'T'//clock(1:2)//':'//clock(3:4)//':'//clock(5:6)//zone(1:3)//':'//zone(4:5)
   end function iso_time
end module result_tables

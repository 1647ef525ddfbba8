!> Steps, loads and supports in words for the first part of the listing, so that a load at a wrong node is noticed at once.
module step_words
   use kinds, only: wp
   use model, only: model_t, step_t, threshold_t, branch_t, limit_curve_t, method_load, method_displacement, method_words, &
      & parameter_words, load_t, supports
   use model_words, only: parameter_object
   use columns, only: brief, pair
   use text, only: plural, to_text, word_at
   implicit none
   private
   public :: step_lines, load_lines, support_lines, node_lines

   integer, parameter :: most_labels = 6        !! largest number of node labels listed one by one
   integer, parameter :: most_lines = 12        !! largest number of lines of one kind
   character(*), parameter :: nl = new_line('a')

contains

   !> A step: its kind, then one line for each further action along the path and behind its end. Each line ends with a line end.
   pure function step_lines(model, step) result(lines)
      type(model_t), intent(in) :: model
      type(step_t), intent(in) :: step
      character(:), allocatable :: lines
      integer :: i
      lines = ''
      if (step%name /= '') lines = trim(step%name)//': '
      if (step%n_modes > 0) then
         lines = lines//'linear buckling, '//plural(step%n_modes, 'mode')//nl
         return
      end if
      lines = lines//control_text(model, step)//nl
      do i = 1, size(step%mode_offset)
         associate (offset => step%mode_offset(i))
            lines = lines//'begins stress-free, '//plural(size(offset%element), 'element')//' offset by mode '// &
               & to_text(offset%mode)//' of '//trim(model%step(offset%step)%name)//', largest offset '//brief(offset%amplitude)//nl
         end associate
      end do
      do i = 1, size(step%load%motion, 2)
         associate (name => model%obstacle(i)%name, load => step%load)
            if (any(abs(load%motion(:, i)) > 0.0_wp)) lines = lines//'moves '//trim(name)//' by '//pair(load%motion(:, i))// &
               & ' at load factor 1'//nl
            if (abs(load%closing(i)) > 0.0_wp) lines = lines//'closes the gaps to '//trim(name)//' by '// &
               & brief(load%closing(i))//' at load factor 1'//nl
            if (load%resolved(i) > 0.0_wp) lines = lines//'pushes out what begins behind '//trim(name)//nl
         end associate
      end do
      lines = lines//end_text(model, step)//nl
      do i = 1, size(step%branch)
         lines = lines//branch_text(model, step, step%branch(i))//nl
      end do
      do i = 1, size(step%limit_curve)
         lines = lines//limit_curve_text(model, step%limit_curve(i))//nl
      end do
   end function step_lines

   !> Strategy, increments and iteration of a step, in words.
   pure function control_text(model, step) result(text)
      type(model_t), intent(in) :: model
      type(step_t), intent(in) :: step
      character(:), allocatable :: text
      text = word_at(method_words, step%method)
      if (step%method == method_displacement) text = text//' of '//trim(model%monitor(step%monitor)%name)
      text = text//', first increment '//brief(step%increment)
      if (step%method == method_load .or. step%method == method_displacement) then
         text = text//', others '
      else
         text = text//', arc length '
      end if
      text = text//brief(step%smallest)//' to '//brief(step%largest)
      if (step%tangent_updates == 0) text = text//', modified Newton'
      if (step%tangent_updates == 1) text = text//', Newton with the tangent updated once'
      if (step%paper_loop) text = text//', loop of the paper'
      text = text//', tolerance '//brief(step%tolerance)
   end function control_text

   !> Description of what ends a step, and of the points that it locates.
   pure function end_text(model, step) result(text)
      type(model_t), intent(in) :: model
      type(step_t), intent(in) :: step
      character(:), allocatable :: text
      integer :: i
      text = 'at most '//plural(step%max_points, 'point')//stop_text(model, step%stop)
      do i = 1, size(step%locate)
         text = text//', locate '//threshold_text(model, step%locate(i))//' = '//brief(step%locate(i)%value)
      end do
      do i = 1, size(step%turning)
         text = text//', locate turning points of '//trim(model%monitor(step%turning(i))%name)
      end do
   end function end_text

   pure function stop_text(model, stop) result(text)
      type(model_t), intent(in) :: model
      type(threshold_t), intent(in) :: stop(:)
      character(:), allocatable :: text
      integer :: i
      text = ''
      do i = 1, size(stop)
         text = text//', stop when '//threshold_text(model, stop(i))
         if (stop(i)%rising) then
            text = text//' rises above '//brief(stop(i)%value)
         else
            text = text//' falls below '//brief(stop(i)%value)
         end if
      end do
   end function stop_text

   pure function branch_text(model, step, branch) result(text)
      type(model_t), intent(in) :: model
      type(step_t), intent(in) :: step
      type(branch_t), intent(in) :: branch
      character(:), allocatable :: text
      text = 'branch '//trim(branch%name)//': from bifurcation '//to_text(branch%bifurcation)
      if (branch%of > 0) text = text//' of '//trim(step%branch(branch%of)%name)
      if (branch%side > 0) text = text//' along'
      if (branch%side < 0) text = text//' against'
      text = text//' null vector '//to_text(branch%mode)
      if (branch%increment > 0.0_wp) text = text//', first arc length '//brief(branch%increment)
      text = text//', at most '//plural(branch%max_points, 'point')//stop_text(model, branch%stop)
   end function branch_text

   pure function limit_curve_text(model, curve) result(text)
      type(model_t), intent(in) :: model
      type(limit_curve_t), intent(in) :: curve
      character(:), allocatable :: text
      text = 'limit curve '//trim(curve%name)//': limit point '//to_text(curve%limit_point)//' while '
      if (parameter_object(curve, model) == '') then
         text = text//'the '//word_at(parameter_words, curve%parameter)
      else
         text = text//word_at(parameter_words, curve%parameter)//' of '//parameter_object(curve, model)
      end if
      text = text//' goes to '//brief(curve%last)//', first increment '//brief(curve%increment)//', largest '//brief(curve%largest)
      if (curve%logarithmic) text = text//' decades'
      if (curve%to_rigid) text = text//', then rigid'
      text = text//', at most '//plural(curve%max_points, 'point')
   end function limit_curve_text

   pure function threshold_text(model, threshold) result(text)
      type(model_t), intent(in) :: model
      type(threshold_t), intent(in) :: threshold
      character(:), allocatable :: text
      text = 'the load factor'
      if (threshold%monitor > 0) text = trim(model%monitor(threshold%monitor)%name)
   end function threshold_text

   !> All loads of a step at load factor 1, one line for all equal loads, and their sum. Each line ends with a line end.
   function load_lines(model, load, total) result(lines)
      type(model_t), intent(in) :: model
      type(load_t), intent(in) :: load
      real(wp), intent(in) :: total(3)          !! sum of all loads: force in x, force in y, moment about the origin
      character(:), allocatable :: lines
      real(wp) :: force(3), stiffness(3, 3)
      integer :: i
      logical :: sound
      lines = node_lines(model, load%node_force, any(abs(load%node_force) > 0.0_wp, 1), 'load', 'moment')
      do i = 1, size(load%pole_load)
         associate (pull => load%pole_load(i))
            call pull%push([model%mesh%x(:, pull%node), 0.0_wp], force, stiffness, sound)
            lines = lines//'load on '//nodes_text(model, [pull%node])//': '//vector_text(pull%magnitude * force, 'moment')// &
               & ' at the start, turning as the node moves'//nl
         end associate
      end do
      lines = lines//element_lines(load)//varying_lines(model, load)//node_lines(model, load%displacement, &
         & any(abs(load%displacement) > 0.0_wp, 1), 'prescribed displacement', 'rotation')
      if (lines /= '') lines = lines//'sum of all loads at load factor 1: force '//pair(total(1:2))// &
         & ', moment about the origin '//brief(total(3))//nl
   end function load_lines

   !> The supports, one line for all nodes with the same fixed components.
   function support_lines(model) result(lines)
      type(model_t), intent(in) :: model
      character(:), allocatable :: lines
      character(*), parameter :: name(3) = [character(8) :: 'u', 'v', 'rotation']
      character(:), allocatable :: held
      logical :: fixed(3, model%mesh%n_nodes)
      integer :: first(model%mesh%n_nodes), node, i
      lines = ''
      fixed = supports(model)
      first = first_alike(merge(1.0_wp, 0.0_wp, fixed), any(fixed, 1))
      do node = 1, size(first)
         if (first(node) /= node) cycle
         held = ''
         do i = 1, 3
            if (fixed(i, node)) held = held//', '//trim(name(i))
         end do
         lines = lines//nodes_text(model, pack([(i, i=1, size(first))], first == node))//': '//held(3:)//nl
      end do
   end function support_lines

   !> For each column of an array the first column with the same values; 0: the column does not count.
   pure function first_alike(value, counts) result(first)
      real(wp), intent(in) :: value(:, :)
      logical, intent(in) :: counts(:)          !! (columns) true: the column counts
      integer :: first(size(counts)), i, k
      first = 0
      do i = 1, size(counts)
         if (counts(i) .and. first(i) == 0) where (counts .and. first == 0 .and. [(all(abs(value(:, k) - value(:, i)) <= 0.0_wp), &
            & k=1, size(counts))]) first = i
      end do
   end function first_alike

   !> Values at nodes in words, one line for all nodes with equal values.
   function node_lines(model, value, has, what, turn) result(lines)
      type(model_t), intent(in) :: model
      real(wp), intent(in) :: value(:, :)       !! (3, nodes) values
      logical, intent(in) :: has(:)             !! (nodes) true: the node has a value
      character(*), intent(in) :: what          !! name of the value
      character(*), intent(in) :: turn          !! name of the third component
      character(:), allocatable :: lines
      integer :: first(size(has)), node, i, n
      lines = ''
      n = 0
      first = first_alike(value, has)
      do node = 1, size(first)
         if (first(node) /= node) cycle
         n = n + 1
         if (n > most_lines) then
            lines = lines//'and '//what//' on '//plural(count(first >= node), 'node')//' more'//nl
            return
         end if
         lines = lines//what//' on '//nodes_text(model, pack([(i, i=1, size(first))], first == node))//': '// &
            & repeat('each ', merge(1, 0, count(first == node) > 1))//vector_text(value(:, node), turn)//nl
      end do
   end function node_lines

   !> Loads along elements in words, one line for all elements with equal loads.
   function element_lines(load) result(lines)
      type(load_t), intent(in) :: load
      character(:), allocatable :: lines
      real(wp) :: value(5, size(load%pressure)) ! force in x and y by length, pressure, strain, curvature
      character(:), allocatable :: text
      integer :: first(size(load%pressure)), e, n
      lines = ''
      n = 0
      value(1:2, :) = load%line_force
      value(3, :) = merge(0.0_wp, load%pressure, any(abs(load%gradient) > 0.0_wp, 1))
      value(4, :) = load%strain
      value(5, :) = load%curvature
      first = first_alike(value, any(abs(value) > 0.0_wp, 1))
      do e = 1, size(first)
         if (first(e) /= e) cycle
         n = n + 1
         if (n > most_lines) then
            lines = lines//'and load on '//plural(count(first >= e), 'element')//' more'//nl
            return
         end if
         text = ''
         if (any(abs(value(1:2, e)) > 0.0_wp)) text = ', force '//pair(value(1:2, e))//' per length'
         if (abs(value(3, e)) > 0.0_wp) text = text//', pressure '//brief(value(3, e))//' to the left'
         if (abs(value(4, e)) > 0.0_wp) text = text//', strain '//brief(value(4, e))//' of heat'
         if (abs(value(5, e)) > 0.0_wp) text = text//', curvature '//brief(value(5, e))//' of heat'
         lines = lines//'load on '//plural(count(first == e), 'element')//': '//text(3:)//nl
      end do
   end function element_lines

   !> Dead loads that vary along the rods, and pressures of liquids, in words: one line for each.
   function varying_lines(model, load) result(lines)
      type(model_t), intent(in) :: model
      type(load_t), intent(in) :: load
      character(:), allocatable :: lines, text
      logical, allocatable :: wet(:)
      integer :: i
      lines = ''
      do i = 1, size(load%line_load)
         associate (part => load%line_load(i))
            text = merge('along and to the left of the axis', 'in x and y                       ', part%along_axis)
            text = 'load on '//plural(count(part%on), 'element')//', '//trim(text)//': '//pair(part%direction)
            if (part%intensity%distribution > 0) then
               text = text//' times '//trim(model%distribution(part%intensity%distribution)%name)
            else
               text = text//' times '//brief(part%intensity%value)
            end if
            if (part%weight) text = text//' times the mass'
            lines = lines//text//' per length'//nl
         end associate
      end do
      wet = any(abs(load%gradient) > 0.0_wp, 1)
      if (any(wet)) lines = lines//'liquid on '//plural(count(wet), 'element')//': pressure to the left, at y = 0 from '// &
         & brief(minval(load%pressure, wet))//' to '//brief(maxval(load%pressure, wet))//', rising with depth by '// &
         & brief(minval(-load%gradient(2, :), wet))//' to '//brief(maxval(-load%gradient(2, :), wet))//nl
   end function varying_lines

   !> Nodes in words: "node 3 at (150, 0)", "nodes 1, 5, 9", "nodes 1, 2, 3, 4, 5, 6 and 20 more".
   function nodes_text(model, node) result(text)
      type(model_t), intent(in) :: model
      integer, intent(in) :: node(:)            !! labels of nodes, at least one
      character(:), allocatable :: text
      integer :: i
      associate (label => model%mesh%node_label(node), x => model%mesh%x(:, node(1)))
         text = to_text(label(1))
         if (size(node) == 1) then
            text = 'node '//text//' at '//pair(x)
            return
         end if
         do i = 2, min(size(node), most_labels)
            text = text//', '//to_text(label(i))
         end do
         text = 'nodes '//text
         if (size(node) > most_labels) text = text//' and '//to_text(size(node) - most_labels)//' more'
      end associate
   end function nodes_text

   !> The components that are not zero, in words: two along the axes, and a rotation or moment.
   pure function vector_text(value, turn) result(text)
      real(wp), intent(in) :: value(3)
      character(*), intent(in) :: turn          !! name of the third component
      character(:), allocatable :: text
      text = ''
      if (any(abs(value(1:2)) > 0.0_wp)) text = pair(value(1:2))
      if (abs(value(3)) > 0.0_wp .and. text /= '') text = text//', '
      if (abs(value(3)) > 0.0_wp) text = text//turn//' '//brief(value(3))
   end function vector_text
end module step_words

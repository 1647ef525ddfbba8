!> Steps in words, for the listing.
module step_words
   use kinds, only: wp
   use model, only: model_t, step_t, threshold_t, branch_t, limit_curve_t, method_load, method_displacement, method_words, &
      & parameter_words
   use model_words, only: parameter_object
   use columns, only: brief, pair
   use text, only: plural, to_text, word_at
   implicit none
   private
   public :: step_lines

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
      text = text//' goes to '//brief(curve%last)//', first increment '//brief(curve%increment)//', largest '// &
         & brief(curve%largest)
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
end module step_words

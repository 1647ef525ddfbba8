!> Summary of the deck as the program has interpreted it: the first part of the listing.
module deck_summary
   use kinds, only: wp, degree
   use cross_section, only: varies
   use model, only: model_t, supports, step_t, threshold_t, branch_t, limit_curve_t, contact_t, method_load, method_displacement, &
      & method_words, parameter_words
   use obstacle_types, only: obstacle_t, obstacle_line, obstacle_circle, obstacle_arc, obstacle_polyline, ground_half_space, &
      & ground_pasternak
   use element_families, only: family_name
   use model_words, only: monitor_description, side_name, kind_name, parameter_object
   use load_words, only: words_t, load_lines, support_lines, node_lines
   use columns, only: brief, left
   use text, only: plural, to_text, word_at
   use printable_text, only: printable
   implicit none
   private
   public :: write_deck_summary

   integer, parameter :: margin = 14              !! width of the left column, which contains words

contains

   !> Writes heading and summary: mesh, supports, sections, obstacles, contacts, monitors, steps with their loads.
   subroutine write_deck_summary(unit, model, version, deck, results, load_sum)
      integer, intent(in) :: unit                 !! unit number, open for formatted writing
      type(model_t), intent(in) :: model
      character(*), intent(in) :: version         !! version of the program
      character(*), intent(in) :: deck            !! name of the deck, or <stdin>
      character(*), intent(in) :: results         !! name of the result file; blank: there is none
      real(wp), intent(in) :: load_sum(:, :)      !! (3, steps) sum of all loads: force in x, force in y, moment about the origin
      character(:), allocatable :: text
      integer :: i
      call line('', 'unilat '//trim(version))
      call write_title(model%title)
      call line('', '')
      call line('deck', deck)
      if (results /= '') call line('results', results)
      if (model%length_unit /= '') call line('units', model%length_unit//', '//model%force_unit)
      call line('', '')
      call write_mesh()
      call line('supports', freedoms_text(supports(model)))
      call write_lines(support_lines(model))
      if (any(model%spring > 0.0_wp)) then
         call line('springs', freedoms_text(model%spring > 0.0_wp))
         call write_lines(node_lines(model, model%spring, any(model%spring > 0.0_wp, 1), 'spring', 'rotation'))
      end if
      call write_sections()
      do i = 1, size(model%obstacle)
         text = obstacle_text(model%obstacle(i))
         if (.not. is_touched(i)) text = text//'; no *CONTACT names it, rods go through it'
         call line('obstacle', text)
      end do
      do i = 1, size(model%contact)
         call line('contact '//to_text(i), contact_text(model%contact(i)))
      end do
      do i = 1, size(model%monitor)
         call line('monitor', trim(model%monitor(i)%name)//': ' //monitor_description(model%monitor(i), model))
      end do
      do i = 1, size(model%step)
         call write_step(model%step(i), i)
         call write_lines(load_lines(model, model%step(i)%load, load_sum(:, i)))
      end do
      flush (unit)

   contains

      !> Writes one line with a word in the left column.
      subroutine line(word, text)
         character(*), intent(in) :: word, text
         if (word == '') then
            write (unit, '(a)') printable(trim(text))
         else
            write (unit, '(a)') printable(trim(left(word, margin)//text))
         end if
      end subroutine line

      !> Writes one line with an empty left column.
      subroutine more(text)
         character(*), intent(in) :: text
         call line('', repeat(' ', margin)//text)
      end subroutine more

      !> Writes the heading of the deck, line by line.
      subroutine write_title(title)
         character(*), intent(in) :: title
         integer :: first, length
         first = 1
         do while (first <= len(title))
            length = index(title(first:), new_line('a')) - 1
            if (length < 0) length = len(title) - first + 1
            call line('', title(first:first + length - 1))
            first = first + length + 1
         end do
      end subroutine write_title

      !> Writes the nodes with their extent in space, and the elements by family.
      subroutine write_mesh()
         logical :: counted(model%mesh%n_elements), same(model%mesh%n_elements)
         character(:), allocatable :: families
         integer :: i
         associate (mesh => model%mesh)
            call line('nodes', to_text(mesh%n_nodes)//', x from '//brief(minval(mesh%x(1, :)))//' to ' //brief(maxval(mesh%x(1, &
               :)))//', y from '//brief(minval(mesh%x(2, :)))//' to ' //brief(maxval(mesh%x(2, :))))
            families = ''
            counted = .false.
            do i = 1, mesh%n_elements
               if (counted(i)) cycle
               same = mesh%family == mesh%family(i) .and. mesh%stages == mesh%stages(i)
               counted = counted .or. same
               families = families//', '//to_text(count(same))//' '//family_name(mesh%family(i), mesh%stages(i))
            end do
            call line('elements', families(3:))
         end associate
      end subroutine write_mesh


      !> Writes lines with an empty left column.
      subroutine write_lines(lines)
         type(words_t), intent(in) :: lines(:)
         integer :: i
         do i = 1, size(lines)
            call more(lines(i)%text)
         end do
      end subroutine write_lines

      subroutine write_sections()
         character(:), allocatable :: axial, shear, heat
         integer :: i
         do i = 1, size(model%section)
            associate (section => model%section(i))
               axial = brief(section%ea)
               if (section%inextensible) axial = 'rigid'
               shear = brief(section%ga)
               if (section%shear_rigid) shear = 'rigid'
               heat = ''
               if (abs(section%expansion) > 0.0_wp) heat = ', expansion '//brief(section%expansion)
               call line('section', trim(section%name)//': '//plural(count(model%mesh%section == i), 'element') //', EA '//axial// &
                  ', EI '//brief(section%ei)//', GA '//shear//', mass per length ' //brief(section%mass)//heat// &
                  repeat(' (varies, these are of its mean dimensions)', merge(1, 0, varies(section))))
            end associate
         end do
      end subroutine write_sections

      !> Description of stops or springs at nodes.
      pure function acts(obstacle) result(text)
         type(obstacle_t), intent(in) :: obstacle
         character(:), allocatable :: text
         if (obstacle%kind == obstacle_circle) then
            text = 'presses'
            if (obstacle%inside) text = 'pulls'
            if (obstacle%bilateral) text = 'pulls and presses'
            text = ': member of length '//brief(obstacle%radius)//' that '//text
         else
            text = ': stops at nodes, they push towards ('
            if (obstacle%bilateral) text = ': springs at nodes, they act along ('
            associate (d => obstacle%point(:, 2) - obstacle%point(:, 1))
               text = text//brief(-d(2))//', '//brief(d(1))//')'
            end associate
         end if
      end function acts

      pure function obstacle_text(obstacle) result(text)
         type(obstacle_t), intent(in) :: obstacle
         character(:), allocatable :: text
         text = trim(obstacle%name)//': '//kind_name(obstacle)
         if (obstacle%at_nodes) then
            text = trim(obstacle%name)//acts(obstacle)
            if (obstacle%rigid) then
               text = text//', rigid'
            else if (obstacle%law > 0) then
               text = text//', by the law '//trim(model%law(obstacle%law)%name)
            else
               text = text//', stiffness '//brief(obstacle%modulus)
            end if
            return
         end if
         select case (merge(0, obstacle%kind, obstacle%along_rod))
         case (0)
            text = text//' along ('//brief(-obstacle%point(2, 2))//', '//brief(obstacle%point(1, 2))//')'
         case (obstacle_line)
            text = text//' from '//place(obstacle%point(:, 1))//' to '//place(obstacle%point(:, 2))//', structure on its left'
         case (obstacle_circle)
            text = text//' of radius '//brief(obstacle%radius)//' about '//place(obstacle%centre) //', structure '// &
               side_name(obstacle)//', angles from '//brief(obstacle%reference_angle / degree) //' degrees'
         case (obstacle_arc)
            text = text//' of radius '//brief(obstacle%radius)//' about '//place(obstacle%centre)//' from '// &
               & brief(obstacle%angle(1) / degree)//' to '//brief(obstacle%angle(2) / degree)//' degrees, structure on its left' &
               & //', angles from '//brief(obstacle%reference_angle / degree)//' degrees'
         case default
            text = text//' through '//plural(size(obstacle%point, 2), 'point')//' from '//place(obstacle%point(:, 1))//' to '// &
               & place(obstacle%point(:, size(obstacle%point, 2)))
            if (obstacle%kind == obstacle_polyline) text = text//', corners of radius '//brief(obstacle%radius)
            text = text//', structure on its left'
         end select
         if (obstacle%rigid) then
            text = text//', rigid'
         else if (obstacle%law > 0) then
            text = text//', foundation by the law '//trim(model%law(obstacle%law)%name)
         else if (obstacle%ground == ground_half_space) then
            text = text//', elastic half-space with E = '//brief(obstacle%young)//', nu = '//brief(obstacle%poisson)// &
               & ' under a strip of width '//brief(obstacle%width)
         else if (obstacle%ground == ground_pasternak) then
            text = text//', Pasternak foundation of modulus '//brief(obstacle%modulus)//', shear '//brief(obstacle%shear)
         else
            text = text//', Winkler foundation of modulus '//brief(obstacle%modulus)
         end if
         if (obstacle%bilateral) text = text//', bilateral'
         if (obstacle%carrier > 0) text = text//', moves with node '//to_text(model%mesh%node_label(obstacle%carrier))
      end function obstacle_text

      !> True if a contact names an obstacle.
      pure logical function is_touched(obstacle)
         integer, intent(in) :: obstacle
         integer :: k
         is_touched = any(model%contact%obstacle == obstacle)
         do k = 1, size(model%contact)
            if (allocated(model%contact(k)%part)) is_touched = is_touched .or. any(model%contact(k)%part%obstacle == obstacle)
         end do
      end function is_touched

      !> Name of the obstacle of a contact, or names of all pieces of its wall.
      pure function wall_text(contact) result(text)
         type(contact_t), intent(in) :: contact
         character(:), allocatable :: text
         integer :: k
         text = trim(model%obstacle(contact%obstacle)%name)
         if (.not. allocated(contact%part)) return
         do k = 2, size(contact%part)
            text = text//', '//trim(model%obstacle(contact%part(k)%obstacle)%name)
         end do
         text = 'one wall of '//text
      end function wall_text

      pure function contact_text(contact) result(text)
         type(contact_t), intent(in) :: contact
         character(:), allocatable :: text
         text = plural(size(contact%node), 'candidate')//' for '//wall_text(contact)
         if (abs(contact%gap) > 0.0_wp) text = text//', gap '//brief(contact%gap)
         if (contact%along) text = text//', points and lines anywhere along the rod'
         if (contact%distributed) text = text//', all along the elements'
         if (.not. (contact%along .or. contact%distributed)) text = text//', at the nodes'
         if (allocated(contact%needs)) text = text//': along the rod it needs '//contact%needs
      end function contact_text

      !> Writes a step: its kind, then one line for each further action along the path and behind its end.
      subroutine write_step(step, number)
         integer, intent(in) :: number
         type(step_t), intent(in) :: step
         character(:), allocatable :: name
         integer :: i
         name = ''
         if (step%name /= '') name = trim(step%name)//': '
         if (step%n_modes > 0) then
            call line('step '//to_text(number), name//'linear buckling, '//plural(step%n_modes, 'mode'))
            return
         end if
         call line('step '//to_text(number), name//control_text(step))
         do i = 1, size(step%mode_offset)
            associate (offset => step%mode_offset(i))
               call more('begins stress-free, '//plural(size(offset%element), 'element')//' offset by mode '// &
                  & to_text(offset%mode)//' of '//trim(model%step(offset%step)%name)//', largest offset '//brief(offset%amplitude))
            end associate
         end do
         do i = 1, size(step%load%motion, 2)
            if (any(abs(step%load%motion(:, i)) > 0.0_wp)) call more('moves '// &
               & trim(model%obstacle(i)%name)//' by '//place(step%load%motion(:, i))//' at load factor 1')
            if (abs(step%load%closing(i)) > 0.0_wp) call more('closes the gaps to '// &
               & trim(model%obstacle(i)%name)//' by '//brief(step%load%closing(i))//' at load factor 1')
            if (step%load%resolved(i) > 0.0_wp) call more('pushes out what begins behind '//trim(model%obstacle(i)%name))
         end do
         call more(end_text(step))
         do i = 1, size(step%branch)
            call more(branch_text(step, step%branch(i)))
         end do
         do i = 1, size(step%limit_curve)
            call more(limit_curve_text(step%limit_curve(i)))
         end do
      end subroutine write_step

      !> Strategy, increments and iteration of a step, in words.
      pure function control_text(step) result(text)
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
      pure function end_text(step) result(text)
         type(step_t), intent(in) :: step
         character(:), allocatable :: text
         integer :: i
         text = 'at most '//plural(step%max_points, 'point')//stop_text(step%stop)
         do i = 1, size(step%locate)
            text = text//', locate '//threshold_text(step%locate(i))//' = '//brief(step%locate(i)%value)
         end do
         do i = 1, size(step%turning)
            text = text//', locate turning points of '//trim(model%monitor(step%turning(i))%name)
         end do
      end function end_text

      pure function stop_text(stop) result(text)
         type(threshold_t), intent(in) :: stop(:)
         character(:), allocatable :: text
         integer :: i
         text = ''
         do i = 1, size(stop)
            text = text//', stop when '//threshold_text(stop(i))
            if (stop(i)%rising) then
               text = text//' rises above '//brief(stop(i)%value)
            else
               text = text//' falls below '//brief(stop(i)%value)
            end if
         end do
      end function stop_text

      pure function branch_text(step, branch) result(text)
         type(step_t), intent(in) :: step
         type(branch_t), intent(in) :: branch
         character(:), allocatable :: text
         text = 'branch '//trim(branch%name)//': from bifurcation '//to_text(branch%bifurcation)
         if (branch%of > 0) text = text//' of '//trim(step%branch(branch%of)%name)
         if (branch%side > 0) text = text//' along'
         if (branch%side < 0) text = text//' against'
         text = text//' null vector '//to_text(branch%mode)
         if (branch%increment > 0.0_wp) text = text//', first arc length '//brief(branch%increment)
         text = text//', at most '//plural(branch%max_points, 'point')//stop_text(branch%stop)
      end function branch_text

      pure function limit_curve_text(curve) result(text)
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

      pure function threshold_text(threshold) result(text)
         type(threshold_t), intent(in) :: threshold
         character(:), allocatable :: text
         text = 'the load factor'
         if (threshold%monitor > 0) text = trim(model%monitor(threshold%monitor)%name)
      end function threshold_text
   end subroutine write_deck_summary

   !> Number of nodes with supports or springs, and number of their unknowns.
   pure function freedoms_text(held) result(text)
      logical, intent(in) :: held(:, :)           !! (3, nodes) true: supported, or with a spring
      character(:), allocatable :: text
      text = 'at '//plural(count(any(held, 1)), 'node')//': '//to_text(count(held(1, :)))//' u, '// &
         & to_text(count(held(2, :)))//' v, '//to_text(count(held(3, :)))//' rotations'
   end function freedoms_text

   pure function place(x) result(text)
      real(wp), intent(in) :: x(2)
      character(:), allocatable :: text
      text = '('//brief(x(1))//', '//brief(x(2))//')'
   end function place
end module deck_summary

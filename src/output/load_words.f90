!> Loads and supports in words for the first part of the listing, so that a load at a wrong node is noticed at once.
module load_words
   use kinds, only: wp
   use model, only: model_t, load_t, supports
   use columns, only: brief
   use text, only: plural, to_text
   implicit none
   private
   public :: words_t, load_lines, support_lines, node_lines

   integer, parameter :: most_labels = 6        !! largest number of node labels listed one by one
   integer, parameter :: most_lines = 12        !! largest number of lines of one kind

   !> One line of text.
   type :: words_t
      character(:), allocatable :: text
   end type words_t

contains

   !> All loads of a step at load factor 1, one line for all equal loads, and their sum.
   function load_lines(model, load, total) result(lines)
      type(model_t), intent(in) :: model
      type(load_t), intent(in) :: load
      real(wp), intent(in) :: total(3)          !! sum of all loads: force in x, force in y, moment about the origin
      type(words_t), allocatable :: lines(:)
      real(wp) :: force(3), stiffness(3, 3)
      integer :: i
      logical :: sound
      lines = [node_lines(model, load%node_force, any(abs(load%node_force) > 0.0_wp, 1), 'load', 'moment')]
      do i = 1, size(load%pole_load)
         associate (pull => load%pole_load(i))
            call pull%push([model%mesh%x(:, pull%node), 0.0_wp], force, stiffness, sound)
            lines = [lines, words_t('load on '//nodes_text(model, [pull%node])//': '//vector_text(pull%magnitude * force, &
               & 'moment')//' at the start, turning as the node moves')]
         end associate
      end do
      lines = [lines, element_lines(load), varying_lines(model, load)]
      lines = [lines, node_lines(model, load%displacement, any(abs(load%displacement) > 0.0_wp, 1), &
         & 'prescribed displacement', 'rotation')]
      if (size(lines) == 0) return
      lines = [lines, words_t('sum of all loads at load factor 1: force ('//brief(total(1))//', '//brief(total(2))// &
         & '), moment about the origin '//brief(total(3)))]
   end function load_lines

   !> The supports, one line for all nodes with the same fixed components.
   function support_lines(model) result(lines)
      type(model_t), intent(in) :: model
      type(words_t), allocatable :: lines(:)
      character(*), parameter :: name(3) = [character(8) :: 'u', 'v', 'rotation']
      character(:), allocatable :: held
      logical :: fixed(3, model%mesh%n_nodes), left(model%mesh%n_nodes), alike(model%mesh%n_nodes)
      integer :: node, i
      allocate (lines(0))
      fixed = supports(model)
      left = any(fixed, 1)
      do node = 1, size(left)
         if (.not. left(node)) cycle
         alike = left .and. [(all(fixed(:, i) .eqv. fixed(:, node)), i=1, size(left))]
         left = left .and. .not. alike
         held = ''
         do i = 1, 3
            if (fixed(i, node)) held = held//', '//trim(name(i))
         end do
         lines = [lines, words_t(nodes_text(model, pack([(i, i=1, size(left))], alike))//': '//held(3:))]
      end do
   end function support_lines

   !> Values at nodes in words, one line for all nodes with equal values.
   function node_lines(model, value, has, what, turn) result(lines)
      type(model_t), intent(in) :: model
      real(wp), intent(in) :: value(:, :)       !! (3, nodes) values
      logical, intent(in) :: has(:)             !! (nodes) true: the node has a value
      character(*), intent(in) :: what          !! name of the value
      character(*), intent(in) :: turn          !! name of the third component
      type(words_t), allocatable :: lines(:)
      logical :: left(size(has)), alike(size(has))
      integer :: node, i
      allocate (lines(0))
      left = has
      do node = 1, size(left)
         if (.not. left(node)) cycle
         if (size(lines) == most_lines) then
            lines = [lines, words_t('and '//what//' on '//plural(count(left), 'node')//' more')]
            return
         end if
         alike = left .and. [(all(abs(value(:, i) - value(:, node)) <= 0.0_wp), i=1, size(left))]
         left = left .and. .not. alike
         lines = [lines, words_t(what//' on '//nodes_text(model, pack([(i, i=1, size(left))], alike))//': '// &
            & repeat('each ', merge(1, 0, count(alike) > 1))//vector_text(value(:, node), turn))]
      end do
   end function node_lines

   !> Loads along elements in words, one line for all elements with equal loads.
   function element_lines(load) result(lines)
      type(load_t), intent(in) :: load
      type(words_t), allocatable :: lines(:)
      real(wp) :: value(5, size(load%pressure)) ! force in x and y by length, pressure, strain, curvature
      logical :: left(size(load%pressure)), alike(size(load%pressure))
      character(:), allocatable :: text
      integer :: e, i
      allocate (lines(0))
      value(1:2, :) = load%line_force
      value(3, :) = merge(0.0_wp, load%pressure, any(abs(load%gradient) > 0.0_wp, 1))
      value(4, :) = load%strain
      value(5, :) = load%curvature
      left = any(abs(value) > 0.0_wp, 1)
      do e = 1, size(left)
         if (.not. left(e)) cycle
         if (size(lines) == most_lines) then
            lines = [lines, words_t('and load on '//plural(count(left), 'element')//' more')]
            return
         end if
         alike = left .and. [(all(abs(value(:, i) - value(:, e)) <= 0.0_wp), i=1, size(left))]
         left = left .and. .not. alike
         text = ''
         if (any(abs(value(1:2, e)) > 0.0_wp)) text = ', force ('//brief(value(1, e))//', '//brief(value(2, e))//') per length'
         if (abs(value(3, e)) > 0.0_wp) text = text//', pressure '//brief(value(3, e))//' to the left'
         if (abs(value(4, e)) > 0.0_wp) text = text//', strain '//brief(value(4, e))//' of heat'
         if (abs(value(5, e)) > 0.0_wp) text = text//', curvature '//brief(value(5, e))//' of heat'
         lines = [lines, words_t('load on '//plural(count(alike), 'element')//': '//text(3:))]
      end do
   end function element_lines

   !> Dead loads that vary along the rods, and pressures of liquids, in words: one line for each.
   function varying_lines(model, load) result(lines)
      type(model_t), intent(in) :: model
      type(load_t), intent(in) :: load
      type(words_t), allocatable :: lines(:)
      character(:), allocatable :: text
      logical, allocatable :: wet(:)
      integer :: i
      allocate (lines(0))
      do i = 1, size(load%line_load)
         associate (part => load%line_load(i))
            text = merge('along and to the left of the axis', 'in x and y                       ', part%along_axis)
            text = 'load on '//plural(count(part%on), 'element')//', '//trim(text)//': ('//brief(part%direction(1))//', '// &
               & brief(part%direction(2))//')'
            if (part%intensity%distribution > 0) then
               text = text//' times '//trim(model%distribution(part%intensity%distribution)%name)
            else
               text = text//' times '//brief(part%intensity%value)
            end if
            if (part%weight) text = text//' times the mass'
            lines = [lines, words_t(text//' per length')]
         end associate
      end do
      wet = any(abs(load%gradient) > 0.0_wp, 1)
      if (any(wet)) lines = [lines, words_t('liquid on '//plural(count(wet), 'element')// &
         & ': pressure to the left, at y = 0 from '//brief(minval(load%pressure, wet))//' to '//brief(maxval(load%pressure, &
         & wet))//', rising with depth by '// &
         & brief(minval(-load%gradient(2, :), wet))//' to '//brief(maxval(-load%gradient(2, :), wet)))]
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
            text = 'node '//text//' at ('//brief(x(1))//', '//brief(x(2))//')'
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
      if (any(abs(value(1:2)) > 0.0_wp)) text = '('//brief(value(1))//', '//brief(value(2))//')'
      if (abs(value(3)) > 0.0_wp .and. text /= '') text = text//', '
      if (abs(value(3)) > 0.0_wp) text = text//turn//' '//brief(value(3))
   end function vector_text
end module load_words

!> Sections and dead loads that vary along the rods, evaluated at the stages of an element.
module rod_samples
   use kinds, only: wp
   use model, only: model_t
   use load_pattern, only: load_t
   use cross_section, only: section_t, varies, local_section
   use rod_geometry, only: geometry_t
   implicit none
   private
   public :: stage_section, middle_section, add_line_loads

contains

   !> The section at a stage of an element.
   pure function stage_section(model, geometry, e, stage) result(section)
      type(model_t), intent(in) :: model
      type(geometry_t), intent(in) :: geometry
      integer, intent(in) :: e, stage
      type(section_t) :: section
      section = model%section(model%mesh%section(e))
      if (varies(section)) section = local_section(section, geometry%sample(:, stage, e))
   end function stage_section

   !> The section of an element; if it varies, the section with the mean dimensions of all stages.
   pure function middle_section(model, geometry, e) result(section)
      type(model_t), intent(in) :: model
      type(geometry_t), intent(in) :: geometry
      integer, intent(in) :: e
      type(section_t) :: section
      section = model%section(model%mesh%section(e))
      if (.not. varies(section)) return
      associate (s => model%mesh%stages(e))
         section = local_section(section, sum(geometry%sample(:, :s, e), 2) / s)
      end associate
   end function middle_section

   !> Adds the varying dead loads of a pattern at the stages of an element; an element without stages has a single value.
   pure subroutine add_line_loads(model, geometry, e, load, line, varies)
      type(model_t), intent(in) :: model
      type(geometry_t), intent(in) :: geometry
      integer, intent(in) :: e
      type(load_t), intent(in) :: load
      real(wp), intent(inout) :: line(:, :)     !! (2, max(stages, 1)) dead load by stress-free length [force/length]
      logical, intent(inout) :: varies          !! set to true if a varying dead load acts on the element
      type(section_t) :: section
      real(wp) :: t(2), intensity
      integer :: i, k
      do k = 1, size(load%line_load)
         associate (part => load%line_load(k))
            if (.not. part%on(e)) cycle
            varies = .true.
            do i = 1, size(line, 2)
               intensity = part%intensity%value
               if (part%intensity%distribution > 0) intensity = geometry%sample(part%intensity%distribution, i, e)
               if (part%weight) then
                  section = stage_section(model, geometry, e, i)
                  intensity = intensity * section%mass
               end if
               if (part%along_axis) then
                  t = geometry%element(e)%tangent(:, i)
                  line(:, i) = line(:, i) + intensity * (part%direction(1) * t + part%direction(2) * [-t(2), t(1)])
               else
                  line(:, i) = line(:, i) + intensity * part%direction
               end if
            end do
         end associate
      end do
   end subroutine add_line_loads
end module rod_samples

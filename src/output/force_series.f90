!> Growing tables of the contact forces on contact spans: one row for each force at a point or at the end of a line contact, and for
!> each sample of the pressure along line contacts. Only stored points of the path have rows.
module force_series
   use kinds, only: wp
   use model, only: model_t
   use path_record, only: point_t
   use hdf5_file, only: hdf5_file_t
   use hdf5_series, only: series_set_t, series_table, series_defined, series_row, series_integer, series_real, series_reals
   implicit none
   private
   public :: force_series_t, open_forces, append_forces

   !> Handles of the tables of contact forces and of contact pressures in the result file; 0: the file has no such table.
   type :: force_series_t
      private
      integer :: force = 0, pressure = 0
   end type force_series_t

contains

   !> Defines both tables if a step stores reactions and the deck has contact along rods.
   subroutine open_forces(series, set, file, model, group)
      type(force_series_t), intent(out) :: series
      type(series_set_t), intent(inout) :: set
      type(hdf5_file_t), intent(inout) :: file
      type(model_t), intent(in) :: model
      character(*), intent(in) :: group           !! group of the path; '': root
      real(wp), parameter :: nothing(6) = 0.0_wp
      if (.not. any(model%contact%along)) return
      if (.not. any(model%step%field_every > 0 .and. model%step%field_reaction)) return
      call series_table(set, file, series%force, group//'/contact_force')
      call put_force(set, series%force, 0, nothing)
      call series_defined(set, file, series%force)
      call series_table(set, file, series%pressure, group//'/contact_pressure')
      call put_pressure(set, series%pressure, 0, nothing)
      call series_defined(set, file, series%pressure)
   end subroutine open_forces

   !> Appends the contact forces of one point.
   subroutine append_forces(series, set, point, row)
      type(force_series_t), intent(in) :: series
      type(series_set_t), intent(inout) :: set
      type(point_t), intent(in) :: point
      integer, intent(in) :: row                  !! the point's number, from 1
      integer :: i
      if (series%force == 0) return
      if (allocated(point%contact_force)) then
         do i = 1, size(point%contact_force, 2)
            call put_force(set, series%force, row, point%contact_force(:, i))
         end do
      end if
      if (allocated(point%contact_pressure)) then
         do i = 1, size(point%contact_pressure, 2)
            call put_pressure(set, series%pressure, row, point%contact_pressure(:, i))
         end do
      end if
   end subroutine append_forces

   !> Columns of /contact_force.
   subroutine put_force(set, table, row, push)
      type(series_set_t), intent(inout) :: set
      integer, intent(in) :: table, row
      real(wp), intent(in) :: push(6)             !! see span_pushes
      call put_place(set, table, row, push)
      call series_reals(set, 'force', [2], push(5:6), 'force', 'force (x, y) on the structure at a point or the end of a line')
   end subroutine put_force

   !> Columns of /contact_pressure.
   subroutine put_pressure(set, table, row, push)
      type(series_set_t), intent(inout) :: set
      integer, intent(in) :: table, row
      real(wp), intent(in) :: push(6)             !! see span_pushes
      call put_place(set, table, row, push)
      call series_reals(set, 'force', [2], push(5:6), 'force/length', &
         & 'force (x, y) on the structure per stress-free length of a line of contact: five places at equal distances in each '// &
         & 'part that is smooth, one part after another')
   end subroutine put_pressure

   !> Columns of both tables.
   subroutine put_place(set, table, row, push)
      type(series_set_t), intent(inout) :: set
      integer, intent(in) :: table, row
      real(wp), intent(in) :: push(6)             !! see span_pushes
      call series_row(set, table)
      call series_integer(set, 'point', row, '1', 'point of the path, from 1')
      call series_integer(set, 'contact', nint(push(1)), '1', 'contact of the deck, from 1')
      call series_real(set, 'arc_length', push(2), 'length', 'stress-free arc length along the contact')
      call series_reals(set, 'place', [2], push(3:4), 'length', 'where it acts (x, y), deformed')
   end subroutine put_place
end module force_series

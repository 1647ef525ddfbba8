!> Growing tables of the contact forces on contact spans: one row for each force at a point or at the end of a line contact, and for
!> each sample of the pressure along line contacts. Only stored points of the path have rows.
module force_series
   use kinds, only: wp
   use model, only: model_t
   use path_record, only: point_t
   use hdf5_file, only: hdf5_file_t, hdf5_group
   use hdf5_series, only: series_set_t, series_real, series_integer, series_append
   implicit none
   private
   public :: force_series_t, open_forces, append_forces

   integer, parameter :: number(0) = 0            ! a row is one number

   !> Numbers of the datasets of one table in their set; 0: the file has no such table.
   type :: table_t
      integer :: point = 0, contact = 0, arc_length = 0, place = 0, force = 0
   end type table_t

   type :: force_series_t
      private
      type(table_t) :: single, along
   end type force_series_t

contains

   !> Creates both tables if a step stores reactions and the deck has contact along rods.
   subroutine open_forces(series, set, file, model, group)
      type(force_series_t), intent(out) :: series
      type(series_set_t), intent(inout) :: set
      type(hdf5_file_t), intent(inout) :: file
      type(model_t), intent(in) :: model
      character(*), intent(in) :: group           !! group of the path; '': root
      if (.not. any(model%contact%along)) return
      if (.not. any(model%step%field_every > 0 .and. model%step%field_reaction)) return
      call open_table(series%single, '/contact_force', 'force', 'force (x, y) on the structure at a point or the end of a line', &
         & .true.)
      call open_table(series%along, '/contact_pressure', 'force/length', &
         & 'force (x, y) on the structure per stress-free length of a line of contact: five places at equal distances in each '// &
         & 'part that is smooth, one part after another', .false.)

   contains

      subroutine open_table(id, name, units, meaning, few)
         type(table_t), intent(out) :: id
         character(*), intent(in) :: name, units, meaning
         logical, intent(in) :: few
         character(:), allocatable :: table
         table = group//name
         call hdf5_group(file, table)
         call series_integer(set, file, id%point, table//'/point', number, '1', 'point of the path, from 1', few=few)
         call series_integer(set, file, id%contact, table//'/contact', number, '1', 'contact of the deck, from 1', few=few)
         call series_real(set, file, id%arc_length, table//'/arc_length', number, 'length', &
            & 'stress-free arc length along the contact', few=few)
         call series_real(set, file, id%place, table//'/place', [2], 'length', 'where it acts (x, y), deformed', few=few)
         call series_real(set, file, id%force, table//'/force', [2], units, meaning, few=few)
      end subroutine open_table
   end subroutine open_forces

   !> Appends the contact forces of one point.
   subroutine append_forces(series, set, point, row)
      type(force_series_t), intent(in) :: series
      type(series_set_t), intent(inout) :: set
      type(point_t), intent(in) :: point
      integer, intent(in) :: row                  !! the point's number, from 1
      if (series%single%point == 0) return
      if (allocated(point%contact_force)) call append_rows(series%single, point%contact_force)
      if (allocated(point%contact_pressure)) call append_rows(series%along, point%contact_pressure)

   contains

      subroutine append_rows(id, list)
         type(table_t), intent(in) :: id
         real(wp), intent(in) :: list(:, :)       !! (6, forces) see span_pushes
         integer :: i
         do i = 1, size(list, 2)
            call series_append(set, id%point, row)
            call series_append(set, id%contact, nint(list(1, i)))
            call series_append(set, id%arc_length, list(2, i))
            call series_append(set, id%place, list(3:4, i))
            call series_append(set, id%force, list(5:6, i))
         end do
      end subroutine append_rows
   end subroutine append_forces
end module force_series

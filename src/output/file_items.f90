!> The contents of a result file in memory: a list of groups, datasets and attributes, in the order in which readers find them.
!>
!> A dataset may grow by rows. Its last extent, the first one as a reader in C or Python sees it, then counts the rows.
module file_items
   use, intrinsic :: iso_c_binding, only: c_null_char
   use, intrinsic :: ieee_arithmetic, only: ieee_value, ieee_quiet_nan
   use kinds, only: wp, i8
   implicit none
   private
   public :: data_t, item_t, items_t, data_of, row_of, place_of, put_item, remove_items, append_row, row_count
   public :: is_real, is_integer, is_text
   public :: reals_in, integers_in, text_in, texts_in

   integer, parameter, public :: most_extents = 4 !! largest rank of a dataset

   !> Types of values:
   enum, bind(c)
      enumerator :: is_real = 1, is_integer, is_text
   end enum

   !> Values of any type and rank, as bytes in Fortran's order.
   type :: data_t
      integer :: kind = is_real                   !! is_...
      integer :: length = storage_size(1.0_wp) / 8 !! bytes of one value
      integer :: rank = 0
      integer :: extent(most_extents) = 1         !! extents; beyond the rank: 1
      character(1), allocatable :: bytes(:)       !! the values; none: they are missing
   end type data_t

   !> A group, or a dataset or attribute with its values.
   type :: item_t
      character(:), allocatable :: path           !! full path of the group or dataset; '': the file itself
      character(:), allocatable :: attribute      !! name of its attribute; '': it is no attribute
      character(:), allocatable :: units, description !! of a dataset
      type(data_t) :: values                      !! its bytes may be followed by unused space; not allocated: a group
      logical :: ragged = .false.                 !! true: the first extent may grow
   end type item_t

   !> One item of a list: lists become longer without copies of the values.
   type :: box_t
      type(item_t), allocatable :: item
   end type box_t

   !> A list of items.
   type :: items_t
      integer :: n = 0
      type(box_t), allocatable :: box(:)          !! the items are in the first n boxes
   end type items_t

   !> data_of(value): a number, a text, or an array of them. Texts of an array have the length of the longest.
   interface data_of
      module procedure data_integer, data_integers, data_integers_2, data_text, data_texts, data_real, data_reals, data_reals_2, &
         & data_reals_3
   end interface data_of

contains

   ! Values ---------------------------------------------------------------------------------------------------------

   pure type(data_t) function data_integer(value) result(data)
      integer, intent(in) :: value
      data%kind = is_integer
      data%length = storage_size(value) / 8
      data%bytes = transfer(value, [character(1) ::])
   end function data_integer

   pure type(data_t) function data_integers(value) result(data)
      integer, intent(in) :: value(:)
      data = data_integer(0)
      call set_extents(data, shape(value))
      data%bytes = transfer(value, [character(1) ::])
   end function data_integers

   pure type(data_t) function data_integers_2(value) result(data)
      integer, intent(in) :: value(:, :)
      data = data_integers(reshape(value, [size(value)]))
      call set_extents(data, shape(value))
   end function data_integers_2

   !> A text; with a length, it is cut or padded to this number of bytes.
   pure type(data_t) function data_text(value, length) result(data)
      character(*), intent(in) :: value           !! trailing blanks are dropped
      integer, intent(in), optional :: length
      character(:), allocatable :: text
      text = trim(value)
      if (present(length)) text = trim(value(:min(len(value), length)))
      if (present(length)) text = text//repeat(c_null_char, length - len(text))
      data = data_texts([text])
      data%rank = 0
   end function data_text

   !> Texts, padded with null characters.
   pure type(data_t) function data_texts(value) result(data)
      character(*), intent(in) :: value(:)
      character(:), allocatable :: text
      integer :: i, used
      data%kind = is_text
      data%length = max(1, maxval([0, len_trim(value)]))
      call set_extents(data, shape(value))
      text = repeat(c_null_char, data%length * size(value))
      do i = 1, size(value)
         used = len_trim(value(i))
         text((i - 1) * data%length + 1:(i - 1) * data%length + used) = value(i) (:used)
      end do
      allocate (data%bytes(len(text)))
      data%bytes = transfer(text, data%bytes, len(text))
   end function data_texts

   pure type(data_t) function data_real(value) result(data)
      real(wp), intent(in) :: value
      data%bytes = transfer(value, [character(1) ::])
   end function data_real

   pure type(data_t) function data_reals(value) result(data)
      real(wp), intent(in) :: value(:)
      data = row_of(shape(value), value)
   end function data_reals

   pure type(data_t) function data_reals_2(value) result(data)
      real(wp), intent(in) :: value(:, :)
      data = row_of(shape(value), value)
   end function data_reals_2

   pure type(data_t) function data_reals_3(value) result(data)
      real(wp), intent(in) :: value(:, :, :)
      data = row_of(shape(value), value)
   end function data_reals_3

   !> A row of reals of the given extents; they are missing if the value is absent.
   pure type(data_t) function row_of(extent, value) result(data)
      integer, intent(in) :: extent(:)
      real(wp), intent(in), optional :: value(*)  !! of these extents
      call set_extents(data, extent)
      if (present(value)) then
         data%bytes = transfer(value(:product(extent)), [character(1) ::])
      else
         allocate (data%bytes(0))
      end if
   end function row_of

   pure subroutine set_extents(data, extent)
      type(data_t), intent(inout) :: data
      integer, intent(in) :: extent(:)
      data%rank = size(extent)
      data%extent(:data%rank) = extent
   end subroutine set_extents

   !> Bytes of a missing value: NaN, 0, or an empty text.
   pure function missing_value(data) result(fill)
      type(data_t), intent(in) :: data
      character(1) :: fill(data%length)
      select case (data%kind)
      case (is_real)
         fill = transfer(ieee_value(1.0_wp, ieee_quiet_nan), fill)
      case (is_integer)
         fill = transfer(0, fill)
      case default
         fill = c_null_char
      end select
   end function missing_value

   ! The list -------------------------------------------------------------------------------------------------------

   !> Index of an item; 0: there is none.
   pure integer function place_of(items, path, attribute)
      type(items_t), intent(in) :: items
      character(*), intent(in) :: path, attribute !! full path; name of the attribute, '': none
      do place_of = 1, items%n
         if (.not. allocated(items%box(place_of)%item)) cycle
         associate (item => items%box(place_of)%item)
            if (len(item%path) /= len(path) .or. len(item%attribute) /= len(attribute)) cycle
            if (item%path == path .and. item%attribute == attribute) return
         end associate
      end do
      place_of = 0
   end function place_of

   !> Index of an item, which is created if there is none of its path.
   subroutine put_item(items, path, attribute, i)
      type(items_t), intent(inout) :: items
      character(*), intent(in) :: path, attribute !! full path; name of the attribute, '': none
      integer, intent(out) :: i
      type(box_t), allocatable :: longer(:)
      i = place_of(items, path, attribute)
      if (i > 0) return
      if (.not. allocated(items%box)) allocate (items%box(128))
      if (items%n == size(items%box)) then
         allocate (longer(2 * items%n))
         do i = 1, items%n
            call move_alloc(items%box(i)%item, longer(i)%item)
         end do
         call move_alloc(longer, items%box)
      end if
      items%n = items%n + 1
      i = items%n
      allocate (items%box(i)%item)
      associate (item => items%box(i)%item)
         item%path = path
         item%attribute = attribute
         item%units = ''
         item%description = ''
      end associate
   end subroutine put_item

   !> Removes a group with all that is in it, or a dataset. All other items keep their indices, which tables refer to; the boxes of
   !> those removed remain, without an item.
   subroutine remove_items(items, path)
      type(items_t), intent(inout) :: items
      character(*), intent(in) :: path
      integer :: i
      do i = 1, items%n
         if (.not. allocated(items%box(i)%item)) cycle
         if (index(items%box(i)%item%path//'/', path//'/') == 1) deallocate (items%box(i)%item)
      end do
   end subroutine remove_items

   ! Rows -----------------------------------------------------------------------------------------------------------

   !> Bytes of one row.
   pure integer(i8) function row_bytes(data)
      type(data_t), intent(in) :: data
      row_bytes = product(int(data%extent(:data%rank - 1), i8)) * data%length
   end function row_bytes

   !> Appends a row to the values of an item, unless it has another type or another size. Missing values are filled up. The first
   !> row of an item gives its type and size.
   subroutine append_row(item, row)
      type(item_t), intent(inout) :: item
      type(data_t), intent(in) :: row
      character(1), allocatable :: longer(:)
      integer(i8) :: first, n, last
      if (.not. allocated(item%values%bytes)) then
         item%values = row
         item%values%rank = row%rank + 1
         item%values%extent(row%rank + 1) = 0
         if (item%ragged) item%values%extent(1) = 1
      end if
      if (row%kind /= item%values%kind .or. row%rank + 1 /= item%values%rank) return
      if (item%ragged) then
         if (row%extent(1) > item%values%extent(1)) call widen(item%values, row%extent(1))
      else if (any(row%extent(:row%rank) /= item%values%extent(:row%rank))) then
         return
      end if
      associate (data => item%values, rows => item%values%extent(row%rank + 1))
         n = row_bytes(data)
         first = rows * n
         last = first + min(size(row%bytes, kind=i8), n)
         if (first + n > size(data%bytes, kind=i8)) then
            allocate (longer((3 * (first + n)) / 2 + 8 * n))
            longer(:first) = data%bytes(:first)
            call move_alloc(longer, data%bytes)
         end if
         data%bytes(first + 1:last) = row%bytes(:last - first)
         call fill_up(data, last, first + n)
         rows = rows + 1
      end associate
   end subroutine append_row

   !> Fills bytes with the missing value.
   pure subroutine fill_up(data, first, last)
      type(data_t), intent(inout) :: data
      integer(i8), intent(in) :: first, last      !! bytes first + 1 to last
      character(1) :: fill(data%length)
      integer(i8) :: i
      if (last <= first) return
      if (data%kind == is_text) then
         data%bytes(first + 1:last) = c_null_char
         return
      end if
      fill = missing_value(data)
      do i = first, last - 1, data%length
         data%bytes(i + 1:i + data%length) = fill
      end do
   end subroutine fill_up

   !> Changes the rows of ragged values to rows of n values.
   subroutine widen(data, n)
      type(data_t), intent(inout) :: data
      integer, intent(in) :: n
      character(1), allocatable :: old(:)
      integer(i8) :: was, now, i
      was = row_bytes(data)
      call move_alloc(data%bytes, old)
      data%extent(1) = n
      now = row_bytes(data)
      allocate (data%bytes(now * (data%extent(data%rank) + 1)))
      do i = 0, data%extent(data%rank) - 1
         data%bytes(i * now + 1:i * now + was) = old(i * was + 1:(i + 1) * was)
         call fill_up(data, i * now + was, (i + 1) * now)
      end do
   end subroutine widen

   !> Number of rows of an item that grows.
   pure integer function row_count(item)
      type(item_t), intent(in) :: item
      row_count = item%values%extent(item%values%rank)
   end function row_count

   ! Values of a list -------------------------------------------------------------------------------------------------

   !> Real numbers of a dataset; none if it is missing.
   pure function reals_in(items, path) result(value)
      type(items_t), intent(in) :: items
      character(*), intent(in) :: path            !! full path of the dataset
      real(wp), allocatable :: value(:)
      value = transfer(bytes_in(items, path, '', is_real), [real(wp) ::])
   end function reals_in

   !> Integers of a dataset; none if it is missing.
   pure function integers_in(items, path) result(value)
      type(items_t), intent(in) :: items
      character(*), intent(in) :: path            !! full path of the dataset
      integer, allocatable :: value(:)
      value = transfer(bytes_in(items, path, '', is_integer), [integer ::])
   end function integers_in

   !> Texts of a dataset; none if it is missing.
   pure function texts_in(items, path, length) result(value)
      type(items_t), intent(in) :: items
      character(*), intent(in) :: path            !! full path of the dataset
      integer, intent(in) :: length               !! bytes of each text in the file
      character(length), allocatable :: value(:)
      character(1), allocatable :: bytes(:)
      bytes = bytes_in(items, path, '', is_text)
      where (bytes == c_null_char) bytes = ' '
      allocate (value(size(bytes) / length))
      value = transfer(bytes, value, size(value))
   end function texts_in

   !> Text of an attribute; '' if it is missing.
   pure function text_in(items, path, name) result(text)
      type(items_t), intent(in) :: items
      character(*), intent(in) :: path, name      !! path of the object ('': the file); name of the attribute
      character(:), allocatable :: text
      character(1), allocatable :: bytes(:)
      bytes = bytes_in(items, path, name, is_text)
      where (bytes == c_null_char) bytes = ' '
      text = trim(transfer(bytes, repeat(' ', size(bytes))))
   end function text_in

   !> Bytes of the values of an item; none if there is no item of this type.
   pure function bytes_in(items, path, attribute, kind) result(bytes)
      type(items_t), intent(in) :: items
      character(*), intent(in) :: path, attribute
      integer, intent(in) :: kind
      character(1), allocatable :: bytes(:)
      integer :: place
      allocate (bytes(0))
      place = place_of(items, path, attribute)
      if (place == 0) return
      associate (data => items%box(place)%item%values)
         if (data%kind == kind .and. allocated(data%bytes)) bytes = data%bytes(:row_bytes(data) * data%extent(max(data%rank, 1)))
      end associate
   end function bytes_in
end module file_items

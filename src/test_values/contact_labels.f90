!> Labels of contact changes, C+ (contact gained) and C- (contact lost), and the words that messages use for them.
module contact_labels
   implicit none
   private
   public :: contact_gained, contact_lost, contact_label, is_contact_label, contact_words

   character(2), parameter :: contact_gained = 'C+', contact_lost = 'C-'

contains

   !> Label of a change by which some contacts are gained and some are lost: C- if more are lost than gained, C+ otherwise; blank if
   !> none is gained or lost.
   pure character(2) function contact_label(gained, lost) result(label)
      integer, intent(in) :: gained, lost !! numbers of contacts, >= 0
      label = '  '
      if (gained > 0) label = contact_gained
      if (lost > gained) label = contact_lost
   end function contact_label

   !> True for the label of a contact change.
   pure logical function is_contact_label(label)
      character(*), intent(in) :: label !! label of a point; blank: an ordinary point
      is_contact_label = any(label == [contact_gained, contact_lost])
   end function is_contact_label

   !> Note on a contact change, in words.
   pure function contact_words(label, divided) result(words)
      character(*), intent(in) :: label !! C+ or C-
      logical, intent(in) :: divided    !! true: two contact regions merge (C+), or a contact region splits (C-)
      character(:), allocatable :: words
      if (label == contact_gained) then
         words = trim(merge('two contact regions merge', 'contact gained           ', divided))
      else
         words = trim(merge('a contact region splits', 'contact lost           ', divided))
      end if
   end function contact_words
end module contact_labels

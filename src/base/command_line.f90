!> The command line: options given by the user, and the help text.
module command_line
   use kinds, only: wp
   use errors, only: error_t, fail
   use printable_text, only: quoted, quoted_path
   implicit none
   private
   public :: command_line_t, read_command_line, parse_arguments, help_text

   integer, parameter :: argument_length = 1000 !! longest argument

   !> Options of the command line.
   type :: command_line_t
      character(:), allocatable :: deck    !! name of the deck's file; '': standard input
      character(:), allocatable :: restart !! result file from which the run continues; '': none
      character(:), allocatable :: from    !! name of the point from which the run continues; '': the last point
      character(:), allocatable :: output  !! name of the result file; '': it follows from the name of the deck or its job
      character(:), allocatable :: template !! name of the deck template that `init` writes; '': there is no init
      character(argument_length), allocatable :: set(:) !! text name=value of every --set
      real(wp) :: max_seconds = 0.0_wp     !! time limit of the run [s]; 0: no limit
      logical :: force = .false.           !! true: any file with the name of the result file may be replaced
      logical :: check = .false.           !! true: the deck is only read, checked and summarised
      logical :: model = .false.           !! true: the model is written to the result file, and no path is followed
      logical :: expand = .false.          !! true: only the deck is printed, with the included decks inserted
      logical :: quiet = .false.           !! true: no listing is written
      logical :: help = .false., version = .false., cards = .false. !! true: help, version or cards are printed, and nothing else is
      !! done
      character(:), allocatable :: topic   !! topic of --help or --cards; '': everything
      logical :: cards_as_json = .false.   !! true: the cards are printed as JSON
   end type command_line_t

contains

   !> Reads the arguments of the program.
   subroutine read_command_line(options, error)
      type(command_line_t), intent(out) :: options     !! the options, see parse_arguments
      type(error_t), allocatable, intent(out) :: error !! allocated: an argument is wrong (see parse_arguments) or too long
      character(argument_length), allocatable :: argument(:)
      integer :: i, status
      allocate (argument(command_argument_count()))
      do i = 1, size(argument)
         call get_command_argument(i, argument(i), status=status)
         if (status /= 0) then
            call parse_arguments(argument(:0), options, error)
            call fail(error, 'an argument has more than 1000 characters')
            return
         end if
      end do
      call parse_arguments(argument, options, error)
   end subroutine read_command_line

   !> Interprets the arguments of the command line.
   subroutine parse_arguments(argument, options, error)
      character(*), intent(in) :: argument(:)          !! arguments without the name of the program; trailing blanks are ignored
      type(command_line_t), intent(out) :: options     !! the options; deck, output and set are always allocated
      type(error_t), allocatable, intent(out) :: error !! allocated: an argument is unknown or contradicts another one; the message
      !! names it
      character(:), allocatable :: seconds
      integer :: i ! number of the last argument that is interpreted
      logical :: only_files
      options%deck = ''
      options%output = ''
      options%template = ''
      options%topic = ''
      options%restart = ''
      options%from = ''
      seconds = ''
      allocate (options%set(0))
      only_files = .false.
      i = 0
      if (any(argument(:min(1, size(argument))) == 'init')) then
         i = 1
         call take_value('init', 'a name: beam, column, liner, pipe or ring', options%template)
      end if
      do while (i < size(argument) .and. .not. allocated(error))
         i = i + 1
         if (only_files .or. argument(i)(1:1) /= '-') then
            call take_deck(trim(argument(i)))
         else
            call take_option(trim(argument(i)))
         end if
      end do
      if (allocated(error)) return
      if (options%restart /= '' .and. (options%check .or. options%expand)) call fail(error, '--restart with --check or --expand')
      if (options%from /= '' .and. options%restart == '') call fail(error, '--from without --restart')
      if (options%from /= '' .and. (options%output == '' .or. options%output == options%restart)) &
         & call fail(error, '--from leaves out the points behind: name another result file with -o')
      if (options%check .and. options%expand) call fail(error, 'either --check or --expand')
      if (options%model .and. (options%check .or. options%expand)) call fail(error, 'either --model or --check or --expand')
      if (options%expand .and. options%output /= '') call fail(error, '--expand writes no results: leave out -o')
      if (options%check .and. options%output /= '') call fail(error, '--check writes no results: leave out -o')

   contains

      !> Takes an argument as the name of the deck.
      subroutine take_deck(name)
         character(*), intent(in) :: name
         if (name == '') then
            call fail(error, 'the name of the deck is empty')
         else if (options%template /= '') then
            call fail(error, 'init takes one name, and with -o FILE another place')
         else if (options%deck /= '') then
            call fail(error, 'one deck at a time: '//quoted_path(options%deck)//' or '//quoted_path(name)//'?')
         else
            options%deck = name
         end if
      end subroutine take_deck

      !> Interprets an option, with its value if it has one.
      subroutine take_option(option)
         character(*), intent(in) :: option
         character(:), allocatable :: value
         select case (option)
         case ('-o')
            call take_value('-o', 'the name of a file', options%output)
         case ('--set')
            value = ''
            call take_value('--set', 'name=value', value)
            if (.not. allocated(error) .and. index(value, '=') < 2) &
               & call fail(error, '--set needs name=value, not '''//quoted(value)//'''')
            options%set = [character(argument_length) :: options%set, value]
         case ('--restart')
            call take_value('--restart', 'the name of a result file', options%restart)
         case ('--from')
            call take_value('--from', 'a point: its number or its label, as LP1', options%from)
         case ('--max-seconds')
            call take_value('--max-seconds', 'a positive number of seconds', seconds)
            options%max_seconds = seconds_of(seconds)
            if (.not. (allocated(error) .or. options%max_seconds > 0.0_wp)) &
               & call fail(error, '--max-seconds needs a positive number of seconds, not '''//quoted(seconds)//'''')
         case ('--force')
            options%force = .true.
         case ('--expand')
            options%expand = .true.
         case ('--check')
            options%check = .true.
         case ('--model')
            options%model = .true.
         case ('--quiet')
            options%quiet = .true.
         case ('--help', '-h')
            options%help = .true.
            ! An option is the topic only if it is the last argument.
            call take_topic(i + 1 == size(argument))
         case ('--version')
            options%version = .true.
         case ('--cards')
            options%cards = .true.
            call take_topic(.false.)
         case ('--cards=json')
            options%cards_as_json = .true.
         case ('--')
            only_files = .true.
         case default
            call fail(error, 'unknown option '//quoted(option))
         end select
      end subroutine take_option

      !> Takes the next argument as the value of an option, which may be given only once.
      subroutine take_value(option, needs, value)
         character(*), intent(in) :: option, needs          !! name of the option; description of its value
         character(:), allocatable, intent(inout) :: value  !! value of the option; '': not given yet
         if (value /= '') then
            call fail(error, option//' is given twice')
         else if (i == size(argument)) then
            call fail(error, option//' needs '//needs)
         else if (argument(i + 1) == '' .or. argument(i + 1)(1:1) == '-') then
            call fail(error, option//' needs '//needs//', not '''//quoted(trim(argument(i + 1)))//'''')
         else
            i = i + 1
            value = trim(argument(i))
         end if
      end subroutine take_value

      !> Takes the next argument as the topic of --help or --cards, unless it is an option.
      subroutine take_topic(options_too)
         logical, intent(in) :: options_too    !! true: an option is accepted as a topic, too
         if (i == size(argument)) return
         if (argument(i + 1) == '' .or. (argument(i + 1)(1:1) == '-' .and. .not. options_too)) return
         i = i + 1
         options%topic = trim(argument(i))
      end subroutine take_topic
   end subroutine parse_arguments

   !> A number of seconds; zero if the text is not a number.
   real(wp) function seconds_of(text)
      character(*), intent(in) :: text
      integer :: status
      status = 1
      if (verify(trim(text), '0123456789.') == 0) read (text, *, iostat=status) seconds_of
      if (status /= 0) seconds_of = 0.0_wp
   end function seconds_of

   !> Text printed by --help, lines ended by newlines.
   pure function help_text() result(string)
      character(:), allocatable :: string
      character(*), parameter :: nl = new_line('a')
      string = 'usage: unilat [options] [deck.inp]'//nl// &
         '       unilat init NAME [-o FILE]'//nl// &
         'Follows the equilibrium path of plane rods with unilateral contact. Without a file, the deck is read '// &
         'from'//nl// &
         'standard input: unilat < deck.inp. "init" writes a deck with comments, NAME.inp, to begin with: NAME is '// &
         'beam,'//nl// &
         'column, liner, pipe or ring.'//nl//nl// &
         '  -o FILE     result file (HDF5); default: JOB on *HEADING, else the name of the deck, with .h5'//nl// &
         '  --force     replace a file of that name even if it is no result of unilat'//nl// &
         '  --max-seconds N'//nl// &
         '              end after so many seconds, the path up to there in the result file'//nl// &
         '  --restart FILE'//nl// &
         '              go on where the run of a result file stood, with its deck or another one with other'//nl// &
         '              *STATIC, *CONTROLS, *ACCURACY, *STOP; the file goes on, too, unless -o names another'//nl// &
         '  --from POINT'//nl// &
         '              with --restart: go on from this point of the path instead, its number or its label (LP1: the first'//nl// &
         '              limit point), on branch 2 as 2:LP1; the run up to there is made again, and -o names the file'//nl// &
         '  --set NAME=VALUE'//nl// &
         '              value of a parameter, instead of that on *PARAMETER; may be repeated'//nl// &
         '  --expand    print the deck with the included decks in their place, compute nothing'//nl// &
         '  --check     read, check and summarise the deck, compute nothing'//nl// &
         '  --model     write the model (mesh, supports, loads, obstacles) to FILE, compute nothing; unilat-plot model draws it'// &
         nl// &
         '  --quiet     no listing'//nl// &
         '  --cards [CARD]'//nl// &
         '              print the reference of all cards (Markdown), or of one: unilat --cards BOUNDARY;'//nl// &
         '              --cards=json prints it for programs'//nl// &
         '  --help [WORD]'//nl// &
         '              print this, or what is known of a card, an option, a parameter, a word of a deck: unilat --help RIKS'// &
         nl// &
         '  --version   print versions of program, compiler and libraries'//nl//nl// &
         'exit codes: 0 path complete, 1 error in the deck or the command, 2 stopped early (the path up to there '// &
         'is'//nl// &
         'safe in the result file), 3 internal error, 5 the machine does not let it: cannot write, no memory,'//nl// &
         'another run has the file, 6 ended by a signal or by --max-seconds (the path up to there is safe)'//nl
   end function help_text
end module command_line

!> Words of Abaqus and CalculiX that unilat decks do not have, each with its equivalent here or a message that there is none.
module foreign_words
   use text, only: word_index
   implicit none
   private
   public :: foreign_card, foreign_parameter, foreign_value, foreign_field

   character(*), parameter :: no_time = 'not available: the analysis is static'
   character(*), parameter :: no_output = 'here *FIELD OUTPUT stores fields in the result file, and *MONITOR makes '// &
      'columns of the listing'
   character(*), parameter :: no_amplitude = 'not available: loads of a step grow with the load factor, from 0'
   character(*), parameter :: plane = 'not available: rods lie in the plane of x and y'
   character(*), parameter :: elastic_only = 'not available: rods are elastic'
   character(*), parameter :: one_structure = 'not needed: a deck is one structure, and its nodes and '// &
      'elements stand in the model part'

contains

   !> Equivalent of a foreign keyword; '' if the keyword is unknown.
   pure function foreign_card(keyword) result(answer)
      character(*), intent(in) :: keyword !! keyword without the star; case and blanks do not matter
      character(:), allocatable :: answer
      answer = ''
      call take(answer, keyword, 'PART|END PART|ASSEMBLY|END ASSEMBLY|INSTANCE|END INSTANCE', one_structure)
      call take(answer, keyword, 'SURFACE|RIGID SURFACE', 'here *OBSTACLE is what nodes may touch, and *CONTACT names the nodes')
      call take(answer, keyword, 'CONTACT PAIR|CONTACT INCLUSIONS|CONTACT PROPERTY ASSIGNMENT|SURFACE INTERACTION', 'here '// &
         '*OBSTACLE and *CONTACT, OBSTACLE=..., NSET=...')
      call take(answer, keyword, 'SURFACE BEHAVIOR', 'here FOUNDATION=WINKLER or FOUNDATION=LAW on *OBSTACLE; without it '// &
         'contact is rigid')
      call take(answer, keyword, 'FRICTION|CHANGE FRICTION', 'not available: contact is without friction')
      call take(answer, keyword, 'CLEARANCE', 'here GAP on *CONTACT')
      call take(answer, keyword, 'FOUNDATION', 'here *OBSTACLE with FOUNDATION=WINKLER, LAW, PASTERNAK or HALF SPACE, and *CONTACT')
      call take(answer, keyword, 'PLASTIC|CYCLIC HARDENING|HYPERELASTIC|HYPERFOAM|CREEP|VISCOELASTIC|DAMAGE INITIATION|DAMAGE '// &
         'EVOLUTION|DEFORMATION PLASTICITY|USER MATERIAL|DEPVAR', elastic_only)
      call take(answer, keyword, 'DAMPING|CONDUCTIVITY|SPECIFIC HEAT', no_time)
      call take(answer, keyword, 'BEAM GENERAL SECTION', 'here *BEAM SECTION with SECTION=GENERAL (A, I) or SECTION=STIFFNESS '// &
         '(EA, EI)')
      call take(answer, keyword, 'TRANSVERSE SHEAR STIFFNESS|TRANSVERSE SHEAR', 'here SHEAR=FLEXIBLE, or GA, on *BEAM SECTION')
      call take(answer, keyword, 'SOLID SECTION|SHELL SECTION|MEMBRANE SECTION|CONNECTOR SECTION|COHESIVE SECTION', 'not '// &
         'available: elements are rods, with *BEAM SECTION')
      call take(answer, keyword, 'NODE PRINT|NODE FILE|NODE OUTPUT|EL PRINT|EL FILE|ELEMENT OUTPUT|CONTACT OUTPUT|CONTACT '// &
         'FILE|OUTPUT|PRINT|HISTORY OUTPUT|ENERGY OUTPUT|FILE FORMAT|TIME POINTS|MONITOR NODE', no_output)
      call take(answer, keyword, 'RESTART|NO PRINT|PREPRINT', 'not available; *FIELD OUTPUT says what is stored')
      call take(answer, keyword, 'DYNAMIC|MODAL DYNAMIC|FREQUENCY|COMPLEX FREQUENCY|STEADY STATE DYNAMICS|RANDOM '// &
         'RESPONSE|VISCO|HEAT TRANSFER|COUPLED TEMPERATURE-DISPLACEMENT|UNCOUPLED TEMPERATURE-DISPLACEMENT', no_time)
      call take(answer, keyword, 'AMPLITUDE', no_amplitude)
      call take(answer, keyword, 'INITIAL CONDITIONS', 'not available: the model part is stress-free; *TEMPERATURE and '// &
         '*OBSTACLE MOTION act in steps')
      call take(answer, keyword, 'NGEN|NFILL|ELGEN|NCOPY|ELCOPY', 'here *LINE, *ARC and others make rows of nodes and '// &
         & 'elements')
      call take(answer, keyword, 'COUPLING|KINEMATIC|DISTRIBUTING|RIGID BODY', 'here *MPC, TYPE=BEAM')
      call take(answer, keyword, 'TIE', 'here *MPC, TYPE=TIE')
      call take(answer, keyword, 'CONNECTOR BEHAVIOR|CONNECTOR ELASTICITY|JOINT|DASHPOT', 'here *RELEASE, *MPC and *SPRING')
      call take(answer, keyword, 'DSLOAD|DFLUX|FILM|RADIATE', 'here *DLOAD, and *TEMPERATURE for heat')
      call take(answer, keyword, 'TRANSFORM|ORIENTATION|SYSTEM', 'not available: x and y are the same everywhere')
      call take(answer, keyword, 'MODEL CHANGE', 'not available: elements and contacts stay for the whole deck')
      call take(answer, keyword, 'STATIC RIKS|RIKS', 'here *STATIC: METHOD=CYLINDRICAL, its default, follows the arc length')
      call take(answer, keyword, 'USER ELEMENT|MATRIX INPUT|SUBSTRUCTURE PROPERTY|SUPER ELEMENT', 'not available')
   end function foreign_card

   !> Equivalent of a foreign parameter of a card; '' if the parameter is unknown.
   pure function foreign_parameter(keyword, name) result(answer)
      character(*), intent(in) :: keyword !! keyword of the card, as in the card table
      character(*), intent(in) :: name    !! name of the parameter; case and blanks do not matter
      character(:), allocatable :: answer
      answer = ''
      call take_of(answer, keyword, name, '', 'OP', 'not available: what earlier steps have applied stays, and each step adds '// &
         'to it')
      call take_of(answer, keyword, name, '', 'AMPLITUDE', no_amplitude)
      call take_of(answer, keyword, name, '', 'INSTANCE|INTERNAL', one_structure)
      call take_of(answer, keyword, name, '', 'UNSORTED', 'not needed: sets keep the order of their lines')
      call take_of(answer, keyword, name, '', 'INPUT', 'here *INCLUDE, FILE=...')
      call take_of(answer, keyword, name, '', 'ORIENTATION|SYSTEM', 'not available: x and y are the same everywhere')
      call take_of(answer, keyword, name, 'STEP', 'NLGEOM', 'not needed: displacements and rotations are large in every step')
      call take_of(answer, keyword, name, 'STEP', 'INC', 'here POINTS on *CONTROLS')
      call take_of(answer, keyword, name, 'STEP', 'PERTURBATION', 'not needed: *BUCKLE is a linear step by itself')
      call take_of(answer, keyword, name, 'STEP', 'UNSYMM|AMPLITUDE|EXTRAPOLATION|CONVERT SDI', 'not needed')
      call take_of(answer, keyword, name, 'STATIC', 'RIKS', 'here METHOD=CYLINDRICAL, the default, or SPHERICAL and others, '// &
         'which follow the arc length')
      call take_of(answer, keyword, name, 'STATIC', 'STABILIZE', 'not available; arc-length METHODs pass limit points')
      call take_of(answer, keyword, name, 'STATIC', 'DIRECT|FULLY PLASTIC|SOLVER|TIME RESET', 'not available; the data line '// &
         'bounds the increments')
      call take_of(answer, keyword, name, 'BUCKLE', 'EIGENSOLVER|SOLVER', 'not needed')
      call take_of(answer, keyword, name, 'FIELD OUTPUT', 'FREQUENCY|NUMBER INTERVAL|TIME INTERVAL|VARIABLE', 'here EVERY, at '// &
         'every n-th point')
      call take_of(answer, keyword, name, 'ELASTIC', 'TYPE|MODULI', 'not needed: E and nu stand on the data line')
      call take_of(answer, keyword, name, 'EXPANSION', 'ZERO|TYPE', 'not needed: alpha stands on the data line')
      call take_of(answer, keyword, name, 'BEAM SECTION', 'POISSON', 'here nu on *ELASTIC')
      call take_of(answer, keyword, name, 'BEAM SECTION', 'TEMPERATURE|ROTARY INERTIA|OFFSET1|OFFSET2|CENTROID', 'not available')
      call take_of(answer, keyword, name, 'IMPERFECTION', 'FILE', 'here SHAPE=MODE with STEP, in a step behind that with *BUCKLE')
      call take_of(answer, keyword, name, 'CONTACT', 'INTERACTION|TYPE|SMALL SLIDING|ADJUST', 'here OBSTACLE, NSET, and '// &
         'FOUNDATION on *OBSTACLE')
   end function foreign_parameter

   !> Equivalent of a foreign value of a parameter or field; '' if the value is unknown.
   pure function foreign_value(name, typed) result(answer)
      character(*), intent(in) :: name    !! name of the parameter or field, as in the card table
      character(*), intent(in) :: typed   !! the value; case and blanks do not matter
      character(:), allocatable :: answer
      answer = ''
      call take_of(answer, name, typed, 'TYPE', &
         'B21|B22|B23|B21H|B22H|B23H|B31|B32|B33|B31H|B32H|B33H|B31OS|B32OS|PIPE21|PIPE22|PIPE31|PIPE32|B31R|B32R', 'for beams '// &
         'here GE8, which is geometrically exact, in the plane')
      call take_of(answer, name, typed, 'TYPE', 'T2D2|T2D3|T3D2|T3D3', 'for trusses here GE8, with *RELEASE or *MPC, TYPE=PIN '// &
         'at its ends')
      call take_of(answer, name, typed, 'TYPE', &
         'S3|S3R|S4|S4R|S8R|C3D4|C3D8|C3D8R|C3D10|C3D20|C3D20R|CPS3|CPS4|CPS4R|CPS8|CPE4|CPE4R|CPE8|CAX4|CAX4R|CAX8', 'shells '// &
         'and solids are not available: elements are rods')
      call take_of(answer, name, typed, 'TYPE', 'SPRING1|SPRING2|SPRINGA|CONN2D2|DASHPOTA', 'here *SPRING')
      call take_of(answer, name, typed, 'TYPE', 'GAPUNI|ITSUNI', 'here *GAP')
      call take_of(answer, name, typed, 'TYPE', 'SLIDER|REVOLUTE|UNIVERSAL|STRAIGHT|PLANE', 'not available; *EQUATION and *MPC '// &
         'tie nodes')
      call take_of(answer, name, typed, 'METHOD', 'RIKS|ARC LENGTH|CRISFIELD|ARCLENGTH', 'here CYLINDRICAL, the default')
      call take_of(answer, name, typed, 'SECTION', 'BOX|I|L|T|HEX|TRAPEZOID|ARBITRARY|CHANNEL|THICK PIPE', 'here GENERAL, with '// &
         'A and I')
      call take_of(answer, name, typed, 'field', 'U|UR|U1|U2|COORD|PU', 'here DISPLACEMENT')
      call take_of(answer, name, typed, 'field', 'SF|SM|SF1|SM1|ESF1|S|MISES', 'here SECTION FORCES; stresses are not available')
      call take_of(answer, name, typed, 'field', 'RF|RM|RF1|RF2|RT', 'of supports here *MONITOR with RF1, RF2, RM; of contact '// &
         'REACTION')
      call take_of(answer, name, typed, 'field', 'CF|CM|TF', 'not available: loads are those of the deck times the load factor')
      call take_of(answer, name, typed, 'field', 'CSTRESS|CPRESS|CFORCE|CNORMF|CDIS|CSTR', 'here REACTION')
      call take_of(answer, name, typed, 'field', 'COPEN|CDISP', 'here GAP')
      call take_of(answer, name, typed, 'field', 'E|LE|PE|PEEQ|SE|SK|ENER|ALLSE|NT', 'not available')
      call take_of(answer, name, typed, 'quantity', 'U|RF', 'here with the direction: U1, U2, RF1, RF2')
      call take_of(answer, name, typed, 'quantity', 'UR3|U6', 'here UR')
      call take_of(answer, name, typed, 'quantity', 'RM3|RF6', 'here RM')
      call take_of(answer, name, typed, 'quantity', 'U3|RF3', plane)
      call take_of(answer, name, typed, 'type', 'P1|P2|PZ|P1NU|P2NU|BX|BY', 'here PX, PY or P')
      call take_of(answer, name, typed, 'dof', 'ZSYMM|XASYMM|YASYMM|ZASYMM', plane)
   end function foreign_value

   !> Message about a field that a data line has in Abaqus but not here; '' if there is none.
   pure function foreign_field(keyword, field) result(answer)
      character(*), intent(in) :: keyword !! keyword of the card, as in the card table
      integer, intent(in) :: field        !! number of the field on the line
      character(:), allocatable :: answer
      answer = ''
      if (keyword == 'NODE' .and. field == 4) answer = 'a third coordinate is '//plane
   end function foreign_field

   !> Sets the answer if a word is one of a list.
   pure subroutine take(answer, typed, words, why)
      character(:), allocatable, intent(inout) :: answer
      character(*), intent(in) :: typed
      character(*), intent(in) :: words, why         !! list of words, separated by bars, and its answer
      if (word_index(words, typed) > 0) answer = why
   end subroutine take

   !> Sets the answer if a word is one of a list and is used at the given place.
   pure subroutine take_of(answer, place, typed, of, words, why)
      character(:), allocatable, intent(inout) :: answer
      character(*), intent(in) :: place, typed       !! card, parameter or field, and the word given there
      character(*), intent(in) :: of, words, why     !! place of the words; '': any
      if (of == '' .or. of == place) call take(answer, typed, words, why)
   end subroutine take_of
end module foreign_words

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
      call take('PART|END PART|ASSEMBLY|END ASSEMBLY|INSTANCE|END INSTANCE', one_structure)
      call take('SURFACE|RIGID SURFACE', 'here *OBSTACLE is what nodes may touch, and *CONTACT names the nodes')
      call take('CONTACT PAIR|CONTACT INCLUSIONS|CONTACT PROPERTY ASSIGNMENT|SURFACE INTERACTION', 'here *OBSTACLE and '// &
         '*CONTACT, OBSTACLE=..., NSET=...')
      call take('SURFACE BEHAVIOR', 'here FOUNDATION=WINKLER or FOUNDATION=LAW on *OBSTACLE; without it contact is rigid')
      call take('FRICTION|CHANGE FRICTION', 'not available: contact is without friction')
      call take('CLEARANCE', 'here GAP on *CONTACT')
      call take('FOUNDATION', 'here *OBSTACLE with FOUNDATION=WINKLER, LAW, PASTERNAK or HALF SPACE, and *CONTACT')
      call take('PLASTIC|CYCLIC HARDENING|HYPERELASTIC|HYPERFOAM|CREEP|VISCOELASTIC|DAMAGE INITIATION|DAMAGE '// &
         'EVOLUTION|DEFORMATION PLASTICITY|USER MATERIAL|DEPVAR', elastic_only)
      call take('DAMPING|CONDUCTIVITY|SPECIFIC HEAT', no_time)
      call take('BEAM GENERAL SECTION', 'here *BEAM SECTION with SECTION=GENERAL (A, I) or SECTION=STIFFNESS (EA, EI)')
      call take('TRANSVERSE SHEAR STIFFNESS|TRANSVERSE SHEAR', 'here SHEAR=FLEXIBLE, or GA, on *BEAM SECTION')
      call take('SOLID SECTION|SHELL SECTION|MEMBRANE SECTION|CONNECTOR SECTION|COHESIVE SECTION', 'not available: elements '// &
         'are rods, with *BEAM SECTION')
      call take('NODE PRINT|NODE FILE|NODE OUTPUT|EL PRINT|EL FILE|ELEMENT OUTPUT|CONTACT OUTPUT|CONTACT '// &
         'FILE|OUTPUT|PRINT|HISTORY OUTPUT|ENERGY OUTPUT|FILE FORMAT|TIME POINTS|MONITOR NODE', no_output)
      call take('RESTART|NO PRINT|PREPRINT', 'not available; *FIELD OUTPUT says what is stored')
      call take('DYNAMIC|MODAL DYNAMIC|FREQUENCY|COMPLEX FREQUENCY|STEADY STATE DYNAMICS|RANDOM RESPONSE|VISCO|HEAT '// &
         'TRANSFER|COUPLED TEMPERATURE-DISPLACEMENT|UNCOUPLED TEMPERATURE-DISPLACEMENT', no_time)
      call take('AMPLITUDE', no_amplitude)
      call take('INITIAL CONDITIONS', 'not available: the model part is stress-free; *TEMPERATURE and *OBSTACLE MOTION act in '// &
         'steps')
      call take('NGEN|NFILL|ELGEN|NCOPY|ELCOPY', 'here *LINE, *ARC and others make rows of nodes and elements')
      call take('COUPLING|KINEMATIC|DISTRIBUTING|RIGID BODY', 'here *MPC, TYPE=BEAM')
      call take('TIE', 'here *MPC, TYPE=TIE')
      call take('CONNECTOR BEHAVIOR|CONNECTOR ELASTICITY|JOINT|DASHPOT', 'here *RELEASE, *MPC and *SPRING')
      call take('DSLOAD|DFLUX|FILM|RADIATE', 'here *DLOAD, and *TEMPERATURE for heat')
      call take('TRANSFORM|ORIENTATION|SYSTEM', 'not available: x and y are the same everywhere')
      call take('MODEL CHANGE', 'not available: elements and contacts stay for the whole deck')
      call take('STATIC RIKS|RIKS', 'here *STATIC: METHOD=CYLINDRICAL, its default, follows the arc length')
      call take('USER ELEMENT|MATRIX INPUT|SUBSTRUCTURE PROPERTY|SUPER ELEMENT', 'not available')

   contains

      !> Sets the answer if the keyword is one of a list.
      pure subroutine take(words, why)
         character(*), intent(in) :: words, why      !! list of words, separated by bars, and its answer
         if (word_index(words, keyword) > 0) answer = why
      end subroutine take
   end function foreign_card

   !> Equivalent of a foreign parameter of a card; '' if the parameter is unknown.
   pure function foreign_parameter(keyword, name) result(answer)
      character(*), intent(in) :: keyword !! keyword of the card, as in the card table
      character(*), intent(in) :: name    !! name of the parameter; case and blanks do not matter
      character(:), allocatable :: answer
      answer = ''
      call take('', 'OP', 'not available: what earlier steps have applied stays, and each step adds to it')
      call take('', 'AMPLITUDE', no_amplitude)
      call take('', 'INSTANCE|INTERNAL', one_structure)
      call take('', 'UNSORTED', 'not needed: sets keep the order of their lines')
      call take('', 'INPUT', 'here *INCLUDE, FILE=...')
      call take('', 'ORIENTATION|SYSTEM', 'not available: x and y are the same everywhere')
      call take('STEP', 'NLGEOM', 'not needed: displacements and rotations are large in every step')
      call take('STEP', 'INC', 'here POINTS on *CONTROLS')
      call take('STEP', 'PERTURBATION', 'not needed: *BUCKLE is a linear step by itself')
      call take('STEP', 'UNSYMM|AMPLITUDE|EXTRAPOLATION|CONVERT SDI', 'not needed')
      call take('STATIC', 'RIKS', 'here METHOD=CYLINDRICAL, the default, or SPHERICAL and others, which follow the arc length')
      call take('STATIC', 'STABILIZE', 'not available; arc-length METHODs pass limit points')
      call take('STATIC', 'DIRECT|FULLY PLASTIC|SOLVER|TIME RESET', 'not available; the data line bounds the increments')
      call take('BUCKLE', 'EIGENSOLVER|SOLVER', 'not needed')
      call take('FIELD OUTPUT', 'FREQUENCY|NUMBER INTERVAL|TIME INTERVAL|VARIABLE', 'here EVERY, at every n-th point')
      call take('ELASTIC', 'TYPE|MODULI', 'not needed: E and nu stand on the data line')
      call take('EXPANSION', 'ZERO|TYPE', 'not needed: alpha stands on the data line')
      call take('BEAM SECTION', 'POISSON', 'here nu on *ELASTIC')
      call take('BEAM SECTION', 'TEMPERATURE|ROTARY INERTIA|OFFSET1|OFFSET2|CENTROID', 'not available')
      call take('IMPERFECTION', 'FILE', 'here SHAPE=MODE with STEP, in a step behind that with *BUCKLE')
      call take('CONTACT', 'INTERACTION|TYPE|SMALL SLIDING|ADJUST', 'here OBSTACLE, NSET, and FOUNDATION on *OBSTACLE')

   contains

      !> Sets the answer if the name is one of a list and stands on a card.
      pure subroutine take(of, words, why)
         character(*), intent(in) :: of, words, why  !! keyword of the card; '': any
         if ((of == '' .or. of == keyword) .and. word_index(words, name) > 0) answer = why
      end subroutine take
   end function foreign_parameter

   !> Equivalent of a foreign value of a parameter or field; '' if the value is unknown.
   pure function foreign_value(name, typed) result(answer)
      character(*), intent(in) :: name    !! name of the parameter or field, as in the card table
      character(*), intent(in) :: typed   !! the value; case and blanks do not matter
      character(:), allocatable :: answer
      answer = ''
      call take('TYPE', &
         'B21|B22|B23|B21H|B22H|B23H|B31|B32|B33|B31H|B32H|B33H|B31OS|B32OS|PIPE21|PIPE22|PIPE31|PIPE32|B31R|B32R', 'for '// &
         'beams here GE8, which is geometrically exact, in the plane')
      call take('TYPE', 'T2D2|T2D3|T3D2|T3D3', 'for trusses here GE8, with *RELEASE or *MPC, TYPE=PIN at its ends')
      call take('TYPE', &
         'S3|S3R|S4|S4R|S8R|C3D4|C3D8|C3D8R|C3D10|C3D20|C3D20R|CPS3|CPS4|CPS4R|CPS8|CPE4|CPE4R|CPE8|CAX4|CAX4R|CAX8', 'shells '// &
         'and solids are not available: elements are rods')
      call take('TYPE', 'SPRING1|SPRING2|SPRINGA|CONN2D2|DASHPOTA', 'here *SPRING')
      call take('TYPE', 'GAPUNI|ITSUNI', 'here *GAP')
      call take('TYPE', 'SLIDER|REVOLUTE|UNIVERSAL|STRAIGHT|PLANE', 'not available; *EQUATION and *MPC tie nodes')
      call take('METHOD', 'RIKS|ARC LENGTH|CRISFIELD|ARCLENGTH', 'here CYLINDRICAL, the default')
      call take('SECTION', 'BOX|I|L|T|HEX|TRAPEZOID|ARBITRARY|CHANNEL|THICK PIPE', 'here GENERAL, with A and I')
      call take('field', 'U|UR|U1|U2|COORD|PU', 'here DISPLACEMENT')
      call take('field', 'SF|SM|SF1|SM1|ESF1|S|MISES', 'here SECTION FORCES; stresses are not available')
      call take('field', 'RF|RM|RF1|RF2|RT', 'of supports here *MONITOR with RF1, RF2, RM; of contact REACTION')
      call take('field', 'CF|CM|TF', 'not available: loads are those of the deck times the load factor')
      call take('field', 'CSTRESS|CPRESS|CFORCE|CNORMF|CDIS|CSTR', 'here REACTION')
      call take('field', 'COPEN|CDISP', 'here GAP')
      call take('field', 'E|LE|PE|PEEQ|SE|SK|ENER|ALLSE|NT', 'not available')
      call take('quantity', 'U|RF', 'here with the direction: U1, U2, RF1, RF2')
      call take('quantity', 'UR3|U6', 'here UR')
      call take('quantity', 'RM3|RF6', 'here RM')
      call take('quantity', 'U3|RF3', plane)
      call take('type', 'P1|P2|PZ|P1NU|P2NU|BX|BY', 'here PX, PY or P')
      call take('dof', 'ZSYMM|XASYMM|YASYMM|ZASYMM', plane)

   contains

      !> Sets the answer if the value is one of a list and belongs to a parameter or field.
      pure subroutine take(of, words, why)
         character(*), intent(in) :: of, words, why  !! its name
         if (of == name .and. word_index(words, typed) > 0) answer = why
      end subroutine take
   end function foreign_value

   !> Message about a field that a data line has in Abaqus but not here; '' if there is none.
   pure function foreign_field(keyword, field) result(answer)
      character(*), intent(in) :: keyword !! keyword of the card, as in the card table
      integer, intent(in) :: field        !! number of the field on the line
      character(:), allocatable :: answer
      answer = ''
      if (keyword == 'NODE' .and. field == 4) answer = 'a third coordinate is '//plane
   end function foreign_field

end module foreign_words

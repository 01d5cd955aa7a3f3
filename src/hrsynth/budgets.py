"""Work limits and size limits: counts, step lengths, times.

Tolerances of comparisons are in :mod:`tolerances`.
"""

# Mechanisms, poses, files

MODEL_COORDINATES_MAX = 256
"""Coordinates above which a mechanism is refused: Pinocchio's data hold several cubes of their number."""
INCIDENCE_SAMPLES_COUNT = 2
"""Samples besides the first at which an incidence must hold to count as structural."""
GRID_CELLS_MAX = 100_000
"""Largest number of cells of a grid of poses; more is taken for a mistake."""
POSE_VALUE_MAX = 1e9
"""Largest coordinate of a pose (metres, radians); beyond it numbers cannot separate nearby poses."""
JOINT_VALUE_MAX = 100.0
"""Largest joint value (metres, radians) of a request; paths to it use small steps."""
CHARACTERISTIC_LENGTH_MAX_M = 20.0
"""Characteristic length (m) above which lint suspects millimetres."""
FILE_NUMBER_MAX = 1e9
"""Largest magnitude of a number that a robot file may hold (metres, radians)."""
ROBOT_FILE_MAX_BYTES = 20_000_000
"""Bytes above which a robot file is not read at all."""
XML_ELEMENTS_MAX = 100_000
"""Elements above which an XML document is not parsed."""
XML_ELEMENT_NAMES_MAX = 1000
"""Different names of elements above which an XML document is refused: the largest format, MJCF, has 150."""
XML_UNKNOWN_NAMES_MAX = 300
"""Different names that a format does not have from which on a document is refused."""
XML_ATTRIBUTES_MAX = 200
"""Attributes of an element above which an XML document is refused: the most in any format are 50."""
XML_REPARSES_MAX = 16
"""Number of times a document is parsed again without the construct that stopped the parser."""
FOREIGN_FILE_LINKS_MAX = 1000
"""Links above which a foreign file is refused."""
INCLUDED_FILES_MAX = 50
"""Files that an MJCF model may include, layers of a USD stage."""
NESTED_MODELS_MAX = 20
"""Models in models above which an SDFormat file is refused."""
XACRO_TIMEOUT_S = 4
"""Seconds after which expanding a xacro file is given up."""
UNPACKED_MAX_BYTES = 200_000_000
"""Largest unpacked size of a file, an archive or a robot's meshes (bytes)."""
ARCHIVE_FILES_MAX = 1000
"""Files that an archive may hold."""
PROCESS_BYTES = 1_700_000_000
"""Address space of a process that reads an untrusted file (bytes)."""
USD_SECONDS, MESH_SECONDS = 10, 15
"""Time limit of one core for a USD stage, and for the meshes of a robot (s); three times as much by the clock."""
VERIFY_TIMEOUT_S = 40
"""Seconds of one core after which checking a certificate file is given up."""
MESH_FILES_MAX = 2000
"""Largest number of mesh files copied with a robot."""
MESH_FILES_MAX_BYTES = 500_000_000
"""Largest total size of these mesh files (bytes)."""
LOOP_COORDINATES_MAX = 240
"""Coordinates of joints in loops above which the loops of a foreign file are not solved."""
CHARACTERISTIC_LENGTH_MIN_M = 1e-3
"""Characteristic length (m) below which lint doubts that a file is in metres."""
INERTIA_BODY_WIDTH_MAX = 20.0
"""Characteristic lengths that the body of an inertia may be wide."""
LINT_RANK_SAMPLES_COUNT = 3
"""Configurations near zero at which a rank must agree before lint reports it."""
CENTRE_ALIGNMENT_STEPS_MAX = 300
"""Largest number of steps that align revolute joint centres of two files along their axes."""
AXIS_SENSE_CHOICES_MAX = 6
"""Axes of a link up to which all signs in the other file are tried."""
LINT_FIX_ROUNDS_MAX = 8
"""Largest number of passes of lint --fix."""
LOOP_ASSEMBLY_STEP_MAX = 0.4
"""Largest change of a coordinate per step of the loop solver (characteristic lengths, radians)."""
LOOP_ASSEMBLY_VISITS_MAX = 100_000
"""Work limit of the loop solver in joint visits (some seconds)."""
LOOP_ASSEMBLY_TRIES_MAX = 24
"""Random restarts of the loop solver."""
FIXED_JOINT_TRIES_COUNT = 4
"""Restarts with motors, or joints at their limits, locked."""
SINGULAR_STEPS = (0.1, 0.2, 0.3, 0.45, 0.6, 0.8, 1.0)
"""Steps (radians, characteristic lengths) that leave a singular zero configuration; the first that does is used."""
SPECIAL_ZERO_SAMPLES_COUNT = 4
"""Nearby configurations that must agree before a zero configuration is called special."""
FIRMER_ZERO_MIN_FRACTION = 2.0
"""Factor by which another configuration must be less singular to replace a nearly singular zero."""
LINK_INCIDENCE_JOINTS_MAX = 40
"""Joints of one link above which their incidences are not searched."""
LINKAGE_STARTS_COUNT = 200
"""Random starts from which a linkage is closed."""
CLOSURE_CANDIDATES_MAX = 12
"""Largest number of frame pairs reported as possible closures."""
FILE_DEFECTS_MAX = 100
"""Number of defects after which a file is not read further."""
MOST_BESIDE, LARGEST_BESIDE = 50, 3_000_000
"""Number of sibling files of a kind, and their total size (bytes), above which none is read."""
YAML_FILE_MAX_BYTES = 1_000_000
"""Bytes of a YAML file above which it is not read."""
PLATFORM_GUESS_BODIES_MAX = 150
"""Links of a foreign file above which the platform is not assumed from path lengths."""
TOLERANCE_HALVINGS_MAX = 5
"""Halvings of the snapping tolerance while relations contradict each other."""
ROUNDED_DECIMALS_MIN = 3
"""Decimals from which a file's numbers can be rounded; with fewer they are typed."""
ROUNDED_NUMBERS_MIN_COUNT = 5
"""Number of such numbers that shows the rounding of a file."""
SURELY_ROUNDED_DECIMALS_MIN = 4
"""Decimals from which numbers are rounded in any case."""
ROUNDED_DECIMALS_MAX = 11
"""Decimals up to which numbers can be rounded."""
FILE_INCIDENCE_JOINTS_MAX = 120
"""Joints of a foreign file above which rounded incidences are not searched."""

# Ways to a pose

POSE_PATH_STEP_MAX = 0.3
"""Largest change of a coordinate per step on the path to a pose (characteristic lengths, radians)."""
LEG_CLOSURE_ITERATIONS_MAX = 400
"""Largest number of iterations that close a leg at a pose."""
RETRACE_ITERATIONS_MAX = 10
"""Iterations within which a retraced sample must close; more indicate a fold."""
FIRST_GRID_CELLS_COUNT = 40
"""Nearest cells of a grid that are tried from zero before it counts as unreachable."""
SWEEP_STEP_HALVINGS_MAX = 4
"""Halvings of a step in a sweep that can reach a pose from several neighbours."""
TANGENT_CHART_RADIUS_MAX = 0.5
"""Length of tangent chart coordinates (characteristic lengths, radians) that starts a new chart."""
SLIDER_RANGE_FRACTION = 0.98
"""Fraction of the travel of a slider of the view that is used."""

# Many poses at once

CHAIN_CLOSURE_STEP_MAX = 0.5
"""Longest step of a link of a chain closed in a batch (characteristic lengths, radians)."""
CHAIN_CLOSURE_STEPS_COUNT = 4
"""Steps of such a chain at each waypoint."""
LARGEST_BATCH = 1 << 29
"""Largest result of one evaluation (bytes); larger ones are evaluated in parts (``Batch.sweep``)."""
DIRECTION_RATE_GROWTH_MAX = 20.0
"""Largest ratio of direction rates to those at zero on a walk of poses in a batch."""
NUMBA_POSES_MIN = 20_000
"""Poses of a batch from which compiled kernels are worth numba's start (half a second) in a run with many batches."""
NUMBA_SINGLE_BATCH_POSES_MIN = 500_000
"""Poses of a single batch from which compiled kernels are faster."""
NUMBA_COMPILE_POSES_MIN = 5_000_000
"""Poses from which compiling a robot's kernels with numba is faster."""
ERROR_FIELD_CELLS_MAX = 10_000_000
"""Largest number of grid cells with errors in memory: 160 MB."""
ERROR_SWEEP_CELLS_MAX = 10_000_000_000
"""Largest number of grid cells with errors in a file: 160 GB and some hours."""
SWEEP_PART = 1 << 16
"""Poses of a sweep evaluated at a time."""
ERROR_SWEEP_SAMPLES_COUNT = 10_000
"""Random poses of a sweep among which those are chosen that are compared with Pinocchio."""

# Singularities, paths, modes

WEAKEST_POSE_STARTS_COUNT = 8
"""Further starts, the poses of smallest singular value, of walks that cross no singularity."""
RANK_DESCENTS, RANK_STEPS = 6, 40
"""Poses from which the smallest singular value is minimised, and steps of each."""
COARSE_GRID_SIDE_COUNT = 25
"""Poses per side of the grid that finds the reach in a plane."""
BOUNDARY_REFINEMENT_COUNT = 4
"""Refinement of the border of that grid."""
LOCUS_SIDES = (2.5, 5.0)
"""Half-sides of that grid (characteristic lengths); the second if the robot reaches the border of the first."""
SINGULAR_NEIGHBOUR_STEP_M = 0.01
"""Distance of the neighbours of a singular pose (m)."""
VALLEY_NARROWING_FRACTION = 0.5
"""Fraction of its reach that the search in a valley keeps per step."""
LINE_VALLEYS_MAX = 600
"""Largest number of valleys searched along lines."""
PLANE_VALLEYS_MAX = 12
"""Largest number of valleys searched in the plane."""
PATH_FIRST_INTERVALS_COUNT = 4
"""Initial number of intervals of a path that is to be proved free of singularities."""
FINEST_INTERVAL = 2.0**-16
"""Smallest interval (fraction of its path) of such a proof."""
ASPECTS_INTERVALS_MAX = 60_000
"""Largest number of intervals for all paths of the command aspects."""
SLICE_GRID_STEPS_COUNT = 90
"""Crank and platform angles at which the singular curve of a section is searched."""
SLICE_CURVE_STEP_FRACTION = 0.03
"""Step along that curve (characteristic lengths, components of unit vectors)."""
SLICE_NEWTON_STEPS_MAX = 30
"""Newton steps on that curve."""
SLICE_CURVE_STEPS_MAX = 4000
"""Largest number of steps along one piece of it."""
SLICE_CURVE_DISTANCE_TOL = 0.1
"""Distance from a known piece below which no new one is searched, and between points with one image."""
ROADMAP_REGION_FRACTION = 1.5
"""Enlargement of the region of the known poses from which a roadmap is sampled."""
HOMOTOPY_ROUNDS_MAX = 3
"""Largest number of rounds of a homotopy, each on other paths."""
HOMOTOPY_PATH_STEPS_MAX = 400
"""Largest number of steps of a path."""
MODE_SEARCH_STARTS_MAX = 300
"""Largest number of random starts in a search of modes without equations."""
MODE_SEARCH_QUIET_STARTS_COUNT = 100
"""Closed starts without a new mode that end this search."""
MODE_SEARCH_ITERATIONS_MAX = 100
"""Iterations that close each start."""
NEAR_MODE_STEPS_MAX = 60
"""Steps from a candidate to a near mode."""
SEARCH_SELF_MOTIONS_MAX = 12
"""Largest number of self-motions followed by one search."""
SELF_MOTION_STEPS_MAX = 100
"""Steps of a self-motion in each direction."""
SELF_MOTION_STEP_HALVINGS_MAX = 6
"""Halvings of such a step."""
LEG_SOLUTION_CHOICES_MAX = 256
"""Largest number of combinations of leg solutions; beyond it the list of modes is not complete."""
MODES_TIME_LIMIT_S = 120.0
"""Default time limit of a list of modes (s of one core), compared with an estimate that no machine changes."""
ELIMINATION_SECONDS, HOMOTOPY_SECONDS, MSOLVE_SECONDS = 0.02, 0.4, 2.0
"""Estimated time of one system (s): exact resultant, forty paths, external program."""
LARGEST_FORMS, FORMS_SECONDS, FEW_FORMS_SECONDS = 1100, 46.0, 0.1
"""Largest number of forms of a degree in linear algebra, and estimated time (s) for that many, and for few."""
CAP_OF_MULTIPLES, LARGEST_MULTIPLES = 4, 250
"""Largest degree in a group of unknowns, and number of monomials, of a bound by multiples of quadrics."""
LARGEST_GEAR, LARGEST_LOOPS, PLANAR_STARTS, LOOP_SYSTEMS = 6, 120, 20, 3
"""Planar loops: largest numerator of a ratio, solutions searched, multiples of 64 random starts, choices of square
systems."""
JOINT_FORMS_MAX = 750
"""Largest number of forms of conditions on a leg's joints."""
QUATERNION_POWERS_MAX = 4
"""Powers of q · q tried to exclude extraneous solutions."""
FINEST_BOX = 2.0**-100
"""Radius of the smallest box around a solution, relative to 1 plus the unknown."""
LARGEST_RANDOM = 10**9
"""Range of random integers of rational instances, of either sign."""

BRANCH_CELLS_MAX = 1000
"""Largest number of cells of motor coordinates in the proof of a branch, per part of the loops."""
BRANCH_CELL_INDEX_HALVINGS_MAX = 40
"""Largest number of halvings of a side, limited by the integer cell index."""
BRANCH_BOX_WIDTH_MAX = 1000.0
"""Widest interval of a motor (radians, characteristic lengths) of a branch."""
BRANCH_CELL_DEPTH_MAX = 7
"""Largest number of halvings of a cell per motor."""
BRANCH_CELL_SIZE_FRACTION = 4.0
"""Largest cell tried, as a multiple of the largest one proved around zero."""
TUBE_RADII_COUNT = 4
"""Number of radii tried for a tube."""
TUBE_WIDENING_FRACTION = 1.2
"""Enlargement of a tube over its linear estimate."""
INJECTIVITY_CELLS_MAX = 256
"""Cells of all motors in the proof that the inverse map is unique."""
INJECTIVITY_TRIALS_MAX = 5000
"""Sets and pairs of cells tried in that proof."""
INJECTIVITY_BOXES_MAX = 12
"""Boxes tried for the inverse map, each 0.7 of the one before."""
INJECTIVITY_SIDE_STEPS_COUNT = 6
"""Enlargements of a side of such a box."""
FREE_MOTOR_VALUE_MAX = 1e6
"""Largest coordinate (m, rad) of a motor outside of all loops without limits."""

# Accuracy

BEST_FIT_FIRST_STEP_FRACTION = 0.25
"""First step along a best-fit curve, as a fraction of the direction error."""
BEST_FIT_SHORTEST_STEP = 2.0**-22
"""Smallest step along a best-fit curve, as a fraction of the error."""
BEST_FIT_STEPS_MAX = 200
"""Largest number of steps on one best-fit curve."""

# The loop and its camera

RUN_ESCAPE_DISTANCE_MAX = 20.0
"""Distance (characteristic lengths) from its start at which a platform has diverged."""
RUN_EVALUATIONS_MAX = 20_000
"""Largest number of configurations evaluated by the integrator in a servo run."""
FLOW_STARTS, FLOW_STARTS_ONE_BY_ONE = 100_000, 2_500
"""Largest number of starts, batched, and simulated one by one."""
FLOW_PART, FLOW_FEW, FLOW_SINGLE = 5_000, 2_000, 1
"""Starts per batch, last starts that continue together, and single runs per task of a process."""
FLOW_FOLLOWED, FLOW_CHECKED, FLOW_NAMED = 24, 6, 16
"""Runs of a batch that are simulated one by one because they stopped, as a check, and named equilibria."""
FLOW_EXAMPLES_MAX = 8
"""Starts with one end among which an example is chosen that is reached by small steps."""
FLOW_STEPS, FLOW_KEPT = 4_000, 4
"""Largest number of steps of batched runs, and steps that reuse the slopes of the law."""
RUN_DURATION_MAX_S = 10_000.0
"""Longest run (s) with noise, in dynamic simulation or along a path; these continue to their end."""
EQUILIBRIUM_STARTS_COUNT = 200
"""Starts of one round of the search of critical points."""
EQUILIBRIUM_ROUNDS_MAX = 12
"""Largest number of rounds for robots with many coordinates."""
EQUILIBRIUM_COORDINATES_MAX = 300
"""Sum of coordinates over all rounds up to which robots with few coordinates have more rounds."""
ENDING_DESCENTS, ENDING_LEAST = 3, 7
"""Least number of rounds when only stable equilibria are searched, and when all are."""
LATE_EQUILIBRIA_FRACTION = 0.005
"""Fraction of the critical points first found by the later half of the starts at which the search ends."""
LATE_STABLE_EQUILIBRIA_FRACTION = 0.02
"""The same fraction when only stable equilibria are searched."""
SELECT_EQUILIBRIUM_ROUNDS_COUNT = 4
"""Rounds for each set of legs of which the best is selected."""
EQUILIBRIUM_WALK_STEPS_COUNT = 6
"""Random steps along the loops between the starts of two rounds."""
EQUILIBRIUM_START_STEPS_MAX = 80
"""Steps of one start."""
EQUILIBRIUM_COORDINATE_MAX = 50.0
"""Coordinate (characteristic lengths, radians) beyond which a start stops."""
JOINT_ROUNDS_FRACTION = 0.17
"""Fraction of joint-space rounds that remains if critical poses are searched as well."""
POSE_STARTS, POSE_ROUNDS = 800, 60
"""Starts of one round of the search of critical poses with closed-form legs, and rounds per choice of locked legs."""
NEARBY_POSE_STARTS_FRACTION = 0.6
"""Fraction of these starts near poses found before."""
POSE_NEWTON_FRACTION = 0.5
"""Fraction of the latter that uses Newton's method throughout."""
POSE_DRAWS_PER_START_COUNT = 16
"""Largest ratio of poses drawn to poses in reach."""
POSE_LATE, POSE_QUIET = 0.001, 8
"""Fraction of the critical poses first found in the last rounds, and their number, at which the search ends."""
POSE_CONFIGURATIONS_MAX = 12
"""Nearest configurations from which one at a critical pose is searched."""
MIRRORED_RODS_MAX = 3
"""Largest number of rods sliding through a base point with both directions listed at each pose."""
VISIBLE_AXIS_MIN_FRACTION = 0.5
"""Fraction of a leg's axis that must be visible."""
EDGE_NOISE_PIXELS_MAX = 50.0
"""Largest error of an edge (pixels)."""
IMAGE_OVERSAMPLING_COUNT = 3
"""Rendered pixels per pixel and direction for edge detection."""

# The catalog

PARTS_PER_THREAD_COUNT = 3
"""Parts of a build waiting for each thread of a cluster."""
CATALOG_ENTRIES_MAX = 1_000_000
"""Largest number of lines of a compressed catalog file."""
CATALOG_LINE_CHARACTERS_MAX = 100_000
"""Largest line of the catalog, and text in a SQLite file (characters)."""
CATALOG_MAX_BYTES = 100_000_000
"""Largest unpacked size of the lines of a catalog (bytes)."""
CATALOG_JSON_PARTS_MAX = 7_000_000
"""Lists, objects and commas in all entries read, plus three per entry: each takes up to two hundred bytes."""
ARCHITECTURE_KEY_LEGS_MAX = 12
"""Largest number of legs of an architecture key."""

# What is remembered

CACHED_OBSERVED_ROBOTS_COUNT = 32
"""Observed robots kept in the cache."""
CACHED_LOCKED_LEGS_COUNT = 64
"""Locked legs kept in the cache for other sets of legs of one robot."""
CACHED_RESULTS_COUNT = 64
"""Results kept in the cache."""
CACHED_GRID_RESULTS_COUNT = 2
"""Results on grids and planes kept in the cache."""

# The page to work in

STUDIO_TABS_MAX = 8
"""Largest number of tabs served at once, with two processes each."""
STUDIO_CONNECTIONS_MAX = 100
"""Largest number of connections to the server."""
STUDIO_WAITING_REQUESTS_MAX = 64
"""Largest number of waiting requests of a tab."""
LARGEST_ASK = 256 * 1024
"""Largest message of the page (bytes)."""
LARGEST_ANSWER = 64 * 1024 * 1024
"""Largest reply to it (bytes)."""
UPLOAD_MAX_BYTES = 20_000_000
"""Largest file dropped into the page (bytes)."""
UPLOADED_FILES_MAX = 50
"""Largest number of files of a tab."""
FILE_NAME_MAX_BYTES = 200
"""Longest name of such a file (bytes)."""
MOVE_TIMEOUT_S = 10.0
"""Time limit of a move of the robot (s); its process then ends."""
REQUEST_TIMEOUT_S = 120.0
"""Time limit of any other request (s)."""
WORKER_START_TIMEOUT_S = 60.0
"""Time limit for the start of a process (s)."""
WORKER_BYTES = 4 * 1024**3
"""Address space of such a process (bytes)."""
SENDER_TIMEOUT_S = 10.0
"""Time limit for a request's head and each part of its body (s)."""
UPLOAD_TIMEOUT_S = 60.0
"""Time limit for a whole file (s)."""
SERVER_CLOSE_TIMEOUT_S = 2.0
"""Time that open connections have when the server ends (s)."""
STUDIO_NAME_CHARACTERS_MAX = 500
"""Longest name in a request of the studio (characters)."""
STUDIO_LIST_NAMES_MAX = 200
"""Longest list of names in a request."""
STUDIO_PLANE_SIDE_MAX = 101
"""Poses per side of a plane of the studio."""
STUDIO_SWEEP_SIDE_MAX = 16
"""Poses per side of a plane that is solved pose by pose."""
VIEW_TRACKING_ITERATIONS_MAX = 60
"""Iterations in which a hidden robot follows the real one in the view."""
DRAG_APPROACH_STEPS_COUNT = 8
"""Steps by which a dragged platform approaches its target after the straight path ends."""

# Generated programs

GENERATED_NEWTON_STEPS_MAX = 8
"""Largest number of Newton steps of generated code per part of the loops."""
BOUNDED_CELLS_BATCH_COUNT = 32
"""Cells of a branch whose steps are bounded together."""
BOUND_SIDE_HALVINGS_MAX = 3
"""Largest number of halvings of a cell for bounds."""
BOUND_CELL_PARTS_MAX = 64
"""Largest number of parts of one subdivision."""
BOUNDED_PARTS_COUNT = 2_000
"""Approximate number of parts of one size that are bounded."""
BOUNDED_SLOPES_COUNT = 20_000
"""Approximate number of slopes of such parts in generated code."""
GENERATED_INVERSE_STEPS_MAX = 20
"""Largest number of steps of generated code from motors to motors toward a pose."""
CONE_SLICES_MAX = 60_000
"""Largest number of slices of cones in the proof that the error rises along every ray from a goal."""
CONE_BATCH_COUNT = 2048
"""Cones whose next slice is tried together: those of the lowest levels."""
GOAL_RAYS_COUNT = 3000
"""Rays from a goal along which the rise of the error is found, not proved."""
ATTRACTION_RADIUS_BOXES_MAX = 60_000
"""Largest number of boxes in the proof of an attraction radius."""
INWARD_BOXES, RADIUS_AT_ONCE = 30_000, 2048
"""Largest number of boxes in the proof of a ball into which the flow points, and of boxes processed together."""
SUBDIVISION_BOXES_MAX = 8_000_000
"""Largest number of boxes of platform poses in the proof of all critical points."""
ZERO_ERROR_BOXES_MAX = 80_000
"""Largest number of boxes of poses of three dof in the proof of all zeros of the error; with more dof only on
request."""
REVERSED_LEG_CHOICES_MAX = 64
"""Largest number of choices of reversed legs reported one by one."""
BOX_STEPS_IN_NUMPY, BOXES_A_CALL = 40_000_000, 600
"""Operations on boxes done in NumPy before numba is started, and boxes that take as long as one call."""
SUBDIVISION_BATCH_COUNT = 4096
"""Boxes processed together."""
SERIAL_SUBDIVISION_BOXES_COUNT = 400_000
"""Boxes processed before the work is shared among processes."""
BOX_PARTS, BOXES_A_PART = 16, 200_000
"""Parts of shared work, and boxes of each before it is split again."""

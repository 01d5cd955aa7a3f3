"""Tolerances of comparisons, each with its meaning.

Lengths are made comparable with angles by a robot's *characteristic length* (the mean distance of its joint centres
from their centroid): a length divided by it is a pure number, as an angle is.
"""

# Closed configurations, and the way to a pose

ASSEMBLED = 1e-12
"""Residual (characteristic lengths, radians) below which a shipped or written file counts as assembled at zero."""
SOLVED = 1e-12
"""Closure residual (characteristic lengths, radians) at which the loop solver stops."""
STANDING = 1e-5
"""Relative decrease of a sum of squares below which least squares far from a zero stop."""
SHARP = 1e-15
"""Closure residual of singular poses that are needed to full precision."""
CLOSED = 1e-10
"""Residual (characteristic lengths, radians) below which a configuration counts as closed."""
MOTION_STEP = 0.1
"""Longest step (nv,) along a self-motion (characteristic lengths, radians)."""
MOTION_NEAR = 0.01
"""Length of random steps, closed again, that count the finite mobility; the closed set bends little over it."""
MOTION_BEND = 0.3
"""Largest correction of such a step as a fraction of it, and largest 1 - cosine between successive tangents."""
MOTION_FREE = 1e-3
"""Relative singular value of loops and measurements below which a self-motion is searched; following it decides."""
MOTION_LEAST = 0.2
"""Distance (characteristic lengths and radians) over which a self-motion must stay closed."""
PASSED_BY = 1e-3
"""Closure residual at which a waypoint counts as passed."""
AS_PRINTED = 1e-5
"""Difference (metres, radians; characteristic lengths) up to which a coordinate equals its printed value."""
HALF_TURN = 5e-7
"""Angle (radians) from -pi within which a rotation is printed as pi."""
NEAREST = 1e-10
"""Projected gradient (characteristic lengths, radians) at which a pose counts as the nearest one."""
FOLLOWED = 1e-9
"""Residual at which a hidden robot has the pose and directions of the real one."""
NO_NEARER = 1e-9
"""Smallest relative progress of a leg toward a goal over some steps; below it the leg stops."""
STEADY_TANGENT = 1e-10
"""Turn (radians) of the tangent space that the residual of a sample may cause."""
EASY_RANK = 1e-3
"""Relative singular value below which a direction is not used to bypass a blocked straight path."""
NEAR_FOLD = 1e-5
"""Relative singular value of loops and goal below which a fold is searched."""
NO_SLIDER = 1e-3
"""Fraction of its span below which the travel of a slider of the view counts as zero."""
OUT_OF_REACH = 1e-7
"""Radius (fraction of the extents) of balls around a pose within which no leg is proved out of reach."""

LINE_AT_CENTRE = 1e-3
"""Distance (m) up to which an observed line counts as passing through the camera centre."""

# Ranks and relations

RANK_GAP = 1e3
"""Smallest ratio of the last kept to the first dropped singular value at which a rank is a verdict."""
RANK_CUTOFF = 1e-7
"""Relative singular values below this are candidates for zero; the gap around it decides."""
LOOPS_SCALE = 1e-5
"""Smallest scale of the loop Jacobian's singular values (characteristic lengths, radians)."""
NO_SPREAD = 1e-12
"""Relative mean distance of joint centres from their centroid below which they are one point."""
SAME_RELATION = 1e-6
"""Largest principal angle (radians) at which two velocity relations are equal."""
UNMOVING = 1e-6
"""Relative length of (t, u̇) below which a mechanism cannot move in a direction."""
SURELY_SOMETHING = 1e-5
"""Singular values of a velocity relation above this are nonzero despite rounding."""
SURELY_ZERO = 1e-9
"""Singular values of a velocity relation below this are zero; the cutoff lies between the two."""
INVERTED = 1e-9
"""Relative singular value below which a map is not inverted."""
BOUNDED = 1e-3
"""Fraction of a limit that a bound reserves for rounding."""
CONTINUED = 0.5
"""Fraction of a small first-order step that must remain after closing; less is no finite motion."""
CONTINUED_STEP = 0.01
"""Length of such a step (characteristic lengths, radians)."""
NUDGE = 1e-6
"""Step (characteristic lengths, radians) of difference quotients."""
NAMED = 1e-6
"""Difference (metres, pure numbers) up to which a twist has the direction or line named in the robot."""
LOOPS_LOST = 1e-3
"""Fraction of its initial value at which the loops' smallest singular value stops a servo run."""

# Points, directions, mechanisms

SAME_POINT = 1e-7
"""Distance (characteristic lengths) below which two points are one: joint centres that meet, axes that intersect."""
SAME_DIRECTION = 1e-7
"""Sine of the angle below which two directions are parallel, cosine below which they are perpendicular."""
SAME_PLANE = 1e-4
"""Sine of the angle between two planes below which they count as one when directions are put in order for drawing."""
SAME_GEOMETRY = 1e-9
"""Largest difference (metres, pure numbers) at which two mechanisms count as the same."""
TURNING_ARM = 1e-3
"""Part of a vector normal to an axis (characteristic lengths) from which a turn about the axis is read."""

# Files

NOISE = 1e-4
"""Deviation (characteristic lengths, radians) up to which special geometry of a foreign file is snapped."""
MAY_MEET = 2e-2
"""Distance (characteristic lengths) up to which two frames of a foreign file are candidates for a closure."""
SINGLE = 1e-6
"""Relative difference up to which a number of single precision equals one of double precision."""
LARGEST_NOISE = 0.1
"""Largest tolerance that a user can give for snapping."""
ROUNDED = 2.5
"""Deviation of special geometry in units of the last decimal of a file's numbers."""
NO_FINER = 3.0
"""Factor around the tolerance within which no other structure of the robot may exist."""
EXACT = 1e-11
"""Deviation (characteristic lengths, radians) below which geometry is exact to rounding."""
NEARLY_ONE = 2e-3
"""Largest deviation of a rounded unit vector's length, or of an angle (rad) from a simple one."""
OBLIQUE = 0.1
"""Sine of the angle between two axes below which their intersection is not computed."""
FAINT = 1e-3
"""Relative singular value of a file's loops below which only rounding constrains a direction."""
LIMIT_MARGIN = 0.1
"""Distance (radians, characteristic lengths) inside its limits at which a joint starts when loops close beyond them."""
NEARLY_SINGULAR = 5e-3
"""Relative smallest singular value below which a foreign file's zero configuration is replaced."""
NEWTON_REACH = 1e4
"""Length of a Newton step in a foreign file's loops, per residual, beyond which it follows rounding."""
COMMAND_STEP = 1e-7
"""Step (characteristic lengths, radians) of differences of servo commands."""
COMMAND_CUTOFF = 1e-10
"""Relative singular value below which such differences show no rate."""
AT_ORIGIN = 1e-12
"""Distance (m) below which a joint's centre is the origin of the link that it carries, where a file is written."""
WITHOUT_DIRECTION = 1e-9
"""Length up to which a vector in a file has no direction."""
LIKE_A_WORD = 0.65
"""Similarity from which an unknown name in a file counts as a misspelling."""
OPPOSITE = 1e-3
"""One plus the cosine between two axes of a closure below which they are opposite."""
SAME_ROBOT = 1e-5
"""Relative difference (characteristic lengths, radians, masses) up to which two files describe one robot."""
NO_BODY = 1e-6
"""Relative negative second moment that an inertia may have: printed digits of a flat link."""
IN_DEGREES = 5.0
"""Angles in a file that are whole multiples of it (degrees) and larger than a turn in radians are taken for degrees."""
UNIT_AXIS = 1e-3
"""Deviation of an axis length from one in a file that is reported."""
TURN_IN_RADIANS = 6.3
"""Radians above which an angle in a file is more than a turn."""

# Singularities

SAME_SPOT = 1e-6
"""Distance (metres; of poses, of their matrices) below which two singular poses are one."""
ON_PLANE = 10**-4.5
"""Deviation (characteristic lengths, radians) up to which a singular pose lies in a plane of poses."""
LOCUS = 1e-7
"""Singular value, relative to the spread of a locus, below which the locus has no extent in that direction."""
VALLEY_DEPTH = 0.5
"""Fraction of the median below which a valley of the smallest singular value is searched."""
VALLEY_ZERO = 1e-5
"""Part of the median at which the smallest singular value in a valley counts as zero."""
COMPLEX_STEP = 1e-20
"""Imaginary step of the slope of a polynomial, exact because nothing cancels."""

# Assembly modes

PARALLEL = 1e-13
"""Sine of the angle below which two directions of loci are exactly parallel: it decides the solutions at infinity."""
SAME_SENSE = 1e-3
"""Difference of measured values (unit vectors; characteristic lengths) up to which a mode has the desired value."""
VANISHES = 1e-9
"""Distance of an attachment point from its locus (characteristic lengths) at which a pose fits redundant legs."""
NEAR_MODE = 1e-2
"""Distance of attachment points from their loci (characteristic lengths) up to which a near match is reported."""
NO_NEAR_MODE = 0.3
"""Distance (characteristic lengths) beyond which a start leads to no near mode."""
SAME_NEAR_MODE = 1e-6
"""Difference of poses and distances (characteristic lengths) below which two stationary poses are one."""
MEASUREMENT_BOUND = "0.1deg"
"""Default measurement bound, within which poses are indistinguishable."""
SAME_NEAR_POSE = 1e-4
"""Difference of poses (characteristic lengths, entries of rotations) below which two minima are one."""
FAMILY_STEP = 0.02
"""Step (characteristic lengths, radians) over which values of a near mode must stay within the bound in a family."""
CURVATURE_STEP = 1e-4
"""Step (characteristic lengths, radians) of the differences of such a slope."""
MEANT = 1e-5
"""Distance (characteristic lengths) up to which joint centres are snapped, if the next one is ``RANK_GAP`` larger."""
FARTHEST = 1e7
"""Distance (characteristic lengths) beyond which a solution is at infinity, if the next one is ``RANK_GAP`` nearer."""
INDEPENDENT_PLANES = 1e-3
"""Least sine between a plane's normal and the span of the other normals that determine the position."""
INDEPENDENT_RATES = 1e-6
"""Least singular value of the unit rates of independent conditions at the goal."""
RANK_OF_FORMS = 1e-11
"""Relative pivot that counts in the rank of a matrix of multiples of conditions."""
NUMBER_ROUNDING = 2.0**-48
"""Relative error of the numbers of conditions: some ten roundings."""
NEARLY_REAL_POSE = 1e-9
"""Imaginary parts of a proposed pose below which a real one is searched."""
NO_POSE = 1e-5
"""|q · q| of a unit quaternion below which it is extraneous."""
NEARLY_DOUBLE = 1e-6
"""Distance between two solutions, in their parameters, below which the pose counts as singular."""
CHAIN_ROUNDING = 16 * 2.0**-52
"""Relative error of lengths and angles after thirty-two roundings, along a chain of joints."""
MOVED = 4.0
"""Largest displacement of points within the robot's extent by a moved axis, as a multiple."""
TIP_ROUNDING = 2.0**-46
"""Relative error of a length after sixty-four roundings."""
SHARP_ROOT = 2.0**-60
"""Relative radius of a ball above which a solution is computed with more digits."""
NO_POSE_START = 1e-6
"""Residual of extraneous starts, and distance between two of them (both relative)."""
BOXES_APART = 1e-12
"""Relative margin by which boxes of solutions must be disjoint."""
POLISHED = 1e-9
"""Newton step (unit vectors) at which a path endpoint is accurate."""
SAME_END = 1e-8
"""Distance (unit vectors) below which two path endpoints are one, and one is real."""
SAME_SINGULAR_END = 1e-4
"""Distance (unit vectors) below which two singular endpoints are one."""
SINGULAR_END = 1e-5
"""Smallest singular value of scaled quadrics below which an endpoint is singular; a tenth is the cutoff on the path."""
BALL_ZERO = 2.0**-256
"""Radius of a ball containing zero at which its number is zero."""

UNIT_ROUNDOFF = 2.0**-53
"""Relative error of one rounding."""
SINE_ERROR = 2.0**-50
"""Largest error of a sine or cosine in generated code: four units in the last place."""
AFFINE_ROUNDING = 2.0**-46
"""Relative error of sixty-four roundings: more than one operation on affine forms has."""
TOGGLE = 0.03
"""Fraction of its value at zero at which the loops' smallest singular value ends a path at a toggle."""
TOGGLE_JOINT = 0.05
"""Fraction of the largest rate at a toggle from which a joint counts as moving."""
THINNEST_TUBE = 1e-13
"""Smallest radius of a tube around a branch (characteristic lengths, radians)."""
THINNEST_CELL = 1e-11
"""Smallest radius of a tube over a cell (characteristic lengths, radians)."""

# Accuracy

NARROWEST_CONE = 1e-15
"""Half-angle (rad) of a cone below which directions are equal as numbers."""
USUAL_ERROR = 100.0
"""Multiple of the median error of a field up to which a pose is checked with longer numbers."""
CONES_MET = 1e-14
"""Relative gap between the bounds at which a maximum over two cones is found."""
CONES_TIGHT = 1e-10
"""Relative gap between the bounds at which a maximum over three or more cones is found."""
FLAT_CONE = 1e-20
"""Fraction of a cone's largest squared error below which its term has no derivative."""
HESSIAN_STEP = 1e-4
"""Step of the differences of a best fit's Hessian."""
HESSIAN_CHANGE = 0.5
"""Largest relative change of a best fit's Hessian over a step; below 1 it stays definite."""
FLAT_CURVATURE = 0.05
"""Fraction of the initial curvature below which a best fit that cannot be continued is flat."""

# The loop

DAMPED = 1e-3
"""Singular values of the inverted rows (characteristic lengths, radians) below which the controller damps them."""
SERVED = 1e-10
"""Norm of the error at which a servo run has reached its goal."""
NEAREST_SEEN = 1e-3
"""Smallest depth (m) of lines drawn in an image."""
SEEN_ABOVE = 1e-3
"""Sine of the angle to the focal plane, or to a side of the image, below which an object is out of view."""
NOISE_STEP = 1e-5
"""Noise (radians, metres, fractions of the focal length) of the differences of its first-order effect."""
AT_REST = 1e-8
"""Speed (characteristic lengths, radians) per error and gain below which a servo loop is at an equilibrium."""
RESTED = 1e-10
"""Newton step (characteristic lengths, radians) at which an equilibrium is found."""
ARRIVED = 1e-6
"""Distance (characteristic lengths, radians) from a stable equilibrium at which a servo run has reached it."""
REST_SLOPE = 1e-4
"""Step of the differences of ẏ at an equilibrium: less than the width over which the law is damped."""
NEAR_REST = 0.1
"""Longest Newton step (characteristic lengths, radians) to an equilibrium."""
NEUTRAL_GROWTH = 1e-6
"""Growth (per time constant) up to which a motion at an equilibrium is neutral; largest speed of no drift."""
INTEGRATED = 1e-6
"""Relative tolerance of the integrator of a servo run."""
STRETCH_END = 1e-2
"""Fraction of its initial error at which a segment of a servo run ends, so that the tolerance follows the error."""
RUN_SHORTEST_STEP = 1e-9
"""Shortest step (time constants) that a blocked servo run tries."""
CRITICAL = 1e-11
"""Gradient of the error along the loops, and closure residual, at a critical point."""
DEPENDENT = 1e-13
"""Relative squared singular value of the loop equations that a closing step ignores."""
CLOSURES_MEET = 1e-6
"""Relative singular value of the loop equations below which closures meet; largest slope of E along that motion."""
ERROR_ROUNDING = 1e-14
"""½ ‖e‖² below which it is rounding."""
SAME_PRICE = 1e-9
"""Relative difference below which two costs are equal."""
SAME_ENDING = 1e-5
"""Difference (characteristic lengths, unit vectors) below which two critical points are one; curvature of one not
isolated."""
VANISHED = 1e-8
"""‖e‖ below which it vanishes at a critical point; cosine below which two directions are perpendicular."""
CRITICAL_FLAT = 1e-7
"""Curvature of the error below which it counts as zero in the search of critical points."""
FLOWED = 3e-5
"""Error of a step (characteristic lengths, radians) of batched runs."""
RUNS_ALIKE = 1e-5
"""Difference of poses (characteristic lengths, entries of rotations) and ‖e‖ up to which runs have one end."""
FLOW_SLOPE = 1e-6
"""Step of the differences of velocities and reach margins of batched runs."""
FLOW_SHORTEST_STEP = 1e-4
"""Step (time constants) at which a run without progress has a leg at the end of its reach."""
FLOW_STRETCHED = 1e-2
"""Reach margin, as a fraction of that at zero, up to which a leg counts as stretched."""
FLOW_TURNED = 1e-6
"""Reach margin of a leg that slides through a fixed point, below which it reverses."""
FLOW_WEAK = 3.0
"""Multiple of ``DAMPED`` below which the map from joints to platform is computed at each step."""
FLOW_ANEW = 1e-2
"""Change of pose (characteristic lengths, matrix entries) after which that map is computed again."""
FLOW_WALL = 1e-8
"""Reach margin, as a fraction of that at zero, at which a run slides along the limit of an unobserved leg."""
FLOW_SERVED = 1e-6
"""Norm of the error below which Newton's method finishes a run."""
FLOW_NEAR, FLOW_CONTRACTED, FLOW_CLEAR = 0.1, 0.125, 0.1
"""Error from which full Newton steps are tried, their contraction, and the reach margins kept (fractions of those at
zero)."""
IN_PLANE = 1e-3
"""Distance (characteristic lengths, radians) up to which the end of runs is drawn in a plane."""
BENCH_SETTLED = 1e-6
"""‖e‖ at which the dynamic simulation has settled."""
BENCH_STEADY = 1e-3
"""Relative change of the error per time constant below which the dynamic simulation has settled."""

# The catalog

PROVED_CHANCE = 1e-9
"""Largest probability of error of a proved catalog entry."""
SQUARE_AXES = 1e-9
"""Cosine below which the axes of a U in the catalog are perpendicular."""

# Motors to joints

ROUNDED_AXIS = 1e-15
"""Component of a unit vector below which it is zero."""
GENERATED_NEAR = 1e-7
"""Newton step (characteristic lengths, radians) after which generated code makes its last one."""
GENERATED_ERROR = 1e-12
"""Largest error of results of generated code (characteristic lengths, radians), rounding included."""
BOUND_WIDER = 1.25
"""Radius over which steps of generated code are bounded, as a multiple of the tube's."""
BOUND_ROUNDING = 1 + 2.0**-40
"""Factor on bounds of its steps for the rounding of their own products."""
FREE_WIDER, FREEST_WIDER = 2.0, 24.0
"""The same factors if the tube is not known to contain a zero: first choice, and multiple of its largest radius."""
PART_TUBE = 0.6
"""Radius of tubes in parts of a cell, as a fraction of its own."""
GENERATED_LAST_STEP = 3e-12
"""Largest last step of generated code (characteristic lengths, radians)."""
GENERATED_CLOSED = 1e-11
"""Largest closure residual of generated code (cosines; metres, or characteristic lengths above one metre)."""
GENERATED_REACHED = 1e-12
"""Difference from a pose at which generated code has reached it (rad; lengths as above)."""
GENERATED_SINGULAR = 1e-14
"""Relative pivot of the normal equations below which generated code reports singular rates."""

# Figures and views

DISTANCE_FLOOR = 1e-3
"""Fraction of the largest singularity distance on a map below which the colour is constant."""
DARKEST_DISTANCE = 1e-6
"""Singular value below which the grey behind a locus is darkest."""
UNMOVED = 1e-9
"""Motion (metres, radians) below which a platform is drawn as not moving along a coordinate."""
REST_OF_RUN = 1e-3
"""Fraction of the largest error below which a run is not drawn further."""
LARGEST_FIRST_ORDER = 1.0
"""Pose error (characteristic lengths, radians) above which first-order bounds are invalid."""
ON_LOCUS = 0.2
"""Fraction of the median of the smallest singular value of Mᵀ in a plane, below which a sign change of a determinant is
a zero."""
SLIDER_ARRIVED = 1e-6
"""Difference (metres, radians) at which the platform has reached the value of a slider."""
NARROWEST_RISING_CONE = 2.0**-7
"""Smallest half-width of a cone around a goal, in faces of the cube [-1, 1] to the n."""
SHORTEST_SLICE = 2.0**-9
"""Smallest length of a slice of such a cone, in square roots of twice the error."""
CERTIFIED_LEVEL = 0.95
"""Fraction of the error at which rays stop rising, up to which the proof tries that all rays rise."""
RADIUS_SHARES = (0.97, 0.9, 0.8, 0.65, 0.5, 0.3)
"""Fractions of the radius found by rays that are tried in turn as attraction radius."""
INWARD_SHARES = (0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9)
"""Fractions of that radius for a ball into which the flow points."""
MET_AGAIN = 1e-7
"""Smallest half-edge (characteristic lengths, radians) of a box of one critical point."""
THINNEST_BOX = 1e-3
"""Smallest ratio of such a box's edges."""
COVER_REACH = 1.0
"""Half-width (characteristic lengths) of the box of platform positions if legs give none."""
SHORTEST_ROD = 0.05
"""Length (characteristic lengths) of a sliding rod below which its leg is out of reach."""
SHORT_SHARE = 0.1
"""Fraction of the least distance of two base points up to which boxes around a short rod extend."""
COVER_MARGIN = 1.25
"""Extent of the boxes of positions as a multiple of the farthest base point."""
KNOWN_NUMBER = 1e-12
"""Uncertainty of the file's numbers (lengths in characteristic lengths) in proofs of all equilibria."""
BOX_ROUNDING = 1e-12
"""Relative rounding of the edges of a box."""
SMALLEST_BOX = 1e-8
"""Fraction of the whole box below which an undecided box remains undecided."""
COVER_ROOM = 1e-6
"""Margin of linear-program bounds of boxes (characteristic lengths); the programs are solved to 1e-7."""
SINGULAR_BOX = 1e-4
"""Smallest fraction of the whole for a box in which the leg equations may be dependent."""
SINGULAR_FINER = SINGULAR_BOX / 4, SINGULAR_BOX / 16, SINGULAR_BOX / 64
"""Fractions of the whole to which such boxes are subdivided in turn, if they form several clusters."""
LOCKED_PLACE = 0.01
"""Longest edge of a cluster of such boxes, as a fraction of the whole, that is reported as one place."""

"""Tolerances and limits that several modules share, each with its meaning.

All others stand in the module that uses them.

Lengths are made comparable with angles by a robot's *characteristic length* (the mean distance of its joint centres
from their centroid): a length divided by it is a pure number, as an angle is.
"""

# Closed configurations, and the way to a pose

CLOSURE_SOLVER_TOL = 1e-12
"""Closure residual (characteristic lengths, radians) at which the loop solver stops."""
CLOSURE_RESIDUAL_TOL = 1e-10
"""Residual (characteristic lengths, radians) below which a configuration counts as closed."""
WAYPOINT_RESIDUAL_TOL = 1e-3
"""Closure residual at which a waypoint counts as passed."""
PRINTED_POSE_TOL = 1e-5
"""Difference (metres, radians; characteristic lengths) up to which a coordinate equals its printed value."""
HIDDEN_ROBOT_RESIDUAL_TOL = 1e-9
"""Residual at which a hidden robot has the pose and directions of the real one."""
REACH_BALL_RADIUS_FRACTION = 1e-7
"""Radius (fraction of the extents) of balls around a pose within which no leg is proved out of reach."""

# Ranks and relations

RANK_GAP_MIN = 1e3
"""Smallest ratio of the last kept to the first dropped singular value at which a rank is a verdict."""
RANK_CUTOFF_FRACTION = 1e-7
"""Relative singular values below this are candidates for zero; the gap around it decides."""
RELATION_ANGLE_TOL = 1e-6
"""Largest principal angle (radians) at which two velocity relations are equal."""
NONZERO_SINGULAR_VALUE_MIN = 1e-5
"""Singular values of a velocity relation above this are nonzero despite rounding."""
ZERO_SINGULAR_VALUE_MAX = 1e-9
"""Singular values of a velocity relation below this are zero; the cutoff lies between the two."""
PSEUDOINVERSE_CUTOFF_FRACTION = 1e-9
"""Relative singular value below which a map is not inverted."""
SLOPE_STEP_MAX = 1e-6
"""Step (characteristic lengths, radians) of difference quotients."""
NAMED_TWIST_TOL = 1e-6
"""Difference (metres, pure numbers) up to which a twist has the direction or line named in the robot."""

# Points, directions, mechanisms

POINT_DISTANCE_TOL = 1e-7
"""Distance (characteristic lengths) below which two points are one: joint centres that meet, axes that intersect."""
DIRECTION_SINE_TOL = 1e-7
"""Sine of the angle below which two directions are parallel, cosine below which they are perpendicular."""
GEOMETRY_DIFFERENCE_TOL = 1e-9
"""Largest difference (metres, pure numbers) at which two mechanisms count as the same."""
ROTATION_LEVER_MIN_FRACTION = 1e-3
"""Part of a vector normal to an axis (characteristic lengths) from which a turn about the axis is read."""

# Files

INCIDENCE_TOL = 1e-4
"""Deviation (characteristic lengths, radians) up to which special geometry of a foreign file is snapped."""
INCIDENCE_TOL_MAX = 0.1
"""Largest tolerance that a user can give for snapping."""
TOLERANCE_AMBIGUITY_FRACTION = 3.0
"""Factor around the tolerance within which no other structure of the robot may exist."""
EXACT_INCIDENCE_TOL = 1e-11
"""Deviation (characteristic lengths, radians) below which geometry is exact to rounding."""
VECTOR_LENGTH_MIN = 1e-9
"""Length up to which a vector in a file has no direction."""

# Singularities

SINGULAR_POSE_DISTANCE_TOL = 1e-6
"""Distance (metres; of poses, of their matrices) below which two singular poses are one."""
LOCUS_EXTENT_TOL = 1e-7
"""Singular value, relative to the spread of a locus, below which the locus has no extent in that direction."""

# Assembly modes

LOCUS_DISTANCE_TOL = 1e-9
"""Distance of an attachment point from its locus (characteristic lengths) at which a pose fits redundant legs."""
NEAR_MODE_DISTANCE_MAX = 1e-2
"""Distance of attachment points from their loci (characteristic lengths) up to which a near match is reported."""
MEASUREMENT_BOUND = "0.1deg"
"""Default measurement bound, within which poses are indistinguishable."""
NEAR_POSE_DIFFERENCE_TOL = 1e-4
"""Difference of poses (characteristic lengths, entries of rotations) below which two minima are one."""
SOLUTION_DISTANCE_MAX = 1e7
"""Distance (characteristic lengths) beyond which a solution is at infinity, if the next one is ``RANK_GAP_MIN``
nearer."""
NUMBER_ROUNDING = 2.0**-48
"""Relative error of the numbers of conditions: some ten roundings."""
CHAIN_ROUNDING = 16 * 2.0**-52
"""Relative error of lengths and angles after thirty-two roundings, along a chain of joints."""
MOVED_AXIS_LEVER_MAX = 4.0
"""Largest displacement of points within the robot's extent by a moved axis, as a multiple."""
TIP_ROUNDING = 2.0**-46
"""Relative error of a length after sixty-four roundings."""
BOX_SEPARATION_TOL = 1e-12
"""Relative margin by which boxes of solutions must be disjoint."""
ENDPOINT_DISTANCE_TOL = 1e-8
"""Distance (unit vectors) below which two path endpoints are one, and one is real."""

AFFINE_ROUNDING = 2.0**-46
"""Relative error of sixty-four roundings: more than one operation on affine forms has."""
TUBE_RADIUS_MIN = 1e-13
"""Smallest radius of a tube around a branch (characteristic lengths, radians)."""

# The loop

CONTROLLER_DAMPING_MIN = 1e-3
"""Singular values of the inverted rows (characteristic lengths, radians) below which the controller damps them."""
VISIBLE_SINE_MIN = 1e-3
"""Sine of the angle to the focal plane, or to a side of the image, below which an object is out of view."""
CRITICAL_POINT_DISTANCE_TOL = 1e-5
"""Difference (characteristic lengths, unit vectors) below which two critical points are one; curvature of one not
isolated."""
RUN_END_DIFFERENCE_TOL = 1e-5
"""Difference of poses (characteristic lengths, entries of rotations) and ‖e‖ up to which runs have one end."""

# Motors to joints

GENERATED_LAST_STEP_MAX = 3e-12
"""Largest last step of generated code (characteristic lengths, radians)."""

# Figures and views

FIRST_ORDER_POSE_ERROR_MAX = 1.0
"""Pose error (characteristic lengths, radians) above which first-order bounds are invalid."""
SLIDER_TARGET_TOL = 1e-6
"""Difference (metres, radians) at which the platform has reached the value of a slider."""
SLIDING_ROD_LENGTH_MIN = 0.05
"""Length (characteristic lengths) of a sliding rod below which its leg is out of reach."""
SINGULAR_BOX_MIN_FRACTION = 1e-4
"""Smallest fraction of the whole for a box in which the leg equations may be dependent."""
SINGULAR_FINER = SINGULAR_BOX_MIN_FRACTION / 4, SINGULAR_BOX_MIN_FRACTION / 16, SINGULAR_BOX_MIN_FRACTION / 64
"""Fractions of the whole to which such boxes are subdivided in turn, if they form several clusters."""

# Limits of work and of sizes: counts, step lengths, times

POSE_VALUE_MAX = 1e9
"""Largest coordinate of a pose (metres, radians); beyond it numbers cannot separate nearby poses."""
CHARACTERISTIC_LENGTH_MAX_M = 20.0
"""Characteristic length (m) above which lint suspects millimetres."""
ROBOT_FILE_MAX_BYTES = 20_000_000
"""Bytes above which a robot file is not read at all."""
INCLUDED_FILES_MAX = 50
"""Files that an MJCF model may include, layers of a USD stage."""
USD_SECONDS, MESH_SECONDS = 10, 15
"""Time limit of one core for a USD stage, and for the meshes of a robot (s); three times as much by the clock."""
LOOP_COORDINATES_MAX = 240
"""Coordinates, or loops, above which the loops of a foreign file are not solved (900 MB of memory)."""

MODE_SEARCH_STARTS_MAX = 300
"""Largest number of random starts in a search of modes without equations."""
MODE_SEARCH_QUIET_STARTS_COUNT = 100
"""Closed starts without a new mode that end this search."""
MODE_SEARCH_ITERATIONS_MAX = 100
"""Iterations that close each start."""
GEAR_RATIO_MAX = 6
"""Largest numerator and denominator of the ratio of coupled rotations whose modes are listed."""

TUBE_RADII_COUNT = 4
"""Number of radii tried for a tube."""
TUBE_WIDENING_FRACTION = 1.2
"""Enlargement of a tube over its linear estimate."""

CACHED_OBSERVED_ROBOTS_COUNT = 32
"""Observed robots kept in the cache."""

LARGEST_ANSWER = 64 * 1024 * 1024
"""Largest reply to it (bytes)."""
SENDER_TIMEOUT_S = 10.0
"""Time limit for a request's head and each part of its body (s)."""

SUBDIVISION_BOXES_MAX = 8_000_000
"""Largest number of boxes of platform poses in the proof of all critical points."""

"""Names of URDF, URDF+ and the native format, and of closures as tools write them in URDF."""

from __future__ import annotations

from ...vocabulary import Vocabulary
from ..sdf.names import NAMES as SDF

NAMES = Vocabulary(
    """
robot: name version | link* joint* loop* coupling* transmission* hrsynth material* gazebo* constraint* loop_joint*
    frame* sensor* ros2_control* mujoco*
link: name type | inertial visual* collision* contact origin sensor* self_collision_checking collision_checking*
    kinematic gravity surface self_filter
joint: name type dont_collapse independent | origin parent child axis axis2 limit mimic dynamics calibration
    safety_controller joint_properties
loop: name type | predecessor successor axis axis2 limit dynamics
parent child predecessor successor: link | origin
coupling: name | predecessor successor ratio
ratio: value
origin: xyz rpy quat_xyzw
axis axis2 parent_axis child_axis: xyz
limit: lower upper effort velocity acceleration deceleration jerk free
mimic: joint multiplier offset
transmission: name type | type joint* actuator* mechanicalReduction ...
transmission/joint: name | hardwareInterface* ...
hrsynth: serial | platform camera* observe* ...
platform: link turns
camera: link name | origin image
image: focal width height
observe: leg link joint axis kind camera at radius
constraint: name type parent child | parent child parent_origin child_origin parent_axis child_axis axis ...
parent_origin child_origin: xyz rpy
loop_joint: name type | link1* link2* link* parent child parent_origin child_origin axis limit ...
loop_joint/link1 loop_joint/link2 loop_joint/link: link xyz rpy
frame: name link xyz rpy
inertial: | origin mass inertia
mass: value
inertia: ixx iyy izz ixy ixz iyz
visual: name | origin geometry material ...
collision: name | origin geometry material verbose contact_coefficients ...
geometry: name | box sphere cylinder capsule mesh convex
box: size name
sphere: radius name
cylinder capsule: radius length name
mesh: filename scale name
material: name | color texture
color: rgba
texture: filename
gazebo: reference | joint* plugin* ...
""",
    """
command_effort current gear_velocity reference
group group_state end_effector disable_collisions enable_collisions passive_joint virtual_joint
""",
    {"gazebo/joint": SDF},
)

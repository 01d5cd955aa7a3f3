"""Names of SDFormat; elements that are read have rows."""

from __future__ import annotations

from ...vocabulary import Vocabulary

NAMES = Vocabulary(
    """
sdf gazebo: version | world* model* actor* light* include*
world: name | model* frame* joint* plugin* include* state* physics* light* actor* gui scene audio wind gravity
    magnetic_field atmosphere spherical_coordinates road* population*
state: world_name name | model* sim_time wall_time real_time iterations insertions deletions light* joint*
state/model: name | joint* link* model* pose scale frame*
state/model/joint: name | angle*
angle: axis
model: name canonical_link placement_frame | link* joint* frame* model* pose static self_collide allow_auto_disable
    enable_wind plugin* gripper* include*
frame: name attached_to | pose
pose: relative_to frame degrees rotation_format
link: name | pose frame* inertial visual* collision* gravity enable_wind self_collide kinematic must_be_base_link
    velocity_decay sensor* light* projector audio_sink* audio_source* battery* particle_emitter*
joint: name type | parent child pose frame* axis axis2 gearbox_ratio gearbox_reference_body thread_pitch
    screw_thread_pitch physics sensor*
joint/axis joint/axis2: | xyz limit dynamics use_parent_model_frame initial_position mimic
xyz: expressed_in
axis/limit axis2/limit: | lower upper effort velocity stiffness dissipation
axis/mimic axis2/mimic: joint axis | multiplier offset reference
inertial: auto | mass pose frame* inertia density fluid_added_mass auto_inertia_params
inertia: | ixx iyy izz ixy ixz iyz
visual: name | pose frame* geometry material cast_shadows laser_retro transparency visibility_flags meta plugin*
collision: name | pose frame* geometry surface laser_retro max_contacts density auto_inertia_params
geometry: | box sphere cylinder capsule mesh plane cone ellipsoid heightmap image polyline* empty
box: | size
sphere: | radius
cylinder capsule: | radius length
mesh: optimization | uri scale submesh convex_decomposition
visual/material: | diffuse ambient specular emissive script* shader lighting pbr render_order double_sided shininess
""",
    """
damping friction spring_reference spring_stiffness ode bullet simbody solver_parallel
""",
)

"""Names of MJCF; elements that are read have rows."""

from __future__ import annotations

from ...vocabulary import Vocabulary

_ORIENTATION = "axisangle euler quat xyaxes zaxis"
_EQUALITY = "active class name solimp solref"
_JOINT = (
    "actuatorfrclimited actuatorfrcrange actuatorgravcomp armature axis class damping frictionloss group limited "
    "margin name pos range ref solimpfriction solimplimit solreffriction solreflimit springdamper springref "
    "springyield stiffness type user"
)
_ACTUATORS = "general motor position velocity intvelocity orientation pid damper cylinder muscle adhesion dcmotor"
_ACTUATOR = (
    "actdim actearly actlimited actrange area armature bias biasprm biastype body class cogging controller "
    "cranklength cranksite ctrllimited ctrlrange damping dampratio delay diameter dynprm dyntype ffrange "
    "force forcelimited forcerange fpmax fvmax gain gainprm gaintype gear group imax inductance inheritrange "
    "input interp joint jointinparent ki kp kv lengthrange lmax lmin lugre motorconst name nominal nsample "
    "posrange range refsite resistance saturation scale site slewmax slidersite tausmooth tendon thermal "
    "timeconst user velrange vmax"
)
_INSIDE = (
    "body* joint* freejoint* geom* site* camera* light* attach* composite* flexcomp* plugin* frame* replicate* include*"
)
_TENDON = (
    "actuatorfrclimited actuatorfrcrange armature damping frictionloss group limited margin material range rgba "
    "solimpfriction solimplimit solreffriction solreflimit springlength springyield stiffness user width"
)
NAMES = Vocabulary(
    f"""
mujoco: model | compiler* option* size* statistic* visual* default* asset* worldbody* contact* deformable* equality*
    tendon* actuator* sensor* keyframe* custom* extension* include*
compiler: alignfree angle assetdir autolimits balanceinertia boundinertia boundmass conflict coordinate discardvisual
    eulerseq fitaabb fusestatic inertiafromgeom inertiagrouprange meshdir passthrough savecanonical savecompiled
    saveinertial settotalmass strippath texturedir usethread convexhull exactmeshinertia | lengthrange
default: class | default* mesh* texture material* joint* geom* site* camera light pair equality* tendon include*
    {_ACTUATORS.replace(" ", "* ")}* plugin*
worldbody: | {_INSIDE}
body: {_ORIENTATION} childclass fuse gravcomp mocap name pos simple sleep user | inertial {_INSIDE}
frame: {_ORIENTATION} childclass name pos | inertial {_INSIDE}
replicate: count euler offset sep | {_INSIDE}
attach: body frame model prefix
model: content_type file name
inertial: {_ORIENTATION} pos mass diaginertia fullinertia
joint: {_JOINT}
freejoint: align group name
site: {_ORIENTATION} class fromto group material mesh name pos rgba size type user
geom: {_ORIENTATION} adhesion castshadow class conaffinity condim contype density fitscale fluidcoef fluidshape friction
    fromto gap group hfield margin mass material mesh name pos priority rgba shellinertia size solimp solmix solref
    surfacevel type user | plugin*
asset: | mesh* hfield* skin* texture* material* model* include*
mesh: builtin class content_type face file inertia material maxhullvert name normal params refpos refquat scale
    smoothnormal texcoord vertex | plugin*
material: class emission metallic name reflectance rgba roughness shininess specular texrepeat texture texuniform |
    layer*
equality: | connect* weld* joint* tendon* flex* flexvert* flexstrain* distance* include*
default/equality: active solimp solref
connect: {_EQUALITY} anchor body1 body2 site1 site2
weld: {_EQUALITY} anchor body1 body2 relpose site1 site2 torquescale
equality/joint: {_EQUALITY} joint1 joint2 polycoef
equality/tendon: {_EQUALITY} tendon1 tendon2 polycoef
tendon: | spatial* fixed* include*
tendon/fixed: {_TENDON} class name | joint*
default/tendon: {_TENDON}
fixed/joint: joint coef
actuator: | {_ACTUATORS.replace(" ", "* ")}* plugin* include*
{" ".join(f"{parent}/{each}" for parent in ("actuator", "default") for each in _ACTUATORS.split())}: {_ACTUATOR}
keyframe: | key* include*
key: act ctrl mpos mquat name plastic qpos qvel time
custom: | numeric* text* tuple* include*
text: data name
""",
    "solreffix skinrender",
)

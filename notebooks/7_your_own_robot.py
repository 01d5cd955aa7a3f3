# %% [markdown]
# # 7. Bring your own robot file
#
# All notebooks so far used shipped robots. This one writes a robot file, makes mistakes in it, reads a file of another
# tool, and writes files.

# %%
import tempfile
from pathlib import Path

import hrsynth
from hrsynth.errors import HrsynthError

folder = Path(tempfile.mkdtemp())

# %% [markdown]
# ## A four-bar in URDF
#
# URDF describes trees: every link has one parent. A parallel robot has loops. The rule is simple: write a spanning
# tree, and for each joint that would close a loop write a `<loop>`, which most other URDF readers ignore. Two more
# elements name the motors and the observations.

# %%
FOUR_BAR = """<robot name="four_bar">
  <link name="base"/> <link name="crank"/> <link name="bar"/> <link name="rocker"/>
  <joint name="a" type="continuous"> <parent link="base"/> <child link="crank"/> <axis xyz="0 1 0"/> </joint>
  <joint name="b" type="continuous"> <parent link="crank"/> <child link="bar"/>
    <origin xyz="0 0 1"/> <axis xyz="0 1 0"/> </joint>
  <joint name="c" type="continuous"> <parent link="base"/> <child link="rocker"/>
    <origin xyz="2 0 0"/> <axis xyz="0 1 0"/> </joint>
  <loop name="d" type="revolute">
    <predecessor link="rocker"> <origin xyz="0.3 0 1.2"/> </predecessor>
    <successor link="bar"> <origin xyz="2.3 0 0.2"/> </successor>
    <axis xyz="0 1 0"/>
  </loop>
  <transmission name="motor"> <joint name="a"/> </transmission>
  <hrsynth> <platform link="bar"/> <observe leg="1" link="crank" axis="0 0 1"/> </hrsynth>
</robot>
"""
file = folder / "four_bar.urdf"
file.write_text(FOUR_BAR)
robot = hrsynth.load(file)
robot

# %% [markdown]
# The frames of a loop are on its two links, and must coincide at the zero configuration: here at x = 2.3, z = 1.2 in
# the base frame. One dof, one observed direction, that of the crank:

# %%
print(hrsynth.derive(robot, observe=["1"]))

# %% [markdown]
# The crank is observed and actuated, so the hidden robot is the real one: the camera acts as an encoder here. The
# rocker is not observed but must stay. Without it the bar could rotate about the crank's end, as in the unchecked form.
#
# With the crank's direction fixed, the four-bar has two poses, its bar and rocker folded to one side or the other:

# %%
found = hrsynth.modes(robot, ["1"])
assert len(found.modes) == 2
hrsynth.draw(found)

# %% [markdown]
# ## Mistakes
#
# A file with mistakes is refused. All mistakes are listed at once, each with its line. Nothing is repaired silently.

# %%
broken = FOUR_BAR.replace('child link="rocker"', 'child link="rokcer"').replace('type="revolute"', 'type="hinge"')
(folder / "broken.urdf").write_text(broken)
try:
    hrsynth.load(folder / "broken.urdf")
except HrsynthError as error:
    for line in error.lines():
        print(line.replace(str(folder), "…"))

# %% [markdown]
# The most common mistake is a loop that is not closed: its frames do not coincide. The program cannot know which number
# is wrong. It reports the closure residual:

# %%
(folder / "open.urdf").write_text(FOUR_BAR.replace("2.3 0 0.2", "2.4 0 0.2"))
try:
    hrsynth.load(folder / "open.urdf")
except HrsynthError as error:
    print("\n".join(error.lines()).replace(str(folder), "…"))

# %% [markdown]
# ## A file of another tool
#
# MuJoCo closes loops by equality constraints. Below is a typical planar five-bar: two arms, a `connect` where they
# meet, two actuators. Nothing in it names the platform.

# %%
FIVE_BAR = """<mujoco model="five_bar">
  <worldbody>
    <body name="crank_1" pos="-0.1 0 0">
      <joint name="hip_1" axis="0 1 0"/> <geom type="sphere" size="0.01"/>
      <body name="rod_1" pos="-0.06 0 0.15">
        <joint name="knee_1" axis="0 1 0"/> <geom type="sphere" size="0.01"/>
      </body>
    </body>
    <body name="crank_2" pos="0.1 0 0">
      <joint name="hip_2" axis="0 1 0"/> <geom type="sphere" size="0.01"/>
      <body name="rod_2" pos="0.09 0 0.13">
        <joint name="knee_2" axis="0 1 0"/> <geom type="sphere" size="0.01"/>
      </body>
    </body>
  </worldbody>
  <equality> <connect name="tip" body1="rod_1" body2="rod_2" anchor="0.18 0 0.09"/> </equality>
  <actuator> <position joint="hip_1"/> <position joint="hip_2"/> </actuator>
</mujoco>
"""
foreign = folder / "five_bar.xml"
foreign.write_text(FIVE_BAR)
other = hrsynth.load(foreign)
try:
    hrsynth.derive(other)
except HrsynthError as error:
    print("\n".join(error.lines()).replace(str(folder), "…"))
    other = hrsynth.load(foreign, platform="rod_1")
other

# %% [markdown]
# What reading assumed, solved or merged is reported, one line each:

# %%
for note in other.notes:
    print(note)

# %% [markdown]
# A `connect` only makes two points coincide. In a planar loop it is equivalent to a revolute joint, and is read as one.
# So this is a robot like that of notebook 1:

# %%
print(repr(hrsynth.derive(other)))
assert str(hrsynth.derive(other).hidden_architecture) == str(hrsynth.derive("rrrrr_m1").hidden_architecture)
print(repr(hrsynth.modes(other)))

# %% [markdown]
# ## Writing
#
# `save` writes the native format, MJCF, SDFormat or Gepetto's URDF with YAML, by the suffix of the file, and returns
# what the format cannot express. The hidden robot is a mechanism like any other and can be written too, to be viewed,
# simulated or analysed:

# %%
hidden = hrsynth.derive(hrsynth.load("3rrr_m1"))
for suffix in (".urdf", ".xml", ".sdf"):
    omitted = hrsynth.save(hidden.hidden, folder / f"hidden{suffix}")
    back = hrsynth.load(folder / f"hidden{suffix}", platform="platform")
    print(
        f"{suffix:6}{(folder / f'hidden{suffix}').stat().st_size:6} bytes, read back: {back.headline()};",
        "; ".join(map(str, omitted)) or "nothing omitted",
    )

# %% [markdown]
# The hidden robot of a hidden robot? Its motor coordinates are the observed directions. So observing the same
# directions changes nothing:

# %%
again = hrsynth.derive(hrsynth.load(folder / "hidden.urdf"))
print(again.architecture, "→", again.hidden_architecture)
assert str(again.architecture) == str(again.hidden_architecture)

# %% [markdown]
# ## Exercises
#
# 1. Put the motor of the four-bar on joint `c` and observe the rocker instead of the crank. What changes in the hidden
#    robot?
# 2. Give the crank's joint `a` limits (type `revolute`, a `<limit>` from −0.5 to 0.5) and list the modes again. Which
#    are reachable now?
# 3. Build the five-bar in Python with `hrsynth.mechanism.builder.Builder` and save it. Compare it with the MuJoCo one
#    by `differences`.

# %% [markdown]
# ## Solutions

# %% jupyter={"source_hidden": true} tags=["solution"]
# 1. only the names: the observed direction becomes the motor, whichever joint was actuated
swapped = FOUR_BAR.replace('<joint name="a"/> </transmission>', '<joint name="c"/> </transmission>')
swapped = swapped.replace('leg="1" link="crank" axis="0 0 1"', 'leg="2" link="rocker" axis="0.3 0 1.2"')
(folder / "swapped.urdf").write_text(swapped)
print(repr(hrsynth.derive(hrsynth.load(folder / "swapped.urdf"), observe=["2"])))

# %% jupyter={"source_hidden": true} tags=["solution"]
# 2. the crank's angle is the same in all modes, so its own limits exclude none
limited = FOUR_BAR.replace(
    '<joint name="a" type="continuous">',
    '<joint name="a" type="revolute"> <limit lower="-0.5" upper="0.5" effort="1" velocity="1"/>',
)
(folder / "limited.urdf").write_text(limited)
for mode in hrsynth.modes(hrsynth.load(folder / "limited.urdf"), ["1"]).modes:
    print(mode)
    assert mode.goal or mode.reachable

# %% jupyter={"source_hidden": true} tags=["solution"]
# 3. the same joints at the same points; only the spheres drawn on the links differ
from hrsynth.mechanism.builder import Builder

b = Builder("five_bar")
b.link("world")
for leg, x, knee in ((1, -0.1, (-0.16, 0, 0.15)), (2, 0.1, (0.19, 0, 0.13))):
    b.link(f"crank_{leg}", at=(x, 0, 0))
    b.link(f"rod_{leg}", at=knee)
    b.joint(f"hip_{leg}", "R", "world", f"crank_{leg}", at=(x, 0, 0), axis=(0, 1, 0), motor=True)
    b.joint(f"knee_{leg}", "R", f"crank_{leg}", f"rod_{leg}", at=knee, axis=(0, 1, 0))
b.joint("tip", "R", "rod_1", "rod_2", at=(0.02, 0, 0.24), axis=(0, 1, 0), loop=True)
mine = b.build(platform="rod_1")
hrsynth.save(mine, folder / "mine.urdf")
print(repr(hrsynth.derive(mine)))
print("\n".join(mine.differences(other)) or "no difference")
assert all(each.startswith("content of link") for each in mine.differences(other))

# %% [markdown]
# # 9. Six poses, seen by a camera
#
# In 1992 Innocenti and Parenti-Castelli described a planar robot that can be assembled in six ways with the same
# lengths of its legs, and that can go from one of them to another without a singularity.
#
# A controller that watches the legs of a 3-RRR drives such a robot without knowing it. This notebook finds its six
# poses, proves which of them belong together, and leads the controller from one to another.

# %%
import matplotlib.pyplot as plt
import numpy as np

import hrsynth
from hrsynth.families.planar import six_poses

plt.style.use("hrsynth.present.style")
robot = six_poses()
hidden = hrsynth.derive(robot)
print(hidden.architecture, "hides", hidden.hidden_architecture)

# %% [markdown]
# The three rods are watched. Hold their directions: each rod only translates then, so its end at the platform runs on
# a circle, as large as the crank's. A triangle with its corners on three circles is what the 3-RPR of 1992 is with its
# legs' lengths held. Here triangle, circles and centres are those of that robot, in centimetres.
#
# ## Six poses

# %%
listed = hrsynth.modes(robot)
print(listed.count)
print(listed.found.proof)
assert len(listed.modes) == 6
assert listed.found.complete
assert all(mode.goal or mode.reachable for mode in listed.modes)
hrsynth.draw(listed)

# %% [markdown]
# All six are real, all six can be assembled, and in all six the camera sees the same. A servo loop that is told to go
# from the first to the fifth does nothing at all, because there is no error to correct:

# %%
idle = hrsynth.servo(robot, start="mode:1", goal="mode:5")
print(idle)
assert idle.outcome == "mode"

# %% [markdown]
# ## The atlas
#
# Two modes lie in one *aspect* if a path without Type 2 singularity joins them. Which do?

# %%
atlas = hrsynth.aspects(robot)
print(atlas)
assert atlas.cuspidal
assert atlas.aspects_met == "2"

# %% [markdown]
# Six modes, two aspects, three modes in each. *Separated* is proved by the sign of a determinant, which cannot change
# without a zero. *Same aspect* is proved by a path: it is cut into intervals, and on each of them interval arithmetic
# keeps the determinant away from zero. On some paths a leg is stretched out and folds to its other side. That is a
# singularity of Type 1, at which the camera loses nothing of the platform, but the directions change infinitely fast.
# One path passes no such place, and it is a straight line:

# %%
one, other = next(pair.numbers for pair in atlas.changes if pair.answer is not None and not pair.answer.crossings)
path = hrsynth.path(robot, start=f"mode:{one}", goal=f"mode:{other}")
print(path)

# %% [markdown]
# ## How a controller changes its mode
#
# Let the desired directions move along that line for thirty seconds. The controller only follows directions, as it
# always does.

# %%
run = hrsynth.servo(robot, start=f"mode:{one}", goal=f"mode:{other}", duration=30, time=40)
print(run)
assert run.outcome == "goal"

# %%
hrsynth.draw(run)

# %% [markdown]
# It ends at the other mode. The directions are those that it began with, and the platform is 13 cm and 108 degrees
# away from where it was. No rank was lost, no matrix was singular, no error was large. (The path bends a little at
# first: the desired directions are interpolated between poses of the line, which matters where the singular value is
# small.) The smallest singular value falls on the way, to a ninth of its value at the start, and rises again. It is
# never zero:

# %%
starts = np.linspace(0, 1, 60)
first, last = (np.array([p.x, p.y]) for p in (path.start.pose, path.goal.pose))
turn = path.goal.pose.rpy[2] - path.start.pose.rpy[2]
line = first + starts[:, None] * (last - first)
assert 0.125 < np.linalg.norm(last - first) < 0.135
assert 107.5 < abs(np.degrees(turn)) < 108.5
poses = [f"x={x},y={y},phi={f * turn}" for (x, y), f in zip(line.tolist(), starts, strict=True)]
values = [posture.distances.type2 for posture in hrsynth.check(robot, at=poses).postures]
figure, place = plt.subplots(figsize=(6, 3.4))
place.plot(starts, values)
place.set(xlabel="part of the way from mode to mode", ylabel="smallest singular value of Mᵀ", ylim=(0, None))
plt.show()
print(f"at the start {values[0]:.4f}, least {min(values):.4f}: a factor of {values[0] / min(values):.1f}")
assert min(values) > 0
assert 8 < values[0] / min(values) < 10

# %% [markdown]
# ## Why: cusps
#
# Hold the direction of the first rod. The remaining poses form a surface, and the other two directions map it to a
# plane. The colour of a point of this plane is the number of modes above it.

# %%
hrsynth.draw(atlas)

# %% [markdown]
# Where the surface is folded two modes meet: these are the Type 2 singularities, the black curve. Where a fold ends in
# a *cusp* three modes meet. Start on one of the outer two and go once around the cusp, and you arrive on the other
# without meeting a fold. Every cusp and node of the drawing is enclosed: there is exactly one within the radius.

# %%
section, places = atlas.section
print(len(section.cusps), "cusps,", sum(cusp.radius is not None for cusp in section.cusps), "of them enclosed")
print(len(section.nodes), "nodes,", sum(node[0].radius is not None for node in section.nodes), "of them enclosed")
print("the widest enclosure:", f"{max(cusp.radius for cusp in section.cusps):.1e}")
assert all(cusp.radius is not None for cusp in section.cusps)
assert all(node[0].radius is not None for node in section.nodes)

# %% [markdown]
# What is an engineer to do? Choose a goal that stays away from the cusps, or a start in the goal's own part of its
# aspect, or add a measurement: an encoder at crank 1 distinguishes the six poses, as the crank's end differs in each:

# %%
zero = np.linalg.inv(robot.links["platform"].pose)
corner = [*robot.joints["wrist_1"].point, 1.0]
ends = np.array([(mode.bodies["platform"] @ zero @ corner)[:2] for mode in listed.modes])
least = min(np.linalg.norm(ends[i] - ends[j]) for i in range(6) for j in range(i))
print(f"the ends of crank 1 are at least {1e3 * least:.1f} mm apart")
assert least > 1e-3

# %% [markdown]
# ## Exercises
#
# 1. The Quattro of the paper with legs 1 and 4 watched has four modes. Is its hidden robot cuspidal?
# 2. Choose other lengths of the rods. Do the six modes still lie in two aspects?
# 3. Hold the direction of another rod. How many cusps does that section have?

# %% [markdown]
# ## Solutions

# %% jupyter={"source_hidden": true} tags=["solution"]
# 1. yes: two of its modes are joined, and no leg has to change its working mode
print(hrsynth.aspects("quattro", "1,4"))

# %% jupyter={"source_hidden": true} tags=["solution"]
# 2. the modes stay where they are, as their circles do; which path joins them changes
for rods in ((0.3, 0.3, 0.3), (0.2, 0.25, 0.4)):
    found = hrsynth.aspects(six_poses(rods=rods))
    print(rods, len(found.places), "modes, aspects:", found.aspects_met, "cuspidal:", found.cuspidal)

# %% jupyter={"source_hidden": true} tags=["solution"]
# 3. the leg that is watched first is held
found = hrsynth.aspects(robot, ["2", "1", "3"])
print(found.section[0].robot.labels[0], "held:", len(found.section[0].cusps), "cusps")

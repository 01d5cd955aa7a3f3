# %% [markdown]
# # 6. When it cannot work
#
# Some robots cannot be controlled by watching their legs' directions, however good the camera is. MMT 4.3 names them:
# robots whose motors slide along parallel rails. This notebook shows why, how the hidden robot shows it at once, and
# what else has to be measured.

# %%
import matplotlib.pyplot as plt
import numpy as np

import hrsynth

plt.style.use("hrsynth.present.style")

# %% [markdown]
# ## Two rails
#
# The smallest example is a planar P̲RRRP̲: two carriages on parallel rails, two rods, one point where they meet.

# %%
robot = hrsynth.load("prrrp_parallel")
hidden = hrsynth.derive(robot)
hidden

# %%
hrsynth.draw(hidden)

# %% [markdown]
# The virtual motors sit where the rods begin. The carriages have become passive, and both slide along the same
# direction. Hold both directions: the whole figure can still be pushed along the rails. Nothing that the camera sees
# changes. This is not a singularity that one could avoid. It is so at every pose:

# %%
print(hrsynth.singularities(robot).words)
print("smallest sets that see as much as can be seen:", hrsynth.legs(robot).smallest)

# %% [markdown]
# Numbers say the same. Mᵀ gives the rates of the directions from the velocity of the platform. At twenty random
# configurations of the robot its smallest singular value is zero up to rounding, while the largest has an ordinary
# size:

# %%
setting = hrsynth.observe(robot)
places = np.array([at.pose(setting.motion.link) for at in setting.configurations])
values = setting.batch.evaluate(places).singular_values
print("largest singular values from", values[:, 0].min().round(2), "to", values[:, 0].max().round(2))
print("smallest singular values up to", values[:, -1].max())
assert len(values) == 20
assert values[:, -1].max() < 1e-12
assert values[:, 0].min() > 0.5

# %% [markdown]
# If the rails are not parallel, all is well. The two robots have the same letters, and so do their hidden robots. It
# is the geometry that decides:

# %%
for name in ("prrrp_m1", "prrrp_parallel"):
    found = hrsynth.derive(hrsynth.load(name))
    print(f"{name:16}{found.hidden_architecture!s:12}{found.verdict.verdict}")
print(hrsynth.singularities(hrsynth.load("prrrp_m1"), points=100).words)

# %% [markdown]
# ## UraneSX, Hexaglide, I4L
#
# Machine tools often have parallel rails, because these make the workspace as long as one wants in one direction. But
# it is in that very direction that nothing is seen:

# %%
for name in ("uranesx", "hexaglide", "i4l", "linear_delta", "orthoglide"):
    verdict = hrsynth.derive(hrsynth.load(name)).verdict
    lost = "; ".join(freedom.name for freedom in verdict.unobserved) or "–"
    assert (verdict.verdict == "controllable") == (name in ("linear_delta", "orthoglide"))
    print(f"{name:14}{verdict.verdict:24}rank {verdict.rank} of {verdict.dof}   lost: {lost}")

# %% [markdown]
# The last two have slides too, but theirs are not parallel. (`i4l` has one more peculiarity: its links move while the
# platform rests, so there is no matrix Mᵀ at all. The relation between velocities and rates still exists, and is what
# is compared.)

# %%
known = hrsynth.derive(hrsynth.load("i4l")).verdict.has_interaction_matrix
print(known)
assert not known

# %% [markdown]
# ## What else must be measured?
#
# MMT 5.3 suggests measuring the lines themselves, not only where they point. `advise` looks for the smallest sets of
# further measurements that make the robot controllable, and verifies each of them:

# %%
advice = hrsynth.advise(hrsynth.load("uranesx"))
assert advice.size == 1
assert {each.kind for cure in advice.sets for each in cure.measurements} == {"line", "encoder"}
advice

# %% [markdown]
# One more measurement is enough. Any encoder on a rail will do, or the position of one of the lines that are watched
# already: a camera that sees a rod usually knows that too. Every further *direction* is useless, and none is in the
# list. Here is how many sets of each kind help the robots above:

# %%
for name in ("prrrp_parallel", "uranesx", "hexaglide", "i4l", "3prp", "3ppr_m1"):
    found = hrsynth.advise(hrsynth.load(name))
    kinds = {}
    for cure in found.sets:
        kind = " + ".join(sorted(each.kind for each in cure.measurements))
        kinds[kind] = kinds.get(kind, 0) + 1
    print(f"{name:16}{'cured' if found.cured else 'not cured'} by {found.size} more: {kinds}")

# %% [markdown]
# ## Almost parallel
#
# What if the rails are parallel up to an angle? Then the rank is full, and `controllable` is the verdict. But the
# smallest singular value shows what it is worth. It is proportional to the angle, and the error of the platform to
# its inverse:

# %%
from hrsynth.families.planar import prrrp

angles = np.radians([0.5, 1, 2, 5, 10, 20, 40])
errors, smallest = [], []
for angle in angles:
    tilted = prrrp(rails=(np.pi / 2 - angle / 2, np.pi / 2 + angle / 2))
    smallest.append(hrsynth.check(tilted).postures[0].distances.type2)
    errors.append(1e3 * hrsynth.accuracy(tilted, cone="0.1deg").poses[0].position.largest)
figure, place = plt.subplots(figsize=(6, 4))
place.loglog(np.degrees(angles), errors, "o-")
place.set(xlabel="angle between the rails (degrees)", ylabel="largest error for 0.1° (mm)")
place.grid(alpha=0.3, which="both")
plt.show()
for name, values in (("smallest singular value", smallest), ("largest error", errors)):
    slope = np.polyfit(np.log(angles[:3]), np.log(values[:3]), 1)[0]
    print(f"{name}: slope {slope:.3f} at small angles")
    assert abs(abs(slope) - 1) < 0.02

# %% [markdown]
# The slopes are close to 1 and −1: halve a small angle, and the error doubles. A verdict is a yes or a no about
# geometry, and an engineer should ask for the number too.
#
# ## Exercises
#
# 1. In `3ppr_m1` the camera sees nothing at all. How many measurements does `advise` need, and of what kinds?
# 2. Watch one leg of the Delta (`delta`). Which smallest additions make it controllable? Which of them need no new
#    sensor besides the camera?
# 3. Tilt the rail of one leg of `linear_delta` until it is parallel to another. Is the robot still controllable? How
#    many rails must be parallel for the verdict to change?

# %% [markdown]
# ## Solutions

# %% jupyter={"source_hidden": true} tags=["solution"]
# 1. three freedoms are lost, and each encoder or line position gives back one
blind = hrsynth.advise(hrsynth.load("3ppr_m1"))
print(blind)
assert blind.size == 3

# %% jupyter={"source_hidden": true} tags=["solution"]
# 2. another leg needs only the camera; so does the position of a line that is watched already
print(hrsynth.advise(hrsynth.load("delta"), ["1"]))

# %% jupyter={"source_hidden": true} tags=["solution"]
# 3. the condition of linear_delta: the P axes must all be parallel, so two parallel rails do no harm
print(hrsynth.singularities(hrsynth.load("linear_delta"), points=50).words)

# %% [markdown]
# # 3. The planar table
#
# MMT's Table 1 lists the legs of planar robots: three joints of type R (revolute) or P (prismatic), one of them
# actuated. For each it gives the hidden leg when a camera observes the leg's direction. This notebook computes that
# table, for robots with three equal legs, and adds three columns.
#
# In a planar robot a direction is one angle. The virtual motor is an R̲, not a U̲.

# %%
import matplotlib.pyplot as plt
import numpy as np

import hrsynth
from hrsynth.families.planar import three_rrr

plt.style.use("hrsynth.present.style")
NAMES = ["3rrr_m1", "3rrr_m2", "3rpr_m1", "3rpr_m2", "3prr_m1", "3prr_m2", "3ppr_m1", "3ppr_m2", "3prp", "3rrp"]


def row(*cells):
    """Cells in columns; the line under a motor has no width."""
    widths = (10, 9, 10, 24, 8)
    padded = [f"{cell!s:{w + str(cell).count(chr(0x332))}}" for cell, w in zip(cells, widths, strict=False)]
    return "  ".join([*padded, *map(str, cells[len(widths) :])])


derived = {name: hrsynth.derive(hrsynth.load(name)) for name in NAMES}
numbers = {}
print(row("robot", "real", "hidden", "verdict", "rank", "modes (real of complex)"))
for name, found in derived.items():
    listed = found.modes()
    numbers[name] = (len(listed.modes), listed.found.complex)
    count = (
        "a continuous family" if listed.found.continuous_family else f"{len(listed.modes)} of {listed.found.complex}"
    )
    print(
        row(
            name,
            found.architecture,
            found.hidden_architecture or "none",
            found.verdict.verdict,
            f"{found.verdict.rank} of {found.verdict.dof}",
            count,
        )
    )

# %% [markdown]
# The second and third columns are those of the paper's table. All of it is checked here, robot by robot:

# %%
PRINTED = {"3rrr": "ΠR̲R", "3rpr": "R̲PR", "3prr": "PR̲R", "3ppr": None, "3prp": "PR̲P", "3rrp": "ΠR̲P"}
for name, found in derived.items():
    leg = PRINTED[name.split("_")[0]]
    assert str(found.hidden_architecture) == f"3-{leg}" if leg else found.hidden_architecture is None
    assert found.equivalence.passed
print("the same hidden legs as in MMT Table 1, each passed the equivalence check")

# %% [markdown]
# ## What the columns show
#
# **The choice of the actuated joint does not matter.** The two robots of a kind differ in their motors and have the
# same hidden robot. It does not depend on the real motors.
#
# **Not every robot can be controlled like this.** In 3-PPR robots the last segment only translates: its direction never
# changes, nothing is measured, and there is no hidden robot. In PRP and RRP robots a prismatic joint connects every leg
# to the platform. So each of the three directions shows only the platform's rotation, and nothing of its position:

# %%
print(derived["3prp"].verdict)
print()
print(derived["3rrp"].verdict)
assert derived["3prp"].verdict.rank == derived["3rrp"].verdict.rank == 1
assert derived["3ppr_m1"].verdict.rank == derived["3ppr_m2"].verdict.rank == 0

# %% [markdown]
#
# **The assembly modes.** With fixed directions, the locus of each leg's tip is a curve. It is a line if the leg ends
# with a prismatic joint, and a circle if the rod is on a crank. The platform is a triangle whose corners must lie on
# three such curves.
#
# For three lines there are 2 solutions. For three circles there are 6, complex ones included. That is the classical
# problem of a triangle on two cranks: its third corner traces a *coupler curve*, and the third circle cuts it in up to
# six points (MMT Fig. 7).
#
# Can all six be real? With the shipped dimensions only two are, but there are others with all six:

# %%
angles = np.radians([93, 208, 329])
wide = three_rrr(
    proximal=0.23,
    distal=0.3,
    platform=list(zip((0.16, 0.19, 0.13), angles, strict=True)),
    home=(0.01, -0.015, np.radians(-17)),
)
six = hrsynth.modes(wide)
print(len(six.modes), "real of", six.found.complex)
assert numbers["3rrr_m1"] == (2, 6)
assert numbers["3rpr_m1"] == numbers["3prr_m1"] == (2, 2)
assert len(six.modes) == six.found.complex == 6
hrsynth.draw(six)

# %% [markdown]
# One curve is the coupler curve of the triangle on two legs, the other the third leg's circle. All six modes are
# proved: an exact polynomial of degree six, its roots isolated, each pose enclosed by interval arithmetic.

# %%
print(six.found.proof)
print("widest enclosure:", max(mode.radius for mode in six.modes))
assert six.found.complete

# %% [markdown]
# ## Singularities
#
# With fixed directions, each corner of the platform can move only along the tangent of its locus. A planar motion is a
# rotation about a point, and moves each corner at right angles to the line to that point. So the platform can move if
# the three normals at the three tips meet in one point, or are parallel (a translation). `singularities` reports this
# condition, and its expression is the determinant of three lines:

# %%
condition = hrsynth.singularities(derived["3rrr_m1"].robot, points=300)
print(condition.words)
print(condition.condition.expression)
print(condition.checked.points, "poses compared,", condition.checked.disagreements, "disagreements")
assert not condition.checked.disagreements

# %% [markdown]
# At a singular pose constructed from the expression, the normals do meet (MMT Fig. 8):

# %%
robot, example = derived["3rrr_m1"].robot, condition.examples[0]
at = example.configuration


def now(link, point):
    """Position at the singular pose of a point of a link that is given at the zero configuration."""
    X = at.pose(link) @ np.linalg.inv(robot.links[link].pose)
    return (X @ np.append(point, 1.0))[:2]


figure, axes = plt.subplots(figsize=(6, 6))
normals, tips, ends = [], [], []
for i in (1, 2, 3):
    shoulder = robot.joints[f"shoulder_{i}"].point[:2]
    elbow, tip = now(f"prox_{i}", robot.joints[f"elbow_{i}"].point), now(f"dist_{i}", robot.joints[f"wrist_{i}"].point)
    normals.append((elbow - shoulder) / np.linalg.norm(elbow - shoulder))  # the tip's tangent is normal to the crank
    tips.append(tip)
    ends += [tip, shoulder]
    axes.plot(*np.array([shoulder, elbow]).T, color="0.45", lw=4)
    axes.plot(*np.array([elbow, tip]).T, color="C0", lw=2.5)
    axes.axline(tip, slope=normals[-1][1] / normals[-1][0], color="crimson", lw=1, ls="--")
axes.fill(*np.array(tips).T, color="C1", alpha=0.4)
rows = np.array([[n[1], -n[0]] for n in normals])
centre, residual, *_ = np.linalg.lstsq(rows, np.array([r @ t for r, t in zip(rows, tips, strict=True)]), rcond=None)
axes.plot(*centre, "o", color="crimson", ms=8)
reach = np.abs(np.vstack([*ends, centre])).max() + 0.03
axes.set(xlim=(-reach, reach), ylim=(-reach, reach), aspect="equal", xlabel="x (m)", ylabel="y (m)")
plt.show()
print("the normals miss a common point by", np.sqrt(residual.max(initial=0.0)), "m")
print("smallest singular value of Mᵀ there:", example.sigma)
assert residual.max(initial=0.0) < 1e-18
assert example.sigma < 1e-9

# %% [markdown]
# ## Exercises
#
# 1. Observe the *first* segment of each leg of `3rrr_m1`, the cranks, instead of the last (`observe=["prox_1",
#    "prox_2", "prox_3"]`). What is the hidden robot now, and how many modes are there? Which well-known robot is it?
# 2. `3rpr_m1` has hidden legs R̲PR, the same letters as its real legs. Does the real robot have the same
#    singularities?
# 3. Which smallest sets of legs have the largest rank (`hrsynth.legs`)? Explain the result for `3rrp` without a
#    computer.

# %% [markdown]
# ## Solutions

# %% jupyter={"source_hidden": true} tags=["solution"]
# 1. the cranks' directions are the motors' angles: the hidden robot is the real one, with its own six modes
cranks = hrsynth.derive(derived["3rrr_m1"].robot, observe=["prox_1", "prox_2", "prox_3"])
print(cranks.hidden_architecture, "  real:", cranks.architecture)
print(cranks.modes().found.complex, "complex modes; with the motors fixed:", cranks.modes(real=True).found.complex)
assert cranks.modes().found.complex == cranks.modes(real=True).found.complex == 6
assert str(cranks.hidden_architecture) == str(cranks.architecture)

# %% jupyter={"source_hidden": true} tags=["solution"]
# 2. yes: motor angle and observed direction are the same angle, so both conditions are the same
for real in (False, True):
    print(hrsynth.singularities(derived["3rpr_m1"].robot, real=real, points=100).condition.expression)

# %% jupyter={"source_hidden": true} tags=["solution"]
# 3. each leg of 3rrp measures the platform's rotation only, so any one leg has the largest rank
for name in ("3rrr_m1", "3rrp"):
    print(name, hrsynth.legs(derived[name].robot).smallest)

# %% [markdown]
# # 5. The Quattro: which legs to observe
#
# The Quattro is a fast pick-and-place robot. Four arms rotate about horizontal axes; each carries two parallel rods,
# {2-SS}. The platform has two halves whose relative motion rotates the tool. It has four dof: three translations and
# the rotation φ about the vertical. It is the example of MMT 5 and of the experiments there. Which legs should a camera
# observe to go from one pose to another?

# %%
import matplotlib.pyplot as plt
import numpy as np

import hrsynth

plt.style.use("hrsynth.present.style")
robot = hrsynth.load("quattro")
START, GOAL = "x=0,y=0,z=-0.75,phi=0", "x=-0.2,y=0,z=-0.56,phi=0"
print(hrsynth.legs(robot))

# %% [markdown]
#
# Two directions are four numbers, and the platform has four dof. Yet not every pair is enough. Legs 1 and 2 are
# attached to one half of the platform, 3 and 4 to the other. Observing both legs of one half does not show how the
# other half rotates about its revolute joint. One leg on each half is needed, which leaves four pairs.
#
# (The paper counts six, in MMT 5.1.2 and A.2. Pairs on one half have a hidden robot of the same notation, 2-Π-{2-U̲U},
# but the other half of the platform is not controlled.)

# %%
for pair in (["1", "2"], ["1", "4"]):
    found = hrsynth.derive(robot, observe=pair)
    print(pair, found.hidden_architecture, f"rank {found.verdict.rank} of {found.dof}", found.verdict.verdict)
    assert str(found.hidden_architecture) == "2-Π-{2-U̲U}"
    assert found.verdict.rank == (3 if pair == ["1", "2"] else 4)

# %% [markdown]
# In each observed leg the arm becomes a parallelogram. The unobserved legs are removed once the end joints of the
# observed ones are changed:

# %%
hidden = hrsynth.derive(robot, observe=["1", "4"])
hidden

# %%
hrsynth.draw(hidden)

# %% [markdown]
# The last rows of the table follow MMT 4.2.2. Leg removal alone is not possible: without the unobserved legs the
# platform gains dof. With the end-joint change, universal joints replace the spherical joints at the platform, and it
# does not.
#
# ## Assembly modes
#
#
# With its direction fixed, the tip of a leg moves on a circle, that of its parallelogram. The platform has its own
# circle: as its halves rotate on each other, the second revolute joint moves on a horizontal circle about the first.
#
# Translated along the circle of one leg, that circle sweeps a surface that MMT 4.2.2 calls a Bohemian dome. It is of
# degree four, so the circle of the other leg meets it in at most eight points: the modes. The goal of the paper's first
# simulation (MMT 5.1.3), for two of the pairs:

# %%
pairs = {legs: hrsynth.derive(robot, observe=list(legs)) for legs in ("14", "23")}
for legs, each in pairs.items():
    found = each.modes(at=GOAL)
    print(f"legs {legs[0]}, {legs[1]}: {len(found.modes)} real modes of {found.found.complex}")
    for number, mode in enumerate(found.modes, 1):
        print(
            f"   {number}  {mode.pose!s:52}",
            "the goal"
            if mode.goal
            else "reachable"
            if mode.reachable
            else "the real robot cannot be assembled there: legs " + ", ".join(mode.unclosed_legs),
        )
unclosed = [set(mode.unclosed_legs) for mode in pairs["23"].modes(at=GOAL).modes if not (mode.goal or mode.reachable)]
assert unclosed == [{"1", "4"}, {"1", "4"}]
hrsynth.draw(pairs["14"].modes(at=GOAL))

# %% [markdown]
# The other two legs decide whether the real robot can be assembled. With legs 2 and 3 observed, two of the modes are
# harmless: legs 1 and 4 do not reach that far.
#
# ## Servo runs
#
# Are both pairs equally good? Same start, same goal, same control law:

# %%
runs = {legs: hrsynth.servo(robot, list(legs), start=START, goal=GOAL) for legs in ("14", "23")}
for run in runs.values():
    metres, radians = run.from_goal
    distance = f"{1e3 * metres:.1f} mm and {np.degrees(radians):.1f}° from the goal"
    print(f"legs {', '.join(run.setup.labels)}: {run.outcome}, {distance}")
assert [run.outcome == "goal" for run in runs.values()] == [False, True]
hrsynth.draw(runs["14"])

# %% [markdown]
#
# With legs 1 and 4 the directions reach their desired values but the robot does not reach the goal: it stops at another
# assembly mode. The same happens in the paper (MMT Figs. 22 and 23). MMT 3.3 explains it by aspects: start and goal
# must lie in one.
#
# For legs 2 and 3 that is proved, by a straight path. For legs 1 and 4 a path without Type 2 singularity exists too.
# But at its end both legs are in their other working modes, where their directions are not the desired ones. So the
# controller cannot use it, and it does not prove that there is no other:

# %%
for legs in ("14", "23"):
    answer = hrsynth.path(robot, list(legs), start=START, goal=GOAL)
    print(f"legs {', '.join(legs)}: {answer.verdict}. {answer.reason}")
    assert answer.verdict == "same aspect"
    assert ("in the other working mode of leg 1, 4" in answer.reason) == (legs == "14")
print()
print(hrsynth.singularities(robot, ["1", "4"], points=200).words)

# %% [markdown]
# The paper also prints the poses of the modes. They differ slightly from those that its dimensions give: the second
# mode of legs 1 and 4 is printed at z = −0.909 (MMT 5.1.3). Here is the proved one:

# %%
second = next(mode for mode in pairs["14"].modes(at=GOAL).modes if not mode.goal and abs(mode.pose.rpy[2]) < 1e-6)
print(second.pose, " within", second.radius)
print("printed minus computed:", round(1e3 * (-0.909 - second.pose.z), 1), "mm")
assert abs(-0.909 - second.pose.z) > 0.005

# %% [markdown]
# ## Accuracy
#
# Cameras are not exact. If each direction has an error of up to 0.1°, how large can the error of the platform be? To
# first order it is $\delta t = M^{T+} \delta u$ (MMT Appendix A.1). The largest one for all $\delta u$ inside the cones
# is computed exactly for two legs. A map over the plane z = −0.7 m with φ = 0, as in MMT Figs. 19 and 20:

# %%
maps = {
    legs: hrsynth.accuracy(robot, list(legs), cone="0.1deg", grid="x=-0.5:0.5:81,y=-0.5:0.5:81,z=-0.7,phi=0")
    for legs in ("23", "24")
}
for legs, found in maps.items():
    errors = 1e3 * found.field.position[np.isfinite(found.field.position)]
    print(f"legs {legs[0]}, {legs[1]}: median {np.median(errors):.2f} mm over the plane, least {errors.min():.2f} mm")
hrsynth.draw(maps["23"])

# %%
hrsynth.draw(maps["24"])

# %% [markdown]
# In the first map the white curve is a singularity of the hidden robot, and the error grows without bound towards it.
# The second map has no such curve. The better pair depends on the region where the robot works.
#
# ## Choose
#
# MMT Appendix A.2 proposes an order. Discard sets of legs for which start and goal are not in one aspect; rank the
# others by accuracy; simulate the best (omitted here with `runs=0`: the run is above). `select` does it. First it
# discards sets that do not observe all dof or are singular at start or goal. Before accuracy it ranks by the other
# equilibria of the loop (omitted with `equilibria=0`):

# %%
best = hrsynth.select(robot, start=START, goal=GOAL, size=2, runs=0, equilibria=0)
best

# %% [markdown]
# ## More legs, and a local minimum
#
# Why not observe all four legs? Then eight numbers determine four dof, other modes are almost excluded, and the error
# tends to become smaller (MMT A.2). But with more equations than dof the error may have *local minima*. There the
# desired directions are not reached, and yet every small motion makes the error larger. The command vanishes there, and
# the robot stops.
#
# MMT 5.1.3 prints such a run (Figs. 26 and 27). With the printed dimensions it does not stop:

# %%
printed = hrsynth.servo(robot, start="x=0.028,y=0,z=-0.617,phi=0", goal="x=-0.6,y=0,z=-0.8,phi=0")
print(printed.outcome, "at", printed.pose)
assert printed.outcome == "goal"

# %% [markdown]
# But such runs exist. A search over random starts and goals found this one:

# %%
stuck = hrsynth.servo(robot, start="x=-0.3,y=0,z=-0.6,phi=0", goal="x=0.05,y=0.07,z=-0.52,phi=0")
assert stuck.outcome == "local minimum"
stuck

# %% [markdown]
# Is it a minimum? Compute the error at poses from the final pose to the goal, and at poses near the final pose.
# (`batch` gives the directions of many poses at once.)

# %%
setup = stuck.setup
X, Y = (at.pose(setup.motion.link) for at in (stuck.settled, stuck.target))


def rotated(X, angle):
    """A pose, rotated about the vertical."""
    c, s = np.cos(angle), np.sin(angle)
    moved = X.copy()
    moved[:3, :3] = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]) @ X[:3, :3]
    return moved


def shifted(X, by):
    """A pose, translated by a vector."""
    moved = X.copy()
    moved[:3, 3] += by
    return moved


def error_norm(poses):
    """‖e‖ of the eight numbers at each pose."""
    goal = setup.batch.evaluate(Y[None]).directions[0]
    return np.linalg.norm(np.cross(setup.batch.evaluate(np.array(poses)).directions, goal), axis=(1, 2))


angle = np.arctan2(X[1, 0], X[0, 0])
part = np.linspace(-0.3, 1.3, 161)
path = [shifted(rotated(X, -angle * s), s * (Y - X)[:3, 3]) for s in part]
figure, axes = plt.subplots(figsize=(7, 4))
axes.plot(part, error_norm(path))
axes.plot([0, 1], error_norm([X, Y]), "o", color="crimson")
axes.annotate("stopped here", (0, error_norm([X])[0]), xytext=(0, 20), textcoords="offset points", ha="center")
axes.annotate("goal", (1, 0), xytext=(14, 4), textcoords="offset points")
axes.set(xlabel="fraction of the distance to the goal", ylabel="‖e‖", ylim=(0, None))
plt.show()

# %%
steps = [shifted(X, s * axis) for s in (1e-3, -1e-3) for axis in np.eye(3)] + [rotated(X, s) for s in (0.01, -0.01)]
growth = error_norm(steps) - error_norm([X])
print("‖e‖ at the final pose:", error_norm([X])[0])
print("change by one millimetre, or 0.01 rad, in each direction:", growth.round(7))
assert (growth > 0).all()

# %% [markdown]
# Every step makes it larger. So more legs do not solve every problem. The rank does not show local minima: at this pose
# Mᵀ has full rank.

# %%
print(stuck.run.commands[-1].values)
assert min(stuck.run.commands[-1].values) > 0.05

# %% [markdown]
# ## Exercises
#
# 1. The rigid Quattro (`quattro_rigid`) has a platform of one link and three dof. Which pairs of legs are enough now?
#    Count the modes for neighbouring and for opposite legs.
# 2. With noise the run of legs 2 and 3 keeps moving near the goal. Run it with `noise="0.1deg"`. Compare its deviation
#    with the largest error that `accuracy` gives at the goal.
# 3. In the paper, one observed leg on each half is singular where the legs' planes are parallel. `singularities` gives
#    another condition. Show that the paper's is a special case of it.

# %% [markdown]
# ## Solutions

# %% jupyter={"source_hidden": true} tags=["solution"]
# 1. all pairs: two tangents are never parallel in general, and a translating platform is singular only then
rigid = hrsynth.load("quattro_rigid")
print(hrsynth.legs(rigid).smallest)
assert str(hrsynth.legs(rigid).smallest).count("{") == 6
for pair in (["1", "2"], ["1", "3"]):
    print(pair, hrsynth.modes(rigid, pair, at="x=0,y=-0.25,z=-0.7").found.complex, "complex modes")

# %% jupyter={"source_hidden": true} tags=["solution"]
# 2. the loop averages the noise: it deviates less than a single measurement with that error would move it
noisy = hrsynth.servo(robot, ["2", "3"], start=START, goal=GOAL, noise="0.1deg")
bound = hrsynth.accuracy(robot, ["2", "3"], cone="0.1deg", at=[GOAL]).poses[0].position.largest
print(f"deviation {1e3 * noisy.spread.rms_metres:.2f} mm (root mean square)")
print(f"largest first-order error {1e3 * bound:.2f} mm")
assert noisy.spread.rms_metres < bound

# %% jupyter={"source_hidden": true} tags=["solution"]
# 3. the planes of MMT have the tangents as their normals: parallel planes are parallel tangents, and a determinant with
#    two parallel vectors is zero; but it is zero too wherever e, τ1 and τ4 lie in one plane
print(hrsynth.singularities(robot, ["1", "4"], points=50).condition.expression)

# %% [markdown]
# # 5. The Quattro: which legs to watch
#
# The Quattro is a fast pick-and-place robot. Four arms turn about horizontal axes; two parallel rods, {2-SS}, hang on
# each; the platform has two halves whose relative motion turns the tool. It has four freedoms: three translations and
# the turn φ about the vertical. It is the example of MMT 5 and of the experiments there. This notebook asks: which
# legs should a camera watch to go from one pose to another?

# %%
import matplotlib.pyplot as plt
import numpy as np

import hrsynth

plt.style.use("hrsynth.present.style")
robot = hrsynth.load("quattro")
START, GOAL = "x=0,y=0,z=-0.75,phi=0", "x=-0.2,y=0,z=-0.56,phi=0"
print(hrsynth.legs(robot))

# %% [markdown]
# Two directions are four numbers, and the platform has four freedoms. Yet not every pair will do. Legs 1 and 2 hang on
# the same half of the platform, 3 and 4 on the other. Watching both legs of one half does not show how the other half
# turns about the hinge. One leg on each half is needed, which leaves four pairs. (The paper counts six, in MMT 5.1.2
# and A.2: pairs on one half have a hidden robot of the same letters, 2-Π-{2-U̲U}, but the platform's other half hangs
# free on it.)

# %%
for pair in (["1", "2"], ["1", "4"]):
    found = hrsynth.derive(robot, observe=pair)
    print(pair, found.hidden_architecture, f"rank {found.verdict.rank} of {found.dof}", found.verdict.verdict)
    assert str(found.hidden_architecture) == "2-Π-{2-U̲U}"
    assert found.verdict.rank == (3 if pair == ["1", "2"] else 4)

# %% [markdown]
# In each watched leg the arm becomes a parallelogram, and the legs that are not
# watched disappear, once the ends of the watched ones are changed:

# %%
hidden = hrsynth.derive(robot, observe=["1", "4"])
hidden

# %%
hrsynth.draw(hidden)

# %% [markdown]
# The rows `leg removal … no` and `end change … yes` at the end retrace MMT 4.2.2. If the legs that are not watched are
# simply dropped, the platform gains freedoms that it must not have. With universal joints in place of balls at the
# platform, it does not.
#
# ## Assembly modes
#
# With its direction held, the tip of a leg moves on a circle, that of its parallelogram. The platform has a circle of
# its own: as its halves turn on each other, the second hinge runs on a horizontal circle about the first. That circle,
# carried along the circle of one leg, sweeps a surface that MMT 4.2.2 calls a Bohemian dome. It is of degree four, so
# the circle of the other leg meets it in at most eight points: the modes. The goal of the paper's first simulation
# (MMT 5.1.3), for two of the pairs:

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
            else "the real robot cannot be assembled there: legs " + ", ".join(mode.open),
        )
beyond = [set(mode.open) for mode in pairs["23"].modes(at=GOAL).modes if not (mode.goal or mode.reachable)]
assert beyond == [{"1", "4"}, {"1", "4"}]
hrsynth.draw(pairs["14"].modes(at=GOAL))

# %% [markdown]
# The other two legs decide whether the real robot fits. With legs 2 and 3 watched, two of the modes are nothing to
# worry about: legs 1 and 4 do not reach that far.
#
# ## Servo runs
#
# One might think that both pairs are equally good. Same start, same goal, same control law:

# %%
runs = {legs: hrsynth.servo(robot, list(legs), start=START, goal=GOAL) for legs in ("14", "23")}
for run in runs.values():
    metres, radians = run.from_goal
    away = f"{1e3 * metres:.1f} mm and {np.degrees(radians):.1f}° from the goal"
    print(f"legs {', '.join(run.setup.labels)}: {run.outcome}, {away}")
assert [run.outcome for run in runs.values()] == ["mode", "goal"]
hrsynth.draw(runs["14"])

# %% [markdown]
# With legs 1 and 4 the directions reach their desired values but the robot does not reach the goal: it stops at
# another assembly mode. The same happens in the paper (MMT Figs. 22 and 23). MMT 3.3 explains it by aspects: start and
# goal must lie in one. Of legs 2 and 3 that is proved, by a straight path. For legs 1 and 4 a path without Type 2
# singularity exists too, but at its end both legs are in their other working modes, where their directions are not the
# desired ones. So it is no way for the controller, and no proof that there is none:

# %%
for legs in ("14", "23"):
    answer = hrsynth.path(robot, list(legs), start=START, goal=GOAL)
    print(f"legs {', '.join(legs)}: {answer.verdict}. {answer.reason}")
    assert answer.verdict == "same aspect"
    assert ("in the other working mode of leg 1, 4" in answer.reason) == (legs == "14")
print()
print(hrsynth.singularities(robot, ["1", "4"], points=200).words)

# %% [markdown]
# The paper prints digits of the modes too. They are not quite those that its own dimensions give: the second mode of
# legs 1 and 4 is printed at z = −0.909 (MMT 5.1.3). Here it is, with a proof:

# %%
second = next(mode for mode in pairs["14"].modes(at=GOAL).modes if not mode.goal and abs(mode.pose.rpy[2]) < 1e-6)
print(second.pose, " within", second.radius)
print("printed minus computed:", round(1e3 * (-0.909 - second.pose.z), 1), "mm")
assert abs(-0.909 - second.pose.z) > 0.005

# %% [markdown]
# ## Accuracy
#
# Cameras are not exact. If each direction may be off by 0.1°, how far may the platform be off? To first order the
# error is $\delta t = M^{T+} \delta u$ (MMT Appendix A.1), and the largest one for all $\delta u$ inside the cones is
# found exactly for two legs. A map over the plane z = −0.7 m with φ = 0, as in MMT Figs. 19 and 20:

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
# The map of the second pair shows no such curve. Which pair is better depends on where the robot works.
#
# ## Choose
#
# MMT Appendix A.2 puts all this in an order: throw away sets of legs for which start and goal are not in one aspect;
# rank the rest by accuracy; simulate the best (left out here with `runs=0`: the run is above). `select` does it, and
# first throws away sets that do not see everything or are singular at an end; before accuracy it ranks by where else
# the loop may end (left out with `endings=0`):

# %%
best = hrsynth.select(robot, start=START, goal=GOAL, size=2, runs=0, endings=0)
best

# %% [markdown]
# ## More legs, and a local minimum
#
# Why not watch all four legs? Then eight numbers fix four freedoms, wrong modes are almost ruled out, and the error
# tends to become smaller (MMT A.2). But this has a price. With more equations than freedoms the error may have *local
# minima*: poses where the wanted directions are not reached and yet every small motion makes the error larger. The
# command vanishes there, and the robot stops.
#
# MMT 5.1.3 prints such a run (Figs. 26 and 27). With the printed dimensions it does not stop:

# %%
printed = hrsynth.servo(robot, start="x=0.028,y=0,z=-0.617,phi=0", goal="x=-0.6,y=0,z=-0.8,phi=0")
print(printed.outcome, "at", printed.pose)
assert printed.outcome == "goal"

# %% [markdown]
# But the phenomenon is real. A search over random starts and goals found this run:

# %%
stuck = hrsynth.servo(robot, start="x=-0.3,y=0,z=-0.6,phi=0", goal="x=0.05,y=0.07,z=-0.52,phi=0")
assert stuck.outcome == "local minimum"
stuck

# %% [markdown]
# Is it a minimum? Take the poses from where it stopped to the goal, and a little to every side of where it stopped,
# and measure the error at each. (`batch` gives the directions of many poses at once.)

# %%
setting = stuck.setup
X, Y = (at.pose(setting.motion.link) for at in (stuck.settled, stuck.target))


def turned(X, angle):
    """A pose, turned about the vertical."""
    c, s = np.cos(angle), np.sin(angle)
    moved = X.copy()
    moved[:3, :3] = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]) @ X[:3, :3]
    return moved


def shifted(X, by):
    """A pose, moved by a vector."""
    moved = X.copy()
    moved[:3, 3] += by
    return moved


def size(poses):
    """‖e‖ of the eight numbers at each pose."""
    goal = setting.batch.evaluate(Y[None]).directions[0]
    return np.linalg.norm(np.cross(setting.batch.evaluate(np.array(poses)).directions, goal), axis=(1, 2))


angle = np.arctan2(X[1, 0], X[0, 0])
part = np.linspace(-0.3, 1.3, 161)
way = [shifted(turned(X, -angle * s), s * (Y - X)[:3, 3]) for s in part]
figure, place = plt.subplots(figsize=(7, 4))
place.plot(part, size(way))
place.plot([0, 1], size([X, Y]), "o", color="crimson")
place.annotate("stopped here", (0, size([X])[0]), xytext=(0, 20), textcoords="offset points", ha="center")
place.annotate("goal", (1, 0), xytext=(14, 4), textcoords="offset points")
place.set(xlabel="part of the way to the goal", ylabel="‖e‖", ylim=(0, None))
plt.show()

# %%
steps = [shifted(X, s * axis) for s in (1e-3, -1e-3) for axis in np.eye(3)] + [turned(X, s) for s in (0.01, -0.01)]
growth = size(steps) - size([X])
print("‖e‖ where it stopped:", size([X])[0])
print("change one millimetre, or 0.01 rad, to each side:", growth.round(7))
assert (growth > 0).all()

# %% [markdown]
# Every step makes it worse. So more legs do not cure everything. No rank shows that
# there are no local minima: at this pose Mᵀ has full rank.

# %%
print(stuck.run.commands[-1].values)
assert min(stuck.run.commands[-1].values) > 0.05

# %% [markdown]
# ## Exercises
#
# 1. The rigid Quattro (`quattro_rigid`) has a platform in one piece and three freedoms. Which pairs of legs will do
#    now? Count the modes for neighbouring and for opposite legs.
# 2. With noise the run of legs 2 and 3 does not stand still at the goal. Run it with `noise="0.1deg"` and compare how
#    far it strays with the largest error that `accuracy` gives at the goal.
# 3. The paper says that one watched leg on each half is singular where the legs' planes are parallel. `singular`
#    gives another condition. Show that the paper's is a special case of it.

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
# 2. the loop averages the noise: it strays less than a single wrong picture could move it
noisy = hrsynth.servo(robot, ["2", "3"], start=START, goal=GOAL, noise="0.1deg")
bound = hrsynth.accuracy(robot, ["2", "3"], cone="0.1deg", at=[GOAL]).poses[0].position.largest
print(f"strays by {1e3 * noisy.spread.rms_metres:.2f} mm (root mean square)")
print(f"largest first-order error {1e3 * bound:.2f} mm")
assert noisy.spread.rms_metres < bound

# %% jupyter={"source_hidden": true} tags=["solution"]
# 3. the planes of MMT have the tangents as their normals: parallel planes are parallel tangents, and a determinant with
#    two parallel vectors is zero; but it is zero too wherever e, τ1 and τ4 lie in one plane
print(hrsynth.singularities(robot, ["1", "4"], points=50).condition.expression)

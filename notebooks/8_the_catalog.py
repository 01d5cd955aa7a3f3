# %% [markdown]
# # 8. Reading the catalog
#
# The robots of the previous notebooks are those of the papers. The catalog has a hundred thousand more architectures:
# planar robots, pods, deltas and spatial ones. Each has its hidden robot, its verdict and the legs to observe. This
# notebook makes one query and reads the result with care:
#
# > Which robots with three translations and motors on the base can be servoed from two observed legs?

# %%
from collections import Counter

import matplotlib.pyplot as plt
import numpy as np

import hrsynth
from hrsynth.catalog.architecture_key import parse
from hrsynth.catalog.drawing import draw_architecture
from hrsynth.catalog.geometry import build_mechanism

plt.style.use("hrsynth.present.style")
catalog = hrsynth.catalog.load()
print(len(catalog), "architectures")
assert len(catalog) > 100_000
for (group, verdict), count in catalog.count("group", "verdict").items():
    print(f"   {group:10}{verdict or 'refused':24}{count}")

# %% [markdown]
# An architecture has a key. It gives the joints of each leg, the directions of their axes, and the motors (`*`), but no
# lengths. Here is the Delta:

# %%
print(draw_architecture(parse("3(Rt*-2SSt)")))
delta = catalog["3(Rt*-2SSt)"]
for name in ("key", "notation", "motion", "hidden", "verdict", "exact", "fewest", "minimal", "condition"):
    print(f"{name:12}{delta.get(name)}")

# %% [markdown]
# `Rt` is a revolute joint with a tangential axis at the leg's base, and `2SSt` two parallel rods with their spherical
# joints side by side along that direction. The verdict does not belong to one geometry. *Exact* means that ranks were
# computed in integers, at a rational instance: a random geometry with the incidences of the key. If the verdict is
# *controllable*, that proves it for almost all geometries of the architecture.
#
# ## The query
#
# Three translations are `motion="3T"`. `base_motors` requires that every motor is on the base. `fewest` is the number
# of legs in the smallest set with the largest rank. The motors should also actuate all three dof, `driven`:

# %%
fitting = catalog.where(dof=3, motion="3T", base_motors=True, verdict="controllable", fewest=2)
driven = [record for record in fitting if record["driven"]]
print(len(fitting), "architectures,", len(driven), "of them with all three dof actuated")

# %% [markdown]
# There are so many because the catalog combines different legs in one robot. Most published robots have equal legs:

# %%
equal = [record for record in driven if "+" not in record["key"] and "|" not in record["key"]]
print(f"{'key':36}{'notation':18}{'hidden robot':34}{'legs':6}needed")
for record in equal:
    sets = "  ".join("{" + ", ".join(each) + "}" for each in record["minimal"])
    print(f"{record['key']:36}{record['notation']:18}{record['hidden']:34}{record['legs']:<6}{sets}")

# %% [markdown]
# ## How common is it?
#
# For translational robots with motors on the base, how many legs must be observed?

# %%
translational = [record for record in catalog.where(dof=3, motion="3T", base_motors=True) if record.get("driven")]
counts = Counter((record["verdict"], record["fewest"]) for record in translational)
for (verdict, fewest), count in sorted(counts.items()):
    print(f"{count:5} {verdict}, with {fewest} legs observed")
figure, axes = plt.subplots(figsize=(6, 3.2))
colours = {"controllable": "tab:green", "partially controllable": "tab:orange", "uncontrollable": "tab:red"}
for verdict, colour in colours.items():
    sizes = sorted({fewest for each, fewest in counts if each == verdict})
    axes.bar([str(size) for size in sizes], [counts[verdict, size] for size in sizes], color=colour, label=verdict)
axes.set(xlabel="legs of the smallest set", ylabel="architectures")
axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
plt.show()
assert counts["controllable", 3] > counts["controllable", 2]

# %% [markdown]
# Fewer than two legs are never enough: a direction is two numbers, and there are three dof. Most of the controllable
# robots here need three. In the robots that are not controllable a twist stays unobserved with any set of legs. The
# entry names the twist and suggests a measurement:

# %%
for record in [each for each in translational if each["verdict"] != "controllable"][:8]:
    print(f"{record['key']:42}unobserved: {'; '.join(record['unobserved'])}; suggestion: {record.get('suggestion')}")

# %% [markdown]
# ## What all verdicts have in common
#
# Which legs make a robot controllable? Robots with equal legs, by the joints of a leg:

# %%
verdicts = {}
for record in catalog.where(group="spatial"):
    chain = {"".join(joint.letter for joint in leg.joints) for leg in parse(record["key"]).legs}
    if len(chain) == 1 and record.get("verdict"):
        verdicts.setdefault(chain.pop(), Counter())[record["verdict"]] += 1
names = sorted(verdicts, key=lambda name: verdicts[name]["controllable"] / verdicts[name].total())
figure, axes = plt.subplots(figsize=(6, 6.5))
left = [0.0] * len(names)
for verdict, colour in colours.items():
    share = [100 * verdicts[name][verdict] / verdicts[name].total() for name in names]
    axes.barh(names, share, left=left, color=colour, label=verdict)
    left = [a + b for a, b in zip(left, share, strict=True)]
axes.set(xlabel="architectures of the group spatial (%)", xlim=(0, 100))
axes.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=3)
plt.show()

# %% [markdown]
# The direction of a link that only translates is constant, so prismatic joints make control harder. But there are
# exceptions. Some chains with a prismatic joint are always controllable, and so are half of the architectures with RPPR
# legs, which have two:

# %%
for prismatic in range(3):
    some = [verdicts[name] for name in names if name.count("P") - name.count("Pi") == prismatic]
    share = sum(each["controllable"] for each in some) / sum(each.total() for each in some)
    print(f"{prismatic} prismatic joints: {100 * share:.0f} % controllable")
always = [name for name in names if verdicts[name]["controllable"] == verdicts[name].total()]
print("always controllable:", *always)
assert {"RRPR", "RPRR"} <= {*always}
assert 2 * verdicts["RPPR"]["controllable"] == verdicts["RPPR"].total()

# %% [markdown]
# For planar robots the rank is given by a theorem, with its proof on the page *What the catalog shows*. While an
# observed direction is fixed, the instantaneous centre of the platform stays on a line. The rank of the legs is the
# rank of their lines. Here is a test on a 3-RRR with random joints; the observed link follows the second R:

# %%
rng = np.random.default_rng(0)
lines = []
for _ in range(3):
    centres = rng.normal(size=(3, 2))
    twists = np.array([[1.0, y, -x] for x, y in centres]).T
    rotating = np.array([[1.0, 1.0, 0.0]])
    kept = twists @ np.linalg.svd(rotating)[2][1:].T
    lines.append(np.linalg.svd(kept)[0][:, 2])
print("rank", np.linalg.matrix_rank(np.array(lines)), "of 3;", catalog["3(Rz*-Rz-Rz)"]["verdict"])
assert np.linalg.matrix_rank(np.array(lines)) == 3
assert catalog["3(Rz*-Rz-Rz)"]["verdict"] == "controllable"

# %% [markdown]
# ## From a key to a robot
#
# A key has no lengths. `mechanism` chooses random ones, always the same for a key, and builds a robot. Everything that
# the previous notebooks did with a file can be done with it. Is the catalog right?

# %%
robot = build_mechanism(parse("3(Rt*-2SSt)"), delta.get("attempt", 0))
hidden = hrsynth.derive(robot, observe=delta["minimal"][0])
print(hidden.hidden_architecture, "–", hidden.verdict.verdict, "–", hidden.equivalence)
assert hidden.verdict.verdict == delta["verdict"]
hrsynth.draw(hidden)

# %% [markdown]
# The shipped Delta has the same key, with the paper's dimensions, and the same verdicts. (If legs are equal, the
# catalog names one set for all equivalent ones.)

# %%
shipped = hrsynth.legs(hrsynth.load("delta"))
print(shipped.smallest, " / ", delta["minimal"])

# %% [markdown]
# ## Exercises
#
# 1. Which robots of the group `pods` with equal legs have three translations, with motors anywhere?
# 2. Which planar robots with three equal legs (`3(…)`) are controllable? Compare with the table of notebook 3.
# 3. Take a key from the list of robots that are not controllable, build a robot of it, and let `advise` find a
#    suggestion. Is it that of the catalog?

# %% [markdown]
# ## Solutions

# %% jupyter={"source_hidden": true} tags=["solution"]
# 1. equal legs: no sum of legs in the key
for record in catalog.where(group="pods", motion="3T"):
    if "+" not in record["key"]:
        print(f"{record['key']:28}{record['notation']:14}{record['verdict']:24}{record['fewest']} legs")

# %% jupyter={"source_hidden": true} tags=["solution"]
# 2. the notation does not decide: 3-P*RR is in all three lists. What decides is the observed link (!) and whether the
#    rails are parallel (Px, not Ph). In notebook 3 the rails are not parallel and the last link is observed.
planar = [record for record in catalog.where(group="planar", dof=3, legs=3) if "+" not in record["key"]]
for verdict in ("controllable", "partially controllable", "uncontrollable"):
    listed = sorted({record["notation"] for record in planar if record["verdict"] == verdict})
    print(f"{verdict:24}", *listed)
    assert "3-P*RR" in listed

# %% jupyter={"source_hidden": true} tags=["solution"]
# 3. the catalog keeps one of the smallest sets, advise lists all of them
record = next(each for each in translational if each["verdict"] != "controllable" and each.get("suggestion"))
advice = hrsynth.advise(build_mechanism(parse(record["key"]), record.get("attempt", 0)))
print(record["key"], "– catalog:", record["suggestion"])
print(advice)

# %% [markdown]
# # 8. Reading the catalog
#
# The robots of the previous notebooks are those of the papers. The catalog has a hundred thousand architectures more:
# planar robots, pods, deltas and spatial ones, each with its hidden robot, its verdict and the legs to be watched.
# This notebook puts one question to it, and reads the answer with care:
#
# > Which robots with three translations and motors on the base can be servoed from two observed legs?

# %%
from collections import Counter

import matplotlib.pyplot as plt
import numpy as np

import hrsynth
from hrsynth.catalog.architecture_key import parse
from hrsynth.catalog.drawing import drawing
from hrsynth.catalog.geometry import mechanism

plt.style.use("hrsynth.present.style")
catalog = hrsynth.catalog.load()
print(len(catalog), "architectures")
assert len(catalog) > 100_000
for (group, verdict), count in catalog.count("group", "verdict").items():
    print(f"   {group:10}{verdict or 'refused':24}{count}")

# %% [markdown]
# An architecture is a word. It gives the joints of each leg, how their axes lie, and which have motors (`*`), but no
# lengths. Here is the Delta:

# %%
print(drawing(parse("3(Rt*-2SSt)")))
delta = catalog["3(Rt*-2SSt)"]
for name in ("word", "notation", "motion", "hidden", "verdict", "exact", "fewest", "minimal", "condition"):
    print(f"{name:12}{delta.get(name)}")

# %% [markdown]
# `Rt` is a revolute joint whose axis is tangential at the leg's foot, `2SSt` the two parallel rods with their balls
# apart along the same direction. The verdict does not belong to one geometry. *Exact* means that ranks were taken in
# whole numbers, at a random geometry with the word's relations; where the verdict is *controllable* that proves it
# for almost all geometries of the word.
#
# ## The question
#
# Three translations are `motion="3T"`. `base_motors` says that every motor stands on the base. `fewest` is the number
# of legs in the smallest set that sees all that can be seen. The motors should also drive all three freedoms,
# `driven`:

# %%
fitting = catalog.where(dof=3, motion="3T", base_motors=True, verdict="controllable", fewest=2)
driven = [record for record in fitting if record["driven"]]
print(len(fitting), "architectures fit,", len(driven), "of them are driven in all three freedoms")

# %% [markdown]
# There are so many because the catalog mixes legs of different kinds in one robot. Robots with equal legs are the
# usual ones:

# %%
equal = [record for record in driven if "+" not in record["word"] and "|" not in record["word"]]
print(f"{'word':36}{'notation':18}{'hidden robot':34}{'legs':6}needed")
for record in equal:
    sets = "  ".join("{" + ", ".join(each) + "}" for each in record["minimal"])
    print(f"{record['word']:36}{record['notation']:18}{record['hidden']:34}{record['legs']:<6}{sets}")

# %% [markdown]
# ## How common is it?
#
# Of all translational robots with motors on the base, how many legs must be watched?

# %%
wanted = [record for record in catalog.where(dof=3, motion="3T", base_motors=True) if record.get("driven")]
counts = Counter((record["verdict"], record["fewest"]) for record in wanted)
for (verdict, fewest), count in sorted(counts.items()):
    print(f"{count:5} {verdict}, with {fewest} legs watched")
figure, place = plt.subplots(figsize=(6, 3.2))
colours = {"controllable": "tab:green", "partially controllable": "tab:orange", "uncontrollable": "tab:red"}
for verdict, colour in colours.items():
    sizes = sorted({fewest for each, fewest in counts if each == verdict})
    place.bar([str(size) for size in sizes], [counts[verdict, size] for size in sizes], color=colour, label=verdict)
place.set(xlabel="legs of the smallest set", ylabel="architectures")
place.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
plt.show()
assert counts["controllable", 3] > counts["controllable", 2]

# %% [markdown]
# Fewer than two legs can never do: a direction is two numbers, and there are three freedoms. Most of the controllable
# robots here need three. The robots that are not controllable lose a freedom whatever is watched. The field `lost` says
# which, and `cure` what would help:

# %%
for record in [each for each in wanted if each["verdict"] != "controllable"][:8]:
    print(f"{record['word']:42}loses {'; '.join(record['lost'])}; cure: {record.get('cure')}")

# %% [markdown]
# ## What all of them say
#
# Which legs make a robot controllable? Robots with equal legs, by the joints of a leg:

# %%
verdicts = {}
for record in catalog.where(group="spatial"):
    chain = {"".join(joint.letter for joint in leg.joints) for leg in parse(record["word"]).legs}
    if len(chain) == 1 and record.get("verdict"):
        verdicts.setdefault(chain.pop(), Counter())[record["verdict"]] += 1
names = sorted(verdicts, key=lambda name: verdicts[name]["controllable"] / verdicts[name].total())
figure, place = plt.subplots(figsize=(6, 6.5))
left = [0.0] * len(names)
for verdict, colour in colours.items():
    share = [100 * verdicts[name][verdict] / verdicts[name].total() for name in names]
    place.barh(names, share, left=left, color=colour, label=verdict)
    left = [a + b for a, b in zip(left, share, strict=True)]
place.set(xlabel="architectures of the group spatial (%)", xlim=(0, 100))
place.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=3)
plt.show()

# %% [markdown]
# A link that only slides has a direction that says nothing, so slides make it harder. But the order is not strict: some
# chains with a slide are always controllable, and half of the architectures with RPPR legs are, which have two:

# %%
for slides in range(3):
    some = [verdicts[name] for name in names if name.count("P") - name.count("Pi") == slides]
    share = sum(each["controllable"] for each in some) / sum(each.total() for each in some)
    print(f"{slides} slides: {100 * share:.0f} % controllable")
always = [name for name in names if verdicts[name]["controllable"] == verdicts[name].total()]
print("always controllable:", *always)
assert {"RRPR", "RPRR"} <= {*always}
assert 2 * verdicts["RPPR"]["controllable"] == verdicts["RPPR"].total()

# %% [markdown]
# For planar robots what a leg sees is a theorem, with its proof on the page *What the catalog says*. While a watched
# direction is held, the platform's instantaneous centre stays on a line, and the legs see the rank of their
# lines. Here is a test on a 3-RRR with random joints; the watched link follows the second R:

# %%
rng = np.random.default_rng(0)
seen = []
for _ in range(3):
    centres = rng.normal(size=(3, 2))
    twists = np.array([[1.0, y, -x] for x, y in centres]).T
    turned = np.array([[1.0, 1.0, 0.0]])
    kept = twists @ np.linalg.svd(turned)[2][1:].T
    seen.append(np.linalg.svd(kept)[0][:, 2])
print("rank", np.linalg.matrix_rank(np.array(seen)), "of 3;", catalog["3(Rz*-Rz-Rz)"]["verdict"])
assert np.linalg.matrix_rank(np.array(seen)) == 3
assert catalog["3(Rz*-Rz-Rz)"]["verdict"] == "controllable"

# %% [markdown]
# ## From a word to a robot
#
# A word has no lengths. `mechanism` draws some, always the same for a word, and makes a robot of it. Everything that
# the previous notebooks did with a file can be done with it. Is the catalog right?

# %%
robot = mechanism(parse("3(Rt*-2SSt)"), delta.get("attempt", 0))
hidden = hrsynth.derive(robot, observe=delta["minimal"][0])
print(hidden.hidden_architecture, "–", hidden.verdict.verdict, "–", hidden.certificate)
assert hidden.verdict.verdict == delta["verdict"]
hrsynth.draw(hidden)

# %% [markdown]
# The shipped Delta has the same word with the paper's dimensions, and the same verdicts. (Where legs are equal, the
# catalog names one set for all that are like it.)

# %%
shipped = hrsynth.legs(hrsynth.load("delta"))
print(shipped.smallest, " / ", delta["minimal"])

# %% [markdown]
# ## Exercises
#
# 1. Which robots of the group `pods` with equal legs have three translations, wherever their motors are?
# 2. Which planar robots with three equal legs (`3(…)`) can be servoed at all? Compare with the table of notebook 3.
# 3. Take a word from the list of robots that are not controllable, make a robot of it, and let `advise` find the
#    cure. Is it that of the catalog?

# %% [markdown]
# ## Solutions

# %% jupyter={"source_hidden": true} tags=["solution"]
# 1. equal legs: no sum of legs in the word
for record in catalog.where(group="pods", motion="3T"):
    if "+" not in record["word"]:
        print(f"{record['word']:28}{record['notation']:14}{record['verdict']:24}{record['fewest']} legs")

# %% jupyter={"source_hidden": true} tags=["solution"]
# 2. the letters do not decide: 3-P*RR stands in all three lists. Which link is watched (!) and whether the slides of
#    the legs are parallel (Px, not Ph) do. In notebook 3 the slides are not parallel and the last link is watched.
planar = [record for record in catalog.where(group="planar", dof=3, legs=3) if "+" not in record["word"]]
for verdict in ("controllable", "partially controllable", "uncontrollable"):
    listed = sorted({record["notation"] for record in planar if record["verdict"] == verdict})
    print(f"{verdict:24}", *listed)
    assert "3-P*RR" in listed

# %% jupyter={"source_hidden": true} tags=["solution"]
# 3. the catalog keeps one of the smallest cures, advise lists all of them
record = next(each for each in wanted if each["verdict"] != "controllable" and each.get("cure"))
advice = hrsynth.advise(mechanism(parse(record["word"]), record.get("attempt", 0)))
print(record["word"], "– catalog:", record["cure"])
print(advice)

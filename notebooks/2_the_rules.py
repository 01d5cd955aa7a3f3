# %% [markdown]
# # 2. The rules, one by one, on a single leg
#
# How is a hidden robot found? Notebook 1 guessed it from a picture. This one follows rules, most of them from MMT 3.2,
# and checks each of their steps by numbers. The rules work on one leg after another, so a single leg shows them all.
#
# Take a leg of a six-legged robot: a motor turns a crank about a fixed axis, a universal joint connects the crank with
# a rod, and a ball joint the rod with the platform. Read from the base to the platform this is R̲US, with a line under
# the driven joint. Our robot has no other leg. Its platform hangs on a single ball joint, so what is controlled is the
# ball's centre: a point, with three freedoms.

# %%
from dataclasses import replace

import hrsynth
from hrsynth.kinematics.equivalence import check_equivalence
from hrsynth.mechanism.builder import Builder
from hrsynth.rewrite.evidence import Evidence
from hrsynth.rewrite.rule import Refusal
from hrsynth.rewrite.rules import (
    anchor_locus,
    direction_locus,
    joint_substitution,
    lift,
    motors_off,
    pi_form,
    prismatic_merge,
)
from hrsynth.rewrite.state import State


def rus(name="RUS", axis=(0, 1, 0)):
    """A crank about y, a rod on a universal joint whose first axis is given, a ball."""
    b = Builder(name)
    b.link("base")
    b.link("crank")
    b.link("rod", at=(0.3, 0, 0.1))
    b.link("platform", at=(0.4, 0.1, 0.6))
    b.joint("shoulder", "R", "base", "crank", at=(0, 0, 0), axis=(0, 1, 0), motor=True)
    b.joint("elbow", "U", "crank", "rod", at=(0.3, 0, 0.1), axis=axis, axis2=(1, -axis[0] / axis[1], 0))
    b.joint("wrist", "S", "rod", "platform", at=(0.4, 0.1, 0.6))
    return b.build(platform="platform")


leg = rus()
leg

# %% [markdown]
# ## What must stay the same
#
# The camera sees the direction u of the rod. At each configuration the joint rates that the mechanism allows make
# certain pairs possible: a velocity t of the platform, together with a rate u̇ of the direction. All these pairs form
# a linear space, the *relation* between what is controlled and what is seen:
#
# $$\rho(q) = \{\, (t, \dot u) : \dot q \in \ker A(q) \,\}$$
#
# Two robots with the same ρ, at the same pose and with the same direction, are the same to a controller that sees u. So
# ρ is what no rule may change.
#
# This is checked by numbers: at random configurations, take an orthonormal basis of ρ for each of the two robots, and
# the largest angle between the two spaces. Either it is zero up to rounding, or it is larger by many orders of
# magnitude.

# %%
setting = hrsynth.observe(leg)
evidence = Evidence(setting.decomposition, setting.samples)  # what the rules may know: how the leg moves
start = State(setting.decomposition, replace(setting.mechanism, observations=()))


def compared(state):
    """The certificate of a rewritten robot, at three configurations."""
    return check_equivalence(setting.samples, state.mechanism, count=3, complete=False)


def step(state, module, trust=False):
    """The first proposal of a rule that keeps the relation; each is printed with its angle."""
    print(module.RULE.name.upper(), "–", module.RULE.source)
    for proposal in module.RULE.proposals(state, evidence, "1", waive=trust):
        if isinstance(proposal, Refusal):
            print("   does not apply:", proposal.reason)
            continue
        found = compared(proposal.state)
        print(f"   {proposal.reason}")
        change = f"{state.architecture()}  →  {proposal.state.architecture()}"
        print(f"   {change}    angle {found.largest_angle:.1e}", found.reason)
        if found.passed or trust:
            return proposal.state
    return state


# %% [markdown]
# ## Motors off
#
# The hidden robot is driven by what the camera sees. The real motors become passive joints. They do not appear in ρ,
# which describes all motions that the loops allow, whatever drives them.

# %%
state = step(start, motors_off)

# %% [markdown]
# ## The lift
#
# Now the rod's direction needs a motor. Two angles describe a direction, so this motor is a universal joint U̲. Its
# first axis must not turn with the leg: it belongs to a link T that only translates. Three sliders PPP carry T from
# the base to the rod's end A, and behind U̲ a last joint R lets the rod turn about itself, which no camera sees.
#
# The chain PPP-U̲-R has six freedoms, which are independent unless the rod lies along the first axis of U̲. Such a
# chain constrains nothing. That is the whole proof that the lift is a hidden robot of *any* robot: nothing has changed,
# except that two of the chain's angles now describe the direction.

# %%
state = step(state, lift)

# %% [markdown]
# The bar in {RU|PPPU̲R} says that two chains run side by side, from the base to the rod. The result is right but not
# pretty. All the rules that follow simplify it.
#
# ## Where does the direction go?
#
# If u stayed in a plane, as in a planar robot, one driven R would do. If u were constant, the camera would see nothing
# at all in this leg. Neither is the case here:

# %%
state = step(state, direction_locus)

# %% [markdown]
# ## Where does the anchor go?
#
# The end A of the rod sits on the crank, so it moves on a circle, in a plane. Two sliders are enough to follow it.

# %%
state = step(state, anchor_locus)

# %% [markdown]
# ## Takeover
#
# The rod is now held twice: by the real joint between crank and rod, and by U̲ with its bearing. One of them can go
# if the other can do its work. The U joint of this leg has its first axis parallel to the crank's axis. That axis
# keeps its direction, just as the first axis of U̲ must, so U̲ takes the place of the real joint, axes and all (MMT
# Fig. 2(b)).

# %%
state = step(state, joint_substitution)

# %% [markdown]
# ## The parallelogram
#
# {R-PP} is a crank with a link at its end that two sliders keep from turning. A planar parallelogram Π does the same
# with less (MMT Fig. 4). The leg is finished:

# %%
state = step(state, pi_form)

# %% [markdown]
# `derive` does all this, then compares the result at 20 configurations instead of three. It also says that this one
# leg is not enough: one direction is two numbers, and the platform has three freedoms. The motion that is not seen is
# that of the tip along the tangent of its circle, with the direction held.

# %%
hidden = hrsynth.derive(leg)
assert str(state.architecture()) == str(hidden.hidden_architecture)
assert (hidden.verdict.rank, hidden.verdict.dof) == (2, 3)
hidden

# %%
hrsynth.draw(hidden)

# %% [markdown]
# ## When a rule must not be used
#
# The papers draw the usual legs, in which axes are parallel or meet. What if they do not? Below the first axis of the
# U joint is oblique. The crank turns it, so its direction changes, and U̲ cannot take its place.

# %%
oblique = rus("oblique", axis=(0.5, 0.5, 0.7))
skew = hrsynth.derive(oblique)
print(skew)
assert skew.unchecked.equivalent

# %% [markdown]
# The takeover is refused, and the result is less pretty, but right. The paper's own form ΠU̲S, printed below the
# certificate, is equivalent all the same: in both robots the tip is the anchor plus the rod along u, the anchor goes
# round the same circle, and u can go anywhere. The rule's condition is sufficient, not necessary. A leg with an R in
# place of the U shows what happens if the condition is ignored:

# %%
b = Builder("RRS")
b.link("base")
b.link("crank")
b.link("rod", at=(0.3, 0, 0.1))
b.link("platform", at=(0.4, 0.1, 0.6))
b.joint("shoulder", "R", "base", "crank", at=(0, 0, 0), axis=(0, 1, 0), motor=True)
b.joint("elbow", "R", "crank", "rod", at=(0.3, 0, 0.1), axis=(0.3, 0.8, 0.5))
b.joint("wrist", "S", "rod", "platform", at=(0.4, 0.1, 0.6))
rrs = b.build(platform="platform")

found = hrsynth.derive(rrs)
print("certified:    ", found.hidden_architecture)
unchecked = found.unchecked
print("unchecked:    ", unchecked.hidden, "–", "equivalent" if unchecked.equivalent else "not equivalent")
print("              ", unchecked.reason)
assert not unchecked.equivalent
assert (found.verdict.rank, found.verdict.dof) == (2, 2)

# %% [markdown]
# The real leg lets its tip move on a surface, two freedoms, and one direction sees both. ΠU̲S would let the tip move
# anywhere. It is another robot, and the comparison of ρ notices at once, because the dimension of ρ changes:

# %%
setting = hrsynth.observe(rrs)
evidence = Evidence(setting.decomposition, setting.samples)
state = State(setting.decomposition, replace(setting.mechanism, observations=()))
for module in (motors_off, lift, anchor_locus):
    state = step(state, module)
trusted = step(state, joint_substitution, trust=True)

# %% [markdown]
# This is the division of labour: *rules propose, the certificate disposes*. A rule may be too bold. The result is
# certified all the same, because a step that changes ρ is undone. A robot to which no other rule applies keeps its
# lift, which needs no rule's condition.
#
# Two more rules need more than one leg: the removal of legs that are not watched, and the change of joints at the
# platform that may go with it. Notebooks 4 and 5 use them.
#
# ## Exercises
#
# 1. Build a UP̲S leg (a universal joint on the base, a driven slide, a ball). Which rule replaces the takeover, and
#    what is the hidden leg?
# 2. Build a P̲US leg: the crank is replaced by a slide. Why is there no parallelogram?
# 3. `derive(…, form="general")` stops before the last rules. Compare both forms for the leg of this notebook. Are the
#    certificates of both as good?

# %% [markdown]
# ## Solutions

# %% jupyter={"source_hidden": true} tags=["solution"]
# 1. the anchor is fixed, no slider is needed, and the actuator takes the place of the joint on the base
b = Builder("UPS")
b.link("base")
b.link("tube")
b.link("rod", at=(0.2, 0.05, 0.3))
b.link("platform", at=(0.4, 0.1, 0.6))
b.joint("shoulder", "U", "base", "tube", at=(0, 0, 0), axis=(0, 1, 0), axis2=(1, 0, 0))
b.joint("slide", "P", "tube", "rod", at=(0.2, 0.05, 0.3), axis=(0.4, 0.1, 0.6), motor=True)
b.joint("wrist", "S", "rod", "platform", at=(0.4, 0.1, 0.6))
ups = b.build(platform="platform")
setting = hrsynth.observe(ups)
evidence = Evidence(setting.decomposition, setting.samples)
state = State(setting.decomposition, replace(setting.mechanism, observations=()))
for module in (motors_off, lift, direction_locus, anchor_locus, prismatic_merge):
    state = step(state, module)
assert str(state.architecture()) == str(hrsynth.derive(ups).hidden_architecture)

# %% jupyter={"source_hidden": true} tags=["solution"]
# 2. the slide carries a link that only translates: it can carry the actuator itself
b = Builder("PUS")
b.link("base")
b.link("carriage")
b.link("rod", at=(0.3, 0, 0.1))
b.link("platform", at=(0.4, 0.1, 0.6))
b.joint("guide", "P", "base", "carriage", at=(0.3, 0, 0.1), axis=(0, 0.6, 0.8), motor=True)
b.joint("elbow", "U", "carriage", "rod", at=(0.3, 0, 0.1), axis=(0, 1, 0), axis2=(1, 0, 0))
b.joint("wrist", "S", "rod", "platform", at=(0.4, 0.1, 0.6))
pus = hrsynth.derive(b.build(platform="platform"))
print(pus)
assert all(each.rule != "pi form" or not each.accepted for each in pus.steps)

# %% jupyter={"source_hidden": true} tags=["solution"]
# 3. both are the same to the camera: both certificates pass with angles at rounding
for form in ("general", "simplified"):
    found = hrsynth.derive(leg, form=form)
    print(f"{form:10}  {found.hidden_architecture!s:12}  {found.equivalence}")
    assert found.equivalence.passed

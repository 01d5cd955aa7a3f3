# %% [markdown]
# # 2. The rules, one by one, on a single leg
#
# How is a hidden robot found? Notebook 1 found it from a figure. This one follows rules, most of them from MMT 3.2, and
# checks each step numerically. The rules work on one leg after another, so a single leg shows them all.
#
# Take a leg of a six-legged robot: a motor rotates a crank about a fixed axis. A universal joint connects the crank
# with a rod, and a spherical joint the rod with the platform. From base to platform this is R̲US, with a line under the
# actuated joint. Our robot has no other leg. A single spherical joint holds its platform, so the controlled platform is
# the centre of that joint: a point, with three dof.

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
    """A crank about y, a rod on a universal joint with a given first axis, a spherical joint."""
    b = Builder(name)
    b.link("base")
    b.link("crank")
    b.link("rod", at=(0.3, 0, 0.1))
    b.link("platform", at=(0.4, 0.1, 0.6))
    b.joint("shoulder", "R", "base", "crank", at=(0, 0, 0), axis=(0, 1, 0), motor=True)
    b.joint("elbow", "U", "crank", "rod", at=(0.3, 0, 0.1), axis=axis, axis2=(1, -axis[0] / axis[1], 0))
    b.joint("ball", "S", "rod", "platform", at=(0.4, 0.1, 0.6))
    return b.build(platform="platform")


leg = rus()
leg

# %% [markdown]
# ## What must stay the same
#
# The camera observes the direction u of the rod. At each configuration the possible joint rates give pairs: a twist t
# of the platform and a rate u̇ of the direction. All these pairs form a linear space, the *velocity relation*:
#
# $$\rho(q) = \{\, (t, \dot u) : \dot q \in \ker A(q) \,\}$$
#
# Two robots with the same ρ, at the same pose and with the same direction, are equivalent for a controller that
# observes u. So no rule may change ρ.
#
# This is checked numerically. At random configurations, take an orthonormal basis of ρ for each of the two robots, and
# the largest angle between the two spaces. It is either zero up to rounding or many orders of magnitude larger.

# %%
setup = hrsynth.observe(leg)
evidence = Evidence(setup.decomposition, setup.samples)  # facts for the rules: how the leg moves
start = State(setup.decomposition, replace(setup.mechanism, observations=()))


def compared(state):
    """The equivalence check of a rewritten robot, at three configurations."""
    return check_equivalence(setup.samples, state.mechanism, count=3, complete=False)


def step(state, module, trust=False):
    """The first proposal of a rule that preserves the velocity relation; each is printed with its angle."""
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
# The motor coordinates of the hidden robot are the measured values. The real motors become passive joints. They do not
# appear in ρ, which describes all motions that the loops allow.

# %%
state = step(start, motors_off)

# %% [markdown]
# ## The lift
#
# Now the rod's direction needs a motor. Two angles describe a direction, so this motor is a universal joint U̲. Its
# first axis must not rotate with the leg: it belongs to a link T that only translates. Three prismatic joints PPP lead
# from the base to T at the rod's end A. After U̲ a last joint R lets the rod rotate about itself, which no camera
# observes.
#
# The virtual chain PPP-U̲-R has six dof, which are independent unless the rod lies along the first axis of U̲. Such a
# chain constrains nothing. This proves that the lift is a hidden robot of *any* robot: only the two angles that
# describe the direction are new.

# %%
state = step(state, lift)

# %% [markdown]
# The bar in {RU|PPPU̲R} denotes two parallel chains from the base to the rod. The result is right but complicated. All
# the rules that follow simplify it.
#
# ## Locus of the direction
#
# If u stayed in a plane, as in a planar robot, one actuated R would do. If u were constant, the leg would give no
# measurement at all. Neither is the case here:

# %%
state = step(state, direction_locus)

# %% [markdown]
# ## Locus of the proximal centre A
#
# The end A of the rod is a point of the crank, so it moves on a circle, in a plane. Two prismatic joints are enough to
# follow it.

# %%
state = step(state, anchor_locus)

# %% [markdown]
# ## Joint substitution
#
# The rod is now constrained twice: by the real joint between crank and rod, and by U̲ with its bearing. One of them can
# be removed if the other gives the same motions. The U joint of this leg has its first axis parallel to the crank's
# axis. That axis keeps its direction, as the first axis of U̲ must. So U̲ replaces the real joint, with the same axes
# (MMT Fig. 2(b)).

# %%
state = step(state, joint_substitution)

# %% [markdown]
# ## The parallelogram
#
# {R-PP} is a crank with a link at its end that two prismatic joints keep from rotating. A planar parallelogram Π gives
# the same motion with fewer joints (MMT Fig. 4). The leg is finished:

# %%
state = step(state, pi_form)

# %% [markdown]
# `derive` does all this, then compares the result at 20 configurations instead of three. It also reports that one leg
# is not enough: one direction is two numbers, and the platform has three dof. The unobserved twist moves the tip along
# the tangent of its circle, with the direction fixed.

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
# The papers draw the usual legs, in which axes are parallel or meet. What if they do not? Below, the first axis of the
# U joint is oblique. Its direction changes with the crank, so U̲ cannot replace it.

# %%
oblique = rus("oblique", axis=(0.5, 0.5, 0.7))
skew = hrsynth.derive(oblique)
print(skew)
assert skew.unchecked.equivalent

# %% [markdown]
# The joint substitution is refused; the result is more complicated, but right. The unchecked form ΠU̲S, printed with
# the equivalence check, is equivalent all the same. In both robots the tip is A plus the rod along u, A moves on the
# same circle, and u is arbitrary. The rule's condition is sufficient, not necessary. A leg with an R in place of the U
# shows what happens if the condition is ignored:

# %%
b = Builder("RRS")
b.link("base")
b.link("crank")
b.link("rod", at=(0.3, 0, 0.1))
b.link("platform", at=(0.4, 0.1, 0.6))
b.joint("shoulder", "R", "base", "crank", at=(0, 0, 0), axis=(0, 1, 0), motor=True)
b.joint("elbow", "R", "crank", "rod", at=(0.3, 0, 0.1), axis=(0.3, 0.8, 0.5))
b.joint("ball", "S", "rod", "platform", at=(0.4, 0.1, 0.6))
rrs = b.build(platform="platform")

found = hrsynth.derive(rrs)
print("derived:      ", found.hidden_architecture)
unchecked = found.unchecked
print("unchecked:    ", unchecked.hidden, "–", "equivalent" if unchecked.equivalent else "not equivalent")
print("              ", unchecked.reason)
assert not unchecked.equivalent
assert (found.verdict.rank, found.verdict.dof) == (2, 2)

# %% [markdown]
# The real leg lets its tip move on a surface, two dof, and one direction observes both. ΠU̲S would let the tip move
# anywhere. It is another robot, and the equivalence check shows it: the dimension of ρ changes:

# %%
setup = hrsynth.observe(rrs)
evidence = Evidence(setup.decomposition, setup.samples)
state = State(setup.decomposition, replace(setup.mechanism, observations=()))
for module in (motors_off, lift, anchor_locus):
    state = step(state, module)
trusted = step(state, joint_substitution, trust=True)

# %% [markdown]
# In short: *rules propose, the equivalence check decides*. A rule may propose too much: a step that changes ρ is
# discarded. A robot to which no other rule applies keeps its lift, which needs no condition.
#
# Two more rules need more than one leg: the removal of unobserved legs, and the end-joint change at the platform that
# may go with it. Notebooks 4 and 5 use them.
#
# ## Exercises
#
# 1. Build a UP̲S leg (a universal joint on the base, an actuated prismatic joint, a spherical joint). Which rule takes
#    the place of joint substitution, and what is the hidden leg?
# 2. Build a P̲US leg: a prismatic joint replaces the crank. Why is there no parallelogram?
# 3. `derive(…, form="general")` stops before the last rules. Compare both forms for the leg of this notebook. Do both
#    pass the equivalence check equally well?

# %% [markdown]
# ## Solutions

# %% jupyter={"source_hidden": true} tags=["solution"]
# 1. A is fixed, no prismatic joint is needed, and the virtual actuator replaces the joint on the base
b = Builder("UPS")
b.link("base")
b.link("tube")
b.link("rod", at=(0.2, 0.05, 0.3))
b.link("platform", at=(0.4, 0.1, 0.6))
b.joint("shoulder", "U", "base", "tube", at=(0, 0, 0), axis=(0, 1, 0), axis2=(1, 0, 0))
b.joint("slide", "P", "tube", "rod", at=(0.2, 0.05, 0.3), axis=(0.4, 0.1, 0.6), motor=True)
b.joint("ball", "S", "rod", "platform", at=(0.4, 0.1, 0.6))
ups = b.build(platform="platform")
setup = hrsynth.observe(ups)
evidence = Evidence(setup.decomposition, setup.samples)
state = State(setup.decomposition, replace(setup.mechanism, observations=()))
for module in (motors_off, lift, direction_locus, anchor_locus, prismatic_merge):
    state = step(state, module)
assert str(state.architecture()) == str(hrsynth.derive(ups).hidden_architecture)

# %% jupyter={"source_hidden": true} tags=["solution"]
# 2. the link after the prismatic joint only translates: it can carry the virtual actuator itself
b = Builder("PUS")
b.link("base")
b.link("carriage")
b.link("rod", at=(0.3, 0, 0.1))
b.link("platform", at=(0.4, 0.1, 0.6))
b.joint("guide", "P", "base", "carriage", at=(0.3, 0, 0.1), axis=(0, 0.6, 0.8), motor=True)
b.joint("elbow", "U", "carriage", "rod", at=(0.3, 0, 0.1), axis=(0, 1, 0), axis2=(1, 0, 0))
b.joint("ball", "S", "rod", "platform", at=(0.4, 0.1, 0.6))
pus = hrsynth.derive(b.build(platform="platform"))
print(pus)
assert all(each.rule != "pi form" or not each.accepted for each in pus.steps)

# %% jupyter={"source_hidden": true} tags=["solution"]
# 3. both are equivalent: both checks pass with angles at rounding
for form in ("general", "simplified"):
    found = hrsynth.derive(leg, form=form)
    print(f"{form:10}  {found.hidden_architecture!s:12}  {found.equivalence}")
    assert found.equivalence.passed

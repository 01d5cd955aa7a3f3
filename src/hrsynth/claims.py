"""Every word of certainty that the program prints: what it stands for, by which computation, on which assumptions, and
the test that would fail if it were false.

``python -m hrsynth.claims FILE`` writes the page of claims. A test (``tests/test_claims.py``) goes through all texts in
the code and all templates of pages: one that holds a word of certainty (:data:`CERTAIN`) and is covered neither by a
row of :data:`CLAIMS` nor by :data:`NO_CLAIMS` fails, as does a row that no text needs.

To print a new one: write what computes it, its test, and then its row here.
"""

from __future__ import annotations

import re
import sys
from dataclasses import dataclass
from pathlib import Path

CERTAIN = re.compile(r"\b(prove[ns]?|proved|proofs?|certif\w+|complete\w*|cannot|never|always|exact\w*|enclose[sd]?|"
                     r"enclosures?|guarantee\w*|impossible|unique\w*|rigorous\w*|isolated|necessarily|separated|"
                     r"same aspect|only beyond|controllable|uncontrollable)\b", re.IGNORECASE)
"""The words that make a text a claim."""


@dataclass(frozen=True)
class Claim:
    """One word or phrase: ``texts`` are patterns of the texts that say it, ``test`` is ``file::function``."""

    phrase: str
    command: str
    means: str
    computation: str
    assumes: str
    test: str
    texts: tuple[str, ...]


EXACT_GEOMETRY = "the file's numbers are the robot's geometry"

CLAIMS = (
    Claim("controllable, partially controllable, uncontrollable", "derive, legs, check, singular, advise, catalog",
          "at generic configurations on the branch of the zero configuration the watched directions show all, some "
          "or none "
          "of the platform's small motions",
          "the ranks of the closed loops' Jacobian at 20 configurations, each with its gap, all of which must agree",
          "numerical, no proof: the configurations are generic, and the gap (1000 at least) tells the rank",
          "tests/analysis/test_legs.py::test_all_sets_obey", (r"controllable",)),
    Claim("certificate passed", "derive",
          "the hidden robot follows the real one at the sampled configurations and has the same relation between the "
          "platform's twist and the rates of the watched directions there",
          "both robots are assembled at the same pose and directions (residual below 1e-9) and their relations "
          "compared "
          "(largest principal angle below 1e-6) at every sample",
          "numerical, no proof: sampled configurations stand for all",
          "tests/kinematics/test_certificate.py::test_a_longer_rod_is_caught",
          (r"certificate", r"certified form", r"no hidden robot passed the certificate")),
    Claim("cannot follow the real robot", "derive (why a step was refused)",
          "the rewritten mechanism was not assembled at a pose and directions of the real robot",
          "Newton's method on its loops, led along the way on which the real robot came, leaves a residual above 1e-9",
          "not found, rather than proved: the step is refused, which is safe",
          "tests/kinematics/test_certificate.py::test_a_longer_rod_is_caught", (r"cannot follow the real robot",)),
    Claim("proved in exact arithmetic", "derive, legs, catalog",
          "the architecture is controllable: almost all geometries with its relations are; *but for a chance below …* "
          "bounds the chance that one of the identities on which this rests is none; *exact at … random instances* "
          "claims no more than the ranks of these instances",
          "the ranks of an instance with rational centres and axes that has all its relations, over the rationals; "
          "each relation follows from the file, by rigid links and joints, or all motions keep it, an identity tested "
          "at three random instances (Schwartz and Zippel); one merely observed is told and is "
          "not *proved*",
          "what is held within 1e-7 is meant so, a thousand times smaller than what is not; numerical: mobility, dof "
          "and dim ρ of the robot are compared with the instance's at samples, and that the zero configuration is "
          "a regular one",
          "tests/analysis/test_kept.py::test_what_is_kept_holds_far_away",
          (r"proved in exact arithmetic", r"exact at ", r"^exact but for a chance", r"not decided in exact arithmetic",
           r"freedoms in exact arithmetic", r"gears are not part of exact geometry", r"^proved$",
           r"Exact in %d instances", r'scope="col">exact<')),
    Claim("cannot turn about its own direction, and …", "derive (why a rule does not apply)",
          "the observed link has no turn about the watched direction with all other links at rest",
          "the kernel of the loops' Jacobian at the samples", "numerical; the rule is not used, which is safe",
          "tests/rewrite/test_rules.py::test_takeover_of_a_skew_elbow_is_caught",
          (r"cannot turn about its own direction",)),
    Claim("proved to be all among …", "modes, path, servo, select, report",
          "no other pose of the named kind has the same measurements",
          "all branches of each held leg's end are read from the leg's joints in closed form; for each choice of "
          "branches an exact resultant whose roots are isolated, or as many enclosed complex solutions, apart from "
          "each other, as such a system has at most (Bézout; six spheres: 40)",
          EXACT_GEOMETRY + ", axes within 1e-7 of parallel or meeting are so; parallelograms are not crossed; joint "
          "centres that coincide but for rounding do, and solutions beyond 1e7 sizes are at infinity",
          "tests/analysis/modes/test_branches.py::test_all_branches_of_random_legs_are_listed",
          (r"proved to be all", r"exact resultant", r" isolated", r"nothing proved", r"not complete", r"^<p>Proof: ",
           r"the controller cannot$")),
    Claim("enclosed to … m, … rad", "modes",
          "exactly one mode lies within the shift and the turn that are told, and it is the pose of the file's "
          "decimals at the exact goal; where bodies are named, theirs",
          "Krawczyk's operator in ball arithmetic, with balls that hold the exact input: rounding, and the distance of "
          "the exactly closed goal by Newton and Kantorovich; the radius of the pose from those of the tips",
          EXACT_GEOMETRY + "; loops that repeat others are consistent; sixteen ulps a chain of joints",
          "tests/analysis/modes/test_enclosures.py::test_the_exact_pose_is_within_the_radius",
          (r"enclosed ", r"each enclosed with existence and uniqueness proved", r"not proved")),
    Claim("fits all legs to …, which does not prove it; excluded by the legs", "modes, report",
          "more is watched than needed; the pose is a solution of as many legs as decide it, and it is not known "
          "whether it is a mode; what is excluded is none; with *proved to be all* no other pose is a mode",
          "a solution is excluded where a condition on a leg's tip is not zero in the ball that its enclosure "
          "leaves to the tip, or two tips are not as far apart as on the platform; the goal, the only one whose "
          "enclosure meets it, is a mode by construction; for the others floats give the distance to what tips reach "
          "(below 1e-9)",
          EXACT_GEOMETRY, "tests/analysis/modes/test_fits.py::test_the_goal_is_not_excluded_and_all_others_are",
          (r"which does not prove it",)),
    Claim("the real robot cannot be assembled there", "modes, view, report",
          "no closed configuration of the whole real robot has the platform at this pose",
          "a distance that a leg named there would have to bridge lies outside of its reach, or its rods ask for "
          "different values of one joint, in ball arithmetic, for all poses within the mode's radius and 1e-7",
          EXACT_GEOMETRY + ", axes that meet to 1e-9 do so; limits of joints do not matter",
          "tests/kinematics/test_closures.py::test_what_is_said_of_assembly_holds_by_brute_force",
          (r"robot cannot be assembled", r"cannot be assembled\b", r"^impossible: ")),
    Claim("the real robot can be assembled there only beyond the limits of …", "modes, view, report",
          "the whole robot closes at this pose, and in no closure are all joints within their limits",
          "all values of a joint that a leg's closures allow are listed in ball arithmetic, and none is within its "
          "limits, turns modulo 2π; of three R through one point, the angle between first and last axis is outside of "
          "what they reach in every closure", EXACT_GEOMETRY + ", axes that meet to 1e-9 do so",
          "tests/kinematics/test_closures.py::test_limits_of_turns_count_modulo_whole_turns",
          (r"only beyond the limits of",)),
    Claim("same aspect (certified)", "path, select",
          "a path leads from the one pose to the other, in the working modes that are told, and the condition of Type "
          "2 is not met on it",
          "points, axes and lengths of the legs' closed forms are read from the file's joints; condition, reach and "
          "limits are enclosed in ball arithmetic all along, for all numbers within 1e-9; where a form had to be "
          "fitted to samples it is not certified",
          EXACT_GEOMETRY + "; the condition is the robot's (compared with ranks at samples), and where rods close the "
          "whole leg closes (seen at samples to 1e-9): which links keep parallel is not proved",
          "tests/analysis/aspects/test_aspects.py::test_a_certified_path_is_free_of_singularities_and_within_reach",
          (r"same aspect", r"^(not )?certified$", r"enclosed away from zero", r"no path was proved",
           r"path shown is proved but for its last part", r"not proved$", r"no path can be certified")),
    Claim("separated (certified)", "path, select",
          "every path between the two poses meets a zero of the condition of Type 2",
          "the condition's expression is enclosed with opposite signs at the two poses, as for *same aspect*; without "
          "*certified*: it has opposite signs in floating point",
          "as for *same aspect*; the expression is continuous where the loops keep their rank",
          "tests/analysis/aspects/test_aspects.py::test_opposite_signs_are_separated_and_equal_signs_never",
          (r"^separated$", r"enclosed with opposite signs", r"not certified by intervals")),
    Claim("never (Type 2 singularities)", "singular",
          "the hidden robot has no Type 2 singularity",
          "no direction lies along every constant line and is normal to every constant axis and normal of the held "
          "legs' tips (rank 3), or the held legs leave the platform no motion",
          f"{EXACT_GEOMETRY}; how the held legs' tips may move is recognised at the samples",
          "tests/analysis/singularity/test_never.py::"
          "test_a_rail_that_is_not_normal_to_a_cranks_axis_is_never_parallel_to_its_tangent",
          (r"never: ", r"never zero", r"^never$")),
    Claim("always … never seen", "singular, path",
          "the robot's watched directions never show these freedoms", "as for *partially controllable*", "numerical",
          "tests/analysis/test_legs.py::test_all_sets_obey", (r"always: ", r" never seen", r"^always$",
          r"never seen: ")),
)
"""What is claimed, in the order of the page."""


@dataclass(frozen=True)
class NoClaim:
    """Texts with such a word that claim nothing of a robot, and why not."""

    why: str
    texts: tuple[str, ...]


NO_CLAIMS = (
    NoClaim("a file or a request is refused", (
        r"cannot (be read|write|draw|serve|build|read|all be parallel)", r"cannot (be asked for|be used|be rendered)",
        r"name cannot be written", r"assembly modes cannot be listed", r"cannot do the work",
        r"a link cannot meet itself",
        r"the platform cannot change ", r" cannot be closed at the zero configuration",
        r"visual shapes cannot be read")),
    NoClaim("says how sensing is simulated", (r"exact, edges \(of the legs", r"^exact$")),
    NoClaim("tells a limit of what was done", (
        r"cannot tell it from a singularity", r"cannot be moved to see where its tip goes",
        r"cannot be enclosed away from",
        r"are made exact, largest change")),
    NoClaim("names of fields, modules and styles", (
        r"^[\w.]*(certificate|Certificate|complete|proof|proved|always)\w*$",
        r"task\.completed", r"isolated modes$", r"drawings, proof,",
        r"^\{.*proof.*\}$")),
    NoClaim("promises what a page is about", (r"what the controller can and cannot do",)),
)


def page() -> str:
    """The page of claims, Markdown."""
    lines = ["# What each word of certainty stands for", "",
             "Each word of certainty that the program prints stands in this table, which is made from the code's own "
             "(`src/hrsynth/claims.py`). A test fails if a text holds such a word and is not listed there. What is "
             "not in "
             "this table is not claimed.", ""]
    for claim in CLAIMS:
        lines += [f"## {claim.phrase}", "", f"`{claim.command}`" if " " not in claim.command else claim.command, "",
                  f"* **Stands for:** {claim.means}.", f"* **Computed by:** {claim.computation}.",
                  f"* **Assumes:** {claim.assumes}.", f"* **Would fail:** `{claim.test}`.", ""]
    return "\n".join(lines)


if __name__ == "__main__":
    Path(sys.argv[1]).write_text(page(), encoding="utf-8", newline="\n")

"""Far pairs: how runs between random poses end, which endings are not what their names say, and which are none of the
rests that are listed for the goal.

``python -m simulation.far 100 3rpr_m1 delta --random 40`` (from ``tests/``) runs so many pairs of each robot with all
legs watched, and so many with random sets of legs; without names those of all controllable robots. Robots that differ
in their motors alone are run once. A line of the log a run: what is broken off goes on. The tables of what is in the
log are printed; ``-o FILE`` writes them between the marks of a page.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import cache
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from hrsynth.analysis.aspects.path import PathPlanner
from hrsynth.analysis.aspects.verdicts import SEPARATED
from hrsynth.description import load
from hrsynth.geometry.vectors import convert_rpy_to_rotation, hat
from hrsynth.kinematics.configuration import ClosedConfiguration
from hrsynth.kinematics.locked_twists import compute_interaction
from hrsynth.kinematics.velocity_relation import compute_relation
from hrsynth.mechanism.model import Mechanism
from hrsynth.simulation.law import FixedDirections, Law, directions
from hrsynth.simulation.outcome import ANTIPODAL, BOUNDARY, ENDINGS, GOAL, MINIMUM, MODE
from hrsynth.simulation.result import Servo
from hrsynth.simulation.run import RUN_ESCAPE_DISTANCE_MAX
from hrsynth.simulation.servo import Conditions, ServoTask
from kinematics.robots import state_of
from oracle import Oracle
from simulation.listed import MEMBER, Listed, Lists, random_sets
from simulation.scenes import CONTROLLABLE, Legs, far_pairs, setting
from tables.markdown import replace_between, table

START, MEMBERS = "<!-- generated: outcomes -->", "<!-- generated: members -->"
OF_ONE_SET = 3
"""Runs with one random set of legs."""
AT_ONCE = 25
"""Goals whose lists are made at once."""
KEY = ("robot", "watched", "seed", "pair")
Key = tuple[Any, ...]
VANISHED, THERE, CLOSED = 1e-9, 1e-6, 1e-9
"""‖e‖ that counts as zero; how far (m, rotation matrices) the pose may be from the mode it is said to be; residual of
closed loops, by the oracle."""


def run_between(
    name: str, start: ClosedConfiguration, goal: ClosedConfiguration, gain: float = 0.8, watched: Legs | None = None
) -> Servo:
    """A run between two configurations of a shipped robot, all legs watched or some."""
    found = setting(name, watched)
    law = Law(found.samples.observation_model, found.dof, gain)
    desired = FixedDirections(directions(goal, law.observation_model)[0])
    return ServoTask(found, start, goal, law, desired, Conditions(gain)).run()


def untrue(found: Servo) -> Iterator[str]:
    """What is not as the ending's name says, by what the engine under test did not compute."""
    last, at, observation_model = found.run.commands[-1], found.run.last, found.setup.samples.observation_model
    u = np.array(
        [o.value(at.pose(observation_model.reference), at.pose(o.link)) for o in observation_model.observations]
    )
    e = np.cross(u, found.desired)
    size, alike = float(np.linalg.norm(e)), np.sum(u * found.desired, axis=1)
    if abs(size - last.size) > 1e-12:
        yield f"‖e‖ is {size}, told {last.size}"
    if found.outcome not in ENDINGS:
        yield f"{found.outcome} is no ending"
    if (size < VANISHED) != (found.outcome in (GOAL, MODE, ANTIPODAL)):
        yield f"{found.outcome} with ‖e‖ = {size}"
    if found.outcome in (GOAL, MODE) and np.any(alike < 0):
        yield f"{found.outcome} with a direction turned over"
    if found.outcome == ANTIPODAL and np.all(alike > 0):
        yield "antipodal with all directions alike"
    if found.outcome != ANTIPODAL and (max(found.from_goal) < THERE) != (found.outcome == GOAL):
        yield f"{found.outcome} at {found.from_goal} from the goal"
    if found.outcome in (GOAL, MODE) and (open_ := Oracle(at.model.mechanism).error(state_of(at.model, at.q))) > CLOSED:
        yield f"{found.outcome} with loops open by {open_}"
    if found.outcome == MODE:
        yield from _no_mode(found)
    if found.outcome == MINIMUM:
        M = compute_interaction(at, observation_model)
        L = np.vstack([-hat(w) @ M[3 * i : 3 * i + 3] for i, w in enumerate(found.desired)])
        if np.linalg.norm(np.linalg.pinv(L, rcond=1e-4) @ e.ravel()) > 1e-5:
            yield "the command does not vanish"
    if found.outcome == BOUNDARY:
        moved = np.linalg.norm(found.way[-1] - found.way[0]) / at.model.length
        dof = compute_relation(at, observation_model).dof
        if moved < RUN_ESCAPE_DISTANCE_MAX and dof.value == found.setup.dof and dof.weakest > 1e-2:
            yield "no boundary is near"


def _no_mode(found: Servo) -> Iterator[str]:
    """What is wrong where a run is said to end at another mode: all robots here have their modes listed. That one which
    merely fits is a mode is shown by the run, whose last state is closed and has the directions."""
    listed = found.run_outcome.modes
    if listed is None or found.run_outcome.matched is None:
        yield f"mode: {found.run_outcome.reason}"
        return
    mode, motion = listed.modes[found.run_outcome.matched - 1], found.setup.motion
    X = found.settled.pose(motion.link)
    if mode.goal or not (mode.proved or mode.match_residual is not None):
        yield f"mode {found.run_outcome.matched} is the goal, or neither proved nor known to fit"
    p = [value or 0.0 for value in (mode.pose.x, mode.pose.y, mode.pose.z)]
    apart = float(np.linalg.norm(motion.position(X) - p))
    turned = 0.0 if mode.pose.rpy is None else float(np.abs(X[:3, :3] - convert_rpy_to_rotation(*mode.pose.rpy)).max())
    if max(apart, turned) > THERE:
        yield f"{apart} m, {turned} from mode {found.run_outcome.matched}"


def untold(found: Servo, aspects: PathPlanner) -> Iterator[str]:
    """Crossings that are not reported. Where the condition is an expression with a sign, the sign at the end is that
    of the start times −1 for each crossing of a Type 2 or constraint singularity (its wrenches are those of constraints
    as well); said of runs in which no leg passes its limit. A goal in another aspect is not reached without one."""
    track, ends = found.track, (found.run.configurations[0], found.run.last)
    if not aspects.condition.signed or track.passages is None:
        return
    answer = aspects.join(*ends, budget=1)
    crossed = track.crossings("type2") + track.crossings("constraint")
    if found.outcome == GOAL and answer.verdict == SEPARATED and not track.passages:
        yield "the goal is in another aspect, no crossing is told"
    values = answer.start.value, answer.goal.value
    if track.crossings("type1") or track.crossings("limit") or not answer.signed:
        return
    if min(map(abs, values)) > 1e-3 * max(map(abs, values)) and np.sign(values[0] * values[1]) != (-1) ** len(crossed):
        yield f"{len(crossed)} crossings, the condition goes from {values[0]:.3g} to {values[1]:.3g}"


def runs(name: str, watched: Legs | None, seed: int, count: int, known: set[Key]) -> Iterator[dict[str, Any]]:
    """Records of so many runs of a robot, without those that are known."""
    keys = [(name, None if watched is None else ",".join(watched), seed, pair) for pair in range(1, count + 1)]
    if known.issuperset(keys):
        return
    aspects, lists = PathPlanner.of(setting(name, watched)), Lists(setting(name, watched))
    drawn = zip(keys, far_pairs(name, seed, count, watched), strict=False)
    while block := list(islice(((key, *ends) for key, ends in drawn if key not in known), AT_ONCE)):
        first = len(lists.every)
        lists.add([goal for _, _, goal in block])
        for number, (key, start, goal) in enumerate(block, first):
            found = run_between(name, start, goal, watched=watched)
            member = Listed.of(found, lists, number)
            wrong = [*untrue(found), *untold(found, aspects), *member.untrue(found)]
            yield {
                **dict(zip(KEY, key, strict=True)),
                "start": str(found.start),
                "goal": str(found.goal),
                "ended": found.outcome,
                "untrue": wrong,
                **member.to_dict(),
            }


def with_random_sets(name: str, count: int, known: set[Key]) -> Iterator[dict[str, Any]]:
    """Records of so many runs with random sets of legs, or of some more."""
    for seed, legs in enumerate(random_sets(name, -(-count // OF_ONE_SET)), 5):
        yield from runs(name, legs, seed, OF_ONE_SET, known)


@cache
def same_question(name: str) -> tuple[str, ...]:
    """The controllable robots that differ from one in their names and motors alone: the loop, which commands velocities
    of joints, is the same."""

    def still(name: str) -> Mechanism:
        mechanism = load(name)
        return replace(
            mechanism, name="", joints={k: replace(joint, motor=None) for k, joint in mechanism.joints.items()}
        )

    return tuple(each for each in CONTROLLABLE if still(each) == still(name))


def tables(records: Sequence[dict[str, Any]], names: Sequence[str]) -> dict[str, str]:
    """The tables of a log, by the marks that they stand between."""
    ways = {START: ("ended", ENDINGS), MEMBERS: ("member", MEMBER)}
    found = {}
    for mark, (field, kinds) in ways.items():
        heads = ("robot", "pairs", *kinds, *(("untrue",) if mark == START else ()))
        rows = list[tuple[object, ...]]()
        for name in names:
            of = ", ".join(f"`{each}`" for each in same_question(name))
            for watched, what in ((False, of), (True, f"{of}, random sets")):
                own = [
                    each for each in records if each["robot"] == name and (each["observations"] is not None) == watched
                ]
                if own and not (watched and mark == START):
                    counted = Counter(each[field] for each in own)
                    wrong = (sum(map(len, (each["untrue"] for each in own))),) if mark == START else ()
                    rows.append((what, len(own), *(counted[kind] or "–" for kind in kinds), *wrong))
        found[mark] = table(heads, rows, 1)
    return found


def main() -> None:
    """Make the runs that are not in the log; the exit status is 1 where something is untrue."""
    parser = argparse.ArgumentParser(prog="python -m simulation.far", description=__doc__)
    parser.add_argument("count", type=int, help="pairs of each robot")
    parser.add_argument("names", nargs="*", help="robots (default: all that are controllable)")
    parser.add_argument("--random", type=int, default=0, help="pairs of each robot with random sets of legs")
    parser.add_argument("--log", type=Path, required=True, help="the file to which each run is written")
    parser.add_argument("-o", dest="page", type=Path, help="the page whose tables are written")
    asked = parser.parse_args()
    names = list(dict.fromkeys(same_question(name)[0] for name in asked.names or CONTROLLABLE))
    records = [json.loads(each) for each in asked.log.read_text().splitlines()] if asked.log.exists() else []
    known = {tuple(each[part] for part in KEY) for each in records}
    ways = [
        way
        for name in names
        for way in (runs(name, None, 4, asked.count, known), with_random_sets(name, asked.random, known))
    ]
    with asked.log.open("a", encoding="utf-8") as log:
        while ways:
            # one of each robot in turn: what is broken off has some of all
            for way in ways[:]:
                record = next(way, None)
                if record is None:
                    ways.remove(way)
                    continue
                records.append(record)
                log.write(json.dumps(record) + "\n")
                log.flush()
    found = tables(records, [each for each in CONTROLLABLE if any(record["robot"] == each for record in records)])
    if asked.page is None:
        print("\n".join(found.values()))
    else:
        text = asked.page.read_text(encoding="utf-8")
        for mark, made in found.items():
            text = replace_between(text, made, mark)
        asked.page.write_text(text, encoding="utf-8", newline="\n")
    sys.exit(
        "\n".join(
            f"{record['robot']}, {record['watched'] or 'all legs'}, {record['start']} to {record['goal']}: {each}"
            for record in records
            for each in record["untrue"]
        )
        or None
    )


if __name__ == "__main__":
    main()

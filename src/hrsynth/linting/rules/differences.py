"""Differences between two files of one robot: reported with ``--compare OTHER`` only."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from ...description import xml
from ...errors import HrsynthError
from ...mechanism.model import Joint, Mechanism
from ...mechanism.normal import reduce_to_normal_form
from ..elements import list_inertials
from ..findings import LintRule, RuleHit
from ..linted_file import LintedFile
from ..matching import ROBOT_DIFFERENCE_TOL, LinkFit, RobotMatch


def _match(file: LintedFile) -> RobotMatch | None:
    """Return the match of the two robots in normal form (formats write one joint as several), if both were read."""
    one, other = file.mechanism, None if file.other is None else file.other.mechanism
    if one is None or other is None:
        return None
    return file.remember("match", lambda: RobotMatch(_normalise_robot(one), _normalise_robot(other)))


def _normalise_robot(robot: Mechanism) -> Mechanism:
    try:
        return reduce_to_normal_form(robot).mechanism
    except HrsynthError:
        return robot


def _fit_links(file: LintedFile, match: RobotMatch) -> dict[str, LinkFit]:
    return file.remember("fits", lambda: {link: fit for link in match.one.links if (fit := match.fit(link))})


def _pair_joints(file: LintedFile) -> Iterator[tuple[Joint, Joint]]:
    match = _match(file)
    if match is not None:
        for mine, theirs in match.joints.items():
            yield match.one.joints[mine], match.other.joints[theirs]


def _describe_names(mine: Joint, theirs: Joint) -> str:
    return repr(mine.name) if mine.name == theirs.name else f"{mine.name!r} ({theirs.name!r} in the other file)"


def _compare_joints(file: LintedFile) -> Iterator[RuleHit]:
    match = _match(file)
    if match is None:
        return
    for name, joint in match.one.joints.items():
        if name not in match.joints:
            yield RuleHit(joint.line, f"{_describe_joint(joint)} {name!r} of type {joint.type} is only in this file")
    taken = set(match.joints.values())
    for name, joint in match.other.joints.items():
        if name not in taken:
            yield RuleHit(None, f"{_describe_joint(joint)} {name!r} of type {joint.type} is only in the other file")


def _describe_joint(joint: Joint) -> str:
    return "joint" if joint.in_tree else "closure"


def _compare_types(file: LintedFile) -> Iterator[RuleHit]:
    for mine, theirs in _pair_joints(file):
        if mine.type is not theirs.type:
            yield RuleHit(
                mine.line, f"joint {_describe_names(mine, theirs)} is of type {mine.type} here, {theirs.type} there"
            )


def _compare_ends(file: LintedFile) -> Iterator[RuleHit]:
    match = _match(file)
    for mine, theirs in _pair_joints(file):
        assert match is not None
        here = {match.links.get(link) for link in mine.links}
        if here != set(theirs.links):
            yield RuleHit(
                mine.line,
                f"joint {_describe_names(mine, theirs)} connects {' and '.join(mine.links)} here, "
                f"{' and '.join(theirs.links)} there",
            )
    if match is None:
        return
    for role in ("base",) if match.one.has_open_platform or match.other.has_open_platform else ("base", "platform"):
        one, two = getattr(match.one, role), getattr(match.other, role)
        if match.links.get(one) != two:
            yield RuleHit(match.one.links[one].line, f"the {role} is {one!r} here, {two!r} there")


def _compare_geometry(file: LintedFile) -> Iterator[RuleHit]:
    match = _match(file)
    if match is None:
        return
    for link, fit in _fit_links(file, match).items():
        worst = max(fit.misses, key=lambda name: fit.misses[name])
        if fit.misses[worst] > ROBOT_DIFFERENCE_TOL:
            joint = match.one.joints[worst]
            yield RuleHit(
                joint.line,
                f"link {link!r}: its joints are placed differently in the other file; after the best "
                f"rigid motion they differ by up to {fit.misses[worst]:.3g} (characteristic lengths, "
                f"radians), at joint {worst!r}",
            )

    fits = _fit_links(file, match)
    for name in match.joints:
        joint = match.one.joints[name]
        if all(link in fits and max(fits[link].misses.values()) <= ROBOT_DIFFERENCE_TOL for link in joint.links):
            apart = match.apart(name)
            if apart > ROBOT_DIFFERENCE_TOL:
                yield RuleHit(
                    joint.line,
                    f"joint {name!r}: its links are shifted along its axis in the other "
                    f"file, by {apart:.3g} (characteristic lengths)",
                )


def _compare_zero(file: LintedFile) -> Iterator[RuleHit]:
    match = _match(file)
    if match is None:
        return
    fits = {
        link: fit
        for link, fit in _fit_links(file, match).items()
        if fit.only and max(fit.misses.values()) <= ROBOT_DIFFERENCE_TOL
    }
    moved = []
    for name in match.joints:
        joint = match.one.joints[name]
        if all(link in fits for link in joint.links):
            X, Y = (fits[link].X for link in joint.links)
            size = max(
                float(np.max(np.abs(X[:3, :3] - Y[:3, :3]))),
                float(np.max(np.abs((X - Y) @ np.append(match.other.joints[match.joints[name]].point, 1.0))))
                / match.one.length,
            )
            if size > ROBOT_DIFFERENCE_TOL:
                moved.append(name)
    if moved:
        yield RuleHit(
            None,
            f"the zero configuration differs: joints {', '.join(moved[:8])}{' …' * bool(moved[8:])} have "
            "other coordinates in the other file",
        )


def _compare_senses(file: LintedFile) -> Iterator[RuleHit]:
    match = _match(file)
    for mine, theirs in _pair_joints(file):
        assert match is not None
        fit = _fit_links(file, match).get(mine.predecessor)
        if fit is None or not fit.only or mine.type is not theirs.type or not mine.axes:
            continue
        turned = mine.predecessor != _find_partner(match, theirs)
        cosine = float(mine.axis @ fit.X[:3, :3] @ theirs.axis) * (-1 if turned else 1)
        if mine.in_tree and theirs.in_tree and cosine < -1 + ROBOT_DIFFERENCE_TOL:
            yield RuleHit(
                mine.line, f"joint {_describe_names(mine, theirs)} counts in the opposite sense in the other file"
            )


def _find_partner(match: RobotMatch, theirs: Joint) -> str | None:
    """Return the link of one that is the other joint's predecessor."""
    return next((mine for mine, link in match.links.items() if link == theirs.predecessor), None)


def _compare_motors(file: LintedFile) -> Iterator[RuleHit]:
    for mine, theirs in _pair_joints(file):
        if mine.is_actuated != theirs.is_actuated:
            yield RuleHit(
                mine.line,
                f"joint {_describe_names(mine, theirs)} is {'actuated' if mine.is_actuated else 'passive'} here, "
                f"{'actuated' if theirs.is_actuated else 'passive'} there",
            )


def _compare_limits(file: LintedFile) -> Iterator[RuleHit]:
    for mine, theirs in _pair_joints(file):
        here, there = (
            (None, None) if each.limits is None else (each.limits.lower, each.limits.upper) for each in (mine, theirs)
        )
        if any(
            (a is None) != (b is None)
            or (a is not None and abs(a - (b or 0.0)) > ROBOT_DIFFERENCE_TOL * max(1.0, abs(a)))
            for a, b in zip(here, there, strict=True)
        ):
            yield RuleHit(
                mine.line,
                f"joint {_describe_names(mine, theirs)}: "
                f"limits {_format_range(here)} here, {_format_range(there)} there",
            )


def _format_range(limits: tuple[float | None, float | None]) -> str:
    return "none" if limits == (None, None) else " to ".join("…" if each is None else f"{each:.6g}" for each in limits)


def _compare_masses(file: LintedFile) -> Iterator[RuleHit]:
    match = _match(file)
    if match is None or file.other is None:
        return
    theirs = {each.link: each for each in list_inertials(file.other)}
    for mine in list_inertials(file):
        name = mine.link if mine.link in theirs else match.links.get(mine.link)
        other, line = theirs.get(name or ""), xml.get_line(mine.element)
        if other is None:
            if theirs:
                yield RuleHit(line, f"link {mine.link!r} has a mass only in this file")
            continue
        a, b = (None if each.mass is None else each.mass.value for each in (mine, other))
        if a is not None and b is not None and abs(a - b) > ROBOT_DIFFERENCE_TOL * abs(a):
            yield RuleHit(line, f"link {mine.link!r}: mass {a:g} here, {b:g} there")
        if mine.inertia is not None and other.inertia is not None:
            moments = [np.linalg.eigvalsh(each) for each in (mine.inertia, other.inertia)]
            if np.max(np.abs(moments[0] - moments[1])) > ROBOT_DIFFERENCE_TOL * np.max(np.abs(moments[0])):
                yield RuleHit(line, f"link {mine.link!r}: principal moments of inertia differ")


def _compare_couplings(file: LintedFile) -> Iterator[RuleHit]:
    match = _match(file)
    if match is None:
        return
    mine = {
        (match.joints.get(each.driver, ""), match.joints.get(each.driven, "")): each for each in match.one.couplings
    }
    theirs = {(each.driver, each.driven): each for each in match.other.couplings}
    for ends in dict.fromkeys([*mine, *theirs]):
        a, b = mine.get(ends), theirs.get(ends)
        if a is None or b is None or abs(a.ratio - b.ratio) > ROBOT_DIFFERENCE_TOL * abs(a.ratio):
            words = [
                "no coupling" if each is None else f"coupling {each.name!r} with the ratio {each.ratio:g}"
                for each in (a, b)
            ]
            yield RuleHit(None if a is None else a.line, f"{words[0]} here, {words[1]} there")


def _make_rule(
    name: str,
    severity: str,
    title: str,
    find: Callable[[LintedFile], Iterator[RuleHit]],
    explanation: str = "Files that differ describe two robots.",
) -> LintRule:
    return LintRule(f"differs-{name}", severity, title, explanation, "correct the file that is wrong", find)


RULES = (
    _make_rule(
        "joint",
        "error",
        "a joint or closure that one file has",
        _compare_joints,
        "It has no partner by name, place or structure. Closures that a format does not have are often lost this way.",
    ),
    _make_rule("type", "error", "joints of different types", _compare_types),
    _make_rule("ends", "error", "joints between other links, another base or platform", _compare_ends),
    _make_rule(
        "geometry",
        "error",
        "joints placed differently on a link",
        _compare_geometry,
        "Compared link by link, so it does not matter where the link is at zero, how its frame is placed, or where "
        "along its axis a revolute joint has its origin.",
    ),
    _make_rule(
        "zero",
        "warning",
        "a different zero configuration",
        _compare_zero,
        "Coordinates of one file are not those of the other: motor offsets, limits and keyframes shift.",
    ),
    _make_rule(
        "sense",
        "warning",
        "a joint that counts in the opposite sense",
        _compare_senses,
        "A command for one moves the other backwards.",
    ),
    _make_rule("motor", "error", "a joint with a motor in one file only", _compare_motors),
    _make_rule("limit", "warning", "different limits", _compare_limits, "Measured from the zero of each file."),
    _make_rule("mass", "warning", "different masses or inertias", _compare_masses),
    _make_rule("coupling", "error", "different couplings", _compare_couplings),
)

"""Forms of hidden robots and assembly modes that the papers print, each with a remark on the computed one."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

Place = tuple[float, float, float]
"""x, y, z (m) of a platform with φ = 0."""


@dataclass(frozen=True)
class PrintedMode:
    """A printed pose, and one sentence on its difference from the robot's geometry."""

    place: Place
    remark: str


@dataclass(frozen=True)
class PrintedClaim:
    """The modes printed for a robot of the families, the observed legs and the desired pose."""

    source: str
    robot: str
    legs: tuple[str, ...]
    goal: Place
    modes: tuple[PrintedMode, ...]

    @property
    def at(self) -> str:
        """The desired pose as the command line takes it."""
        return ",".join(f"{axis}={value:g}" for axis, value in zip("xyz", self.goal, strict=True))


GOAL = "the desired pose itself"
OFF_PLANE = "at φ = 0 it puts the end of leg {leg} 88 mm outside the plane of its circle; the second pair has φ = 180°"

CLAIMS = (
    PrintedClaim(
        "MMT 5.1.3",
        "quattro",
        ("1", "4"),
        (-0.2, 0.0, -0.56),
        (
            PrintedMode((-0.2, 0.0, -0.56), GOAL),
            PrintedMode((-0.2, 0.0, -0.909), "the same mode, with other digits from the printed dimensions"),
            PrintedMode((-0.138, 0.062, -1.019), OFF_PLANE.format(leg=4)),
            PrintedMode((-0.138, 0.062, -0.45), OFF_PLANE.format(leg=4)),
        ),
    ),
    PrintedClaim(
        "MMT 5.1.3",
        "quattro",
        ("2", "3"),
        (-0.2, 0.0, -0.56),
        (
            PrintedMode((-0.2, 0.0, -0.56), GOAL),
            PrintedMode(
                (-0.2, 0.0, -0.296), "a mode of the hidden robot with other digits, but legs 1 and 4 do not reach it"
            ),
            PrintedMode((-0.262, 0.062, -0.694), OFF_PLANE.format(leg=3)),
            PrintedMode((-0.262, 0.062, -0.161), OFF_PLANE.format(leg=3)),
        ),
    ),
    PrintedClaim(
        "MMT 5.1.3",
        "quattro",
        ("1", "2", "3", "4"),
        (0.03, 0.03, -0.59),
        (
            PrintedMode((0.03, 0.03, -0.59), GOAL),
            PrintedMode(
                (0.03, 0.03, -0.65),
                "not a mode: the directions of legs 1 and 3 differ by 0.53° and 0.56° from "
                "those at the desired pose, and the error is stationary nowhere near it",
            ),
        ),
    ),
    PrintedClaim(
        "IROS V",
        "quattro_rigid",
        ("1", "2"),
        (0.0, -0.25, -0.7),
        (
            PrintedMode((0.0, -0.25, -0.7), GOAL),
            PrintedMode(
                (0.0, -0.25, -0.958),
                "impossible: the circles' centres would lie 829 mm below the base, deeper than a rod of 825 mm reaches",
            ),
        ),
    ),
    PrintedClaim("IROS V", "quattro_rigid", ("1", "3"), (0.0, -0.25, -0.7), (PrintedMode((0.0, -0.25, -0.7), GOAL),)),
)
"""All of them, in the order of the papers."""


def printed_poses() -> Iterator[tuple[PrintedClaim, PrintedMode]]:
    """Each printed pose with its claim."""
    return ((claim, mode) for claim in CLAIMS for mode in claim.modes)


@dataclass(frozen=True)
class PrintedForm:
    """A hidden robot, or the form of each of its legs, that a paper prints for a robot of the families."""

    source: str
    real: str
    hidden: tuple[str, ...]
    """In Unicode; several where the paper leaves the choice."""
    robot: str
    legs: tuple[str, ...] | None = None


FORMS = (
    PrintedForm("MMT 4.1.1, Table 1", "RPR leg", ("R̲PR",), "3rpr_m1"),
    PrintedForm("MMT 4.1.1, Table 1", "PRR leg", ("PR̲R",), "3prr_m1"),
    PrintedForm("MMT 4.1.1, Table 1", "PRP leg", ("PR̲P",), "3prp"),
    PrintedForm("MMT 4.1.1, Table 1", "RRP leg", ("ΠR̲P",), "3rrp"),
    PrintedForm("MMT 4.1.2, Fig. 6", "3-RRR", ("3-ΠR̲R",), "3rrr_m1"),
    PrintedForm("MMT 4.2.1", "UPS leg", ("U̲PS",), "gough_stewart"),
    PrintedForm("MMT 4.2.1, Fig. 10", "6-UPS", ("3-U̲PS",), "gough_stewart", ("1", "3", "5")),
    PrintedForm("MMT 4.2.1", "UPU leg", ("U̲PU",), "3upu"),
    PrintedForm("MMT 4.2.1", "RPS leg", ("R̲PS",), "3rps"),
    PrintedForm("MMT 4.2.2", "R-{2-US} leg", ("Π-{2-U̲S}", "Π-{2-U̲U}"), "delta"),
    PrintedForm("MMT 4.2.2", "RUU leg", ("ΠU̲U",), "3ruu"),
    PrintedForm("MMT 4.2.2", "RUS leg", ("ΠU̲S",), "hexa"),
    PrintedForm("MMT 4.2.2", "P-{2-US} leg", ("P-{2-U̲S}", "P-{2-U̲U}"), "linear_delta"),
    PrintedForm("MMT 4.2.2", "PUU leg", ("PU̲U",), "3puu"),
    PrintedForm("MMT 4.2.2", "PUS leg", ("PU̲S",), "6pus"),
    PrintedForm("MMT 4.2.2, Fig. 13", "Quattro", ("2-Π-{2-U̲U}",), "quattro", ("1", "4")),
    PrintedForm("MMT 4.3, Fig. 17", "PRRRP, P parallel", ("PR̲RR̲P",), "prrrp_parallel"),
    PrintedForm("IROS III-A, Fig. 3", "Quattro, rigid", ("2-Π-{2-U̲U}",), "quattro_rigid", ("1", "2")),
)
"""All of them that are of the same robots as those of the families."""

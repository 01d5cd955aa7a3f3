"""The robots that are shipped as files, sorted; ``python -m hrsynth.families`` writes the files from this table."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

from ..mechanism.model import Mechanism
from . import delta, npod, planar


@dataclass(frozen=True)
class ShippedRobot:
    """Shipped robot: its file's name, its constructor, and its main data."""

    name: str
    """File name without ``.urdf``, and the mechanism's name."""
    make: Callable[[], Mechanism]
    """The constructor with the dimensions of the file."""
    architecture: str
    """Legs in ASCII notation, ``*`` after an actuated joint."""
    dof: int
    """Dimension of the controlled twist at a generic configuration."""
    section: str
    """Where the paper treats it (MMT unless another is named)."""
    provenance: str
    """Where the dimensions come from."""


_FREE = "free choice (the paper gives none)"
_TABLE_1 = "MMT 4.1.1, Table 1"
_PLANAR = "MMT 4.1.2"
_DELTA = "MMT 4.2.2"
_NPOD = "MMT 4.2.1"
_PARALLEL = "MMT 4.3"


def _list_motor_variants(
    make: Callable[..., Mechanism], name: str, architectures: tuple[str, str], dof: int, section: str
) -> list[ShippedRobot]:
    """The two robots of a planar type, with the motors on the first and on the second joint of each leg."""
    return [
        ShippedRobot(f"{name}_m{motor}", partial(make, motor=motor), architecture, dof, section, _FREE)
        for motor, architecture in enumerate(architectures, start=1)
    ]


ROBOTS: tuple[ShippedRobot, ...] = tuple(
    sorted(
        [
            *_list_motor_variants(planar.rrrrr, "rrrrr", ("R*RRRR*", "RR*RR*R"), 2, _PLANAR),
            *_list_motor_variants(planar.rprpr, "rprpr", ("R*PRPR*", "RP*RP*R"), 2, _PLANAR),
            *_list_motor_variants(planar.prrrp, "prrrp", ("P*RRRP*", "PR*RR*P"), 2, _PLANAR),
            *_list_motor_variants(planar.three_rrr, "3rrr", ("3-R*RR", "3-RR*R"), 3, _TABLE_1),
            *_list_motor_variants(planar.three_rpr, "3rpr", ("3-R*PR", "3-RP*R"), 3, _TABLE_1),
            *_list_motor_variants(planar.three_prr, "3prr", ("3-P*RR", "3-PR*R"), 3, _TABLE_1),
            *_list_motor_variants(planar.three_ppr, "3ppr", ("3-P*PR", "3-PP*R"), 3, _TABLE_1),
            ShippedRobot("3prp", planar.three_prp, "3-P*RP", 3, _TABLE_1, _FREE),
            ShippedRobot("3rrp", planar.three_rrp, "3-R*RP", 3, _TABLE_1, _FREE),
            ShippedRobot("prrrp_parallel", planar.prrrp_parallel, "P*RRRP*", 2, "MMT 4.3, Fig. 17", _FREE),
            ShippedRobot(
                "prrrp_parallel_point",
                partial(planar.prrrp_parallel, point_body=True),
                "P*RRRP*",
                2,
                "MMT 4.3, Fig. 17",
                f"{_FREE}; the platform is a point body on the shared end joint",
            ),
            ShippedRobot("gough_stewart", npod.gough_stewart, "6-UP*S", 6, _NPOD, _FREE),
            ShippedRobot("3upu", npod.three_upu, "3-UP*U", 3, _NPOD, _FREE),
            ShippedRobot("3rps", npod.three_rps, "3-RP*S", 3, _NPOD, _FREE),
            ShippedRobot("delta", delta.delta, "3-R*-{2-SS}", 3, _DELTA, _FREE),
            ShippedRobot(
                "quattro_rigid",
                delta.quattro_rigid,
                "4-R*-{2-SS}",
                3,
                "IROS II-A",
                "IROS IV-A; distance of the rods and zero configuration: free choice",
            ),
            ShippedRobot(
                "quattro",
                delta.quattro,
                "4-R*-{2-SS}",
                4,
                "MMT 4.2.2, Figs. 12-14",
                "MMT Appendix B.1; distance of the rods and zero configuration: free choice",
            ),
            ShippedRobot("orthoglide", delta.orthoglide, "3-P*-{2-SS}", 3, _DELTA, _FREE),
            ShippedRobot("linear_delta", delta.linear_delta, "3-P*-{2-SS}", 3, _DELTA, _FREE),
            ShippedRobot("uranesx", delta.uranesx, "3-P*-{2-SS}", 3, _PARALLEL, _FREE),
            ShippedRobot(
                "i4l",
                delta.i4l,
                "4-P*-{2-SS}",
                3,
                _PARALLEL,
                f"{_FREE}; the rack and pinion that turns the slide of the plates into a rotation is left out",
            ),
            ShippedRobot("3ruu", delta.three_ruu, "3-R*UU", 3, _DELTA, _FREE),
            ShippedRobot("3puu", delta.three_puu, "3-P*UU", 3, _DELTA, _FREE),
            ShippedRobot("hexa", delta.hexa, "6-R*US", 6, _DELTA, _FREE),
            ShippedRobot("hexaglide", delta.hexaglide, "6-P*US", 6, _DELTA, _FREE),
            ShippedRobot("6pus", delta.six_pus, "6-P*US", 6, _DELTA, _FREE),
        ],
        key=lambda robot: robot.name,
    )
)
"""All shipped robots, sorted by name."""

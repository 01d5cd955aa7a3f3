"""What MMT 5.1.3 and IROS V print as assembly modes, against the program and against closed forms written down here.

Closed form (MMT B.1-B.4): the tip C_i of a leg whose rod keeps its direction u_i is on the circle of radius l₁ about
S_i = A_i + l₂ u_i, in the vertical plane through the base's radius at θ_i. Nothing of the program is used for it.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import least_squares

from hrsynth.analysis.modes.modes import AssemblyModes, modes
from hrsynth.description import list_robots, load
from hrsynth.geometry.vectors import Array
from tables import printed as table
from tables.markdown import block
from tables.printed_claims import CLAIMS, GOAL, PrintedClaim, PrintedMode, printed_poses

PAGE = (Path(__file__).resolve().parents[3] / "docs" / "pages" / "papers.md").read_text(encoding="utf-8")
L1, L2 = 0.380, 0.825
ANGLES = np.array([-3, -1, 1, 3]) * np.pi / 4
RADIAL = np.column_stack([np.cos(ANGLES), np.sin(ANGLES), 0 * ANGLES])
TANGENT = np.column_stack([-np.sin(ANGLES), np.cos(ANGLES), 0 * ANGLES])
BASE = {"quattro": 0.275 * RADIAL, "quattro_rigid": 0.296 * RADIAL}
Tips = Callable[[Array], Array]


def articulated(q: Array, bar: tuple[float, float] = (0.0, 1.0)) -> Array:
    """C_i (4, 3) at q = (x, y, z, φ): D₁D₂ along ``bar`` at φ = 0, the plates do not turn (MMT Appendix B.1)."""
    c, s = np.cos(q[3]), np.sin(q[3])
    along = 0.043 * np.array([c * bar[0] - s * bar[1], s * bar[0] + c * bar[1], 0.0])
    corners = np.array([[-0.066, -0.048, 0], [0.066, -0.048, 0], [0.066, 0.048, 0], [-0.066, 0.048, 0]])
    return q[:3] + corners + np.array([-along, -along, along, along])


def rigid(q: Array) -> Array:
    """C_i (4, 3) at q = (x, y, z) (IROS IV-A)."""
    return q[:3] + 0.102 * RADIAL


TIPS: dict[str, Tips] = {"quattro": articulated, "quattro_rigid": rigid}


def rod(A: Array, leg: int, C: Array) -> Array:
    """u_i with the knee outwards, from B.4 (3,)."""
    d = C - A
    alpha, beta, gamma = -2 * L1 * d @ RADIAL[leg], -2 * L1 * d[2], d @ d + L1**2 - L2**2
    middle, half = np.arctan2(beta, alpha), np.arccos(-gamma / np.hypot(alpha, beta))
    arms = [np.cos(q) * RADIAL[leg] + np.sin(q) * np.array([0, 0, 1.0]) for q in (middle + half, middle - half)]
    return np.asarray((d - L1 * max(arms, key=lambda arm: float(arm @ RADIAL[leg]))) / L2)


def rods(robot: str, q: Array, tips: Tips | None = None) -> Array:
    """All u_i at a pose (4, 3)."""
    C = (tips or TIPS[robot])(q)
    return np.array([rod(BASE[robot][leg], leg, C[leg]) for leg in range(4)])


def solutions(robot: str, legs: tuple[str, ...], goal: Array, tips: Tips | None = None, starts: int = 40) -> Array:
    """Poses with the rods of ``legs`` as at the goal, by least squares from random starts, highest first."""
    tips = tips or TIPS[robot]
    numbers = [int(leg) - 1 for leg in legs]
    centres = BASE[robot] + L2 * rods(robot, goal, tips)

    def missed(q: Array) -> Array:
        spokes = (tips(q) - centres)[numbers]
        across = (spokes * TANGENT[numbers]).sum(axis=1)
        return np.concatenate([across, ((spokes * spokes).sum(axis=1) - L1**2) / L1])

    rng, found = np.random.default_rng(0), list[Array]()
    for _ in range(starts):
        start = goal + rng.uniform(-1, 1, len(goal)) * [0.6, 0.6, 0.6, np.pi][: len(goal)]
        result = least_squares(missed, start, xtol=1e-15, ftol=1e-15, gtol=1e-15)
        q = np.array(result.x)
        q[3:] = (q[3:] + 1e-6) % (2 * np.pi) - 1e-6
        if np.abs(result.fun).max() < 1e-11 and all(np.abs(q - other).max() > 1e-5 for other in found):
            found.append(q)
    return np.array(sorted(found, key=lambda q: -q[2]))


def coordinates(found: AssemblyModes, size: int) -> Array:
    """x, y, z and φ of the modes, highest first; shape (modes, size)."""
    rows = [(m.pose.x, m.pose.y, m.pose.z, (m.pose.rpy[2] + 1e-6) % (2 * np.pi) - 1e-6) for m in found.modes]
    return np.array(sorted(rows, key=lambda row: -row[2]))[:, :size]


listed = table.compute_modes


def goal_of(claim: PrintedClaim) -> Array:
    return np.array([*claim.goal, 0.0][: 4 if claim.robot == "quattro" else 3])


def spoken(claim: PrintedClaim) -> str:
    return f"{claim.robot}:{','.join(claim.legs)}"


@pytest.mark.some(1)
@pytest.mark.parametrize("claim", CLAIMS, ids=spoken)
def test_the_closed_form_has_the_modes_that_are_listed(claim: PrintedClaim):
    goal, found = goal_of(claim), listed(claim)
    assert found.found.complete
    ours = coordinates(found, len(goal))
    theirs = solutions(claim.robot, claim.legs, goal)
    assert ours.shape == theirs.shape
    assert np.allclose(ours, theirs, atol=1e-7)


@pytest.mark.some(5)
@pytest.mark.parametrize(
    ("claim", "mode"),
    list(printed_poses()),
    ids=lambda each: spoken(each) if isinstance(each, PrintedClaim) else "/".join(map(str, each.place)),
)
def test_only_the_desired_poses_are_printed_as_they_are(claim: PrintedClaim, mode: PrintedMode):
    nearest = table.nearest(mode.place, listed(claim))
    apart = math.dist(mode.place, (nearest.pose.x, nearest.pose.y, nearest.pose.z))
    assert nearest.goal == (mode.remark == GOAL or claim.legs == ("1", "2", "3", "4"))
    assert (apart < 1e-9) == (mode.remark == GOAL)
    assert apart < 1e-9 or apart > 5e-3


@pytest.mark.parametrize(
    ("legs", "z", "printed_z", "reachable"), [(("1", "4"), -0.9019, -0.909, True), (("2", "3"), -0.3478, -0.296, False)]
)
def test_the_second_modes_have_other_digits_than_printed(legs, z, printed_z, reachable):
    """The pose keeps x and y, so it is the goal's mirror image about the height of the circles' centres."""
    claim = next(c for c in CLAIMS if c.legs == legs and c.robot == "quattro")
    centre = L2 * rods("quattro", goal_of(claim))[int(legs[0]) - 1, 2]
    mode = next(m for m in listed(claim).modes if abs(m.pose.z - z) < 1e-3)
    assert mode.pose.z == pytest.approx(2 * centre + 0.56, abs=1e-9)
    assert (mode.pose.x, mode.pose.y) == pytest.approx((-0.2, 0.0), abs=1e-9)
    assert abs(mode.pose.z - printed_z) > 5e-3
    assert mode.reachable is reachable
    assert reachable or set(mode.unclosed_legs) == {"1", "4"}


@pytest.mark.parametrize(("legs", "off"), [(("1", "4"), "4"), (("2", "3"), "3")])
def test_the_third_and_fourth_printed_modes_leave_a_leg_s_plane(legs, off):
    claim = next(c for c in CLAIMS if c.legs == legs and c.robot == "quattro")
    for mode in claim.modes[2:]:
        shift = np.subtract(mode.place, claim.goal)
        across = np.abs(TANGENT @ shift)
        assert across[int(off) - 1] == pytest.approx(0.0877, abs=1e-4)
        assert f"leg {off} 88 mm" in mode.remark
    turns = coordinates(listed(claim), 4)[:, 3]
    assert sorted(np.round(np.degrees(turns))) == [0, 0, 180, 180]


@pytest.mark.slow
@pytest.mark.parametrize("legs", [("1", "4"), ("2", "3")])
def test_with_the_bar_along_x_there_are_two_modes_a_pair(legs):
    """MMT's words measure φ between x and D₁D₂; its E offsets fit a bar along y only."""
    found = solutions("quattro", legs, np.array([-0.2, 0, -0.56, 0]), lambda q: articulated(q, (1.0, 0.0)), 80)
    assert len(found) == 2


def test_the_printed_second_pose_of_all_legs_is_no_mode():
    goal, other = np.array([0.03, 0.03, -0.59, 0]), np.array([0.03, 0.03, -0.65, 0])
    apart = np.degrees(np.arccos((rods("quattro", goal) * rods("quattro", other)).sum(axis=1)))
    assert apart == pytest.approx([0.5286, 0.0117, 0.5588, 0.0238], abs=1e-3)
    claim = next(c for c in CLAIMS if len(c.legs) == 4)
    assert [m.goal for m in listed(claim).modes] == [True]


def test_the_error_of_all_legs_is_stationary_at_the_goal_alone():
    """From the printed pose, and from the second mode of legs 1 and 3 near it, least squares lead to the goal."""
    goal = np.array([0.03, 0.03, -0.59, 0])
    wanted = rods("quattro", goal)
    for start in ((0.03, 0.03, -0.65, 0), (0.0345, 0.0345, -0.65, 0), (0.035, 0.035, -0.67, 0.02)):
        result = least_squares(
            lambda q: (rods("quattro", q) - wanted).ravel(), start, xtol=1e-15, ftol=1e-15, gtol=1e-15
        )
        assert np.allclose(result.x, goal, atol=1e-6)
    assert listed(next(c for c in CLAIMS if len(c.legs) == 4)).near_modes == ()


def test_on_the_axis_two_poses_do_share_all_four_directions():
    found = modes(load(list_robots()["quattro"]), at="x=0,y=0,z=-0.59")
    assert found.found.complete
    assert len(found.modes) == 2
    heights = sorted(m.pose.z for m in found.modes)
    assert heights[1] - heights[0] > 0.02
    one, other = (rods("quattro", np.array([m.pose.x, m.pose.y, m.pose.z, 0.0])) for m in found.modes)
    assert np.allclose(one, other, atol=1e-9)


def test_the_printed_pose_of_legs_1_and_2_is_deeper_than_the_rods_are_long():
    """Two poses on one vertical are mirror images about the circles' centres, at the height l₂ u_z."""
    middle = (-0.7 - 0.958) / 2
    assert abs(middle) > L2
    found = listed(next(c for c in CLAIMS if c.legs == ("1", "2")))
    assert min(m.pose.z for m in found.modes) == pytest.approx(-0.7023, abs=1e-4)


def test_the_page_shows_the_table():
    assert block(PAGE, table.START) == table.table(), "the page is stale: make readme"

"""Assembly modes: poses with the same observed directions, each with the configuration to fly to."""

from __future__ import annotations

from typing import Any

from ....analysis.modes.assembly_mode import AssemblyMode
from ....analysis.modes.modes import AssemblyModes, assemble_at_mode, modes
from ....analysis.modes.near_modes import NearMode
from ....errors import PoseReachFailure
from ....kinematics.configuration import ClosedConfiguration
from ....mechanism.pose import ModeNumber
from ...text.poses import describe_assembly, describe_completeness
from ...view.mode_outlines import build_mode_outline
from ...view.states import RealAndHiddenState
from ..commands import format_commands_at
from ..request import Request


def answer(request: Request) -> dict[str, Any]:
    """Return all assembly modes with the directions at ``here``, and whether the list is complete."""
    setup = request.seeing()
    here = request.here(request.mover())
    found = modes(setup, at=here.real)
    return {
        "modes": [
            *(_describe_mode(request, found, number, mode) for number, mode in enumerate(found.modes, 1)),
            *(_describe_near_mode(request, found, number, mode) for number, mode in enumerate(found.near_modes, 1)),
        ],
        "words": describe_modes(found),
        **format_commands_at(request, "modes", setup, here.real),
    }


def describe_modes(found: AssemblyModes) -> str:
    """Describe the number of modes, and the proof that the list is complete."""
    if found.found.continuous_family is not None and found.found.complex is not None:
        return f"a continuous family of poses: {found.found.singular_solutions}"
    more = "" if found.found.singular_solutions is None else f"; {found.found.singular_solutions}"
    alike = f"{found.alike}; " if found.near_modes else ""
    return f"{alike}{found.count}, {describe_completeness(found)}; {found.found.proof}{more}"


def _describe_mode(request: Request, found: AssemblyModes, number: int, mode: AssemblyMode) -> dict[str, Any]:
    try:
        there = assemble_at_mode(found, ModeNumber(number))
    except PoseReachFailure:
        there = None
    told = "the present pose" if mode.goal else describe_assembly(mode, found.setup.limits_ignored)[0]
    return _describe_listed(request, found, f"mode {number}", mode, told, there)


def _describe_near_mode(request: Request, found: AssemblyModes, number: int, mode: NearMode) -> dict[str, Any]:
    told = f"measured values differ {mode.differs}; {describe_assembly(mode, found.setup.limits_ignored)[0]}"
    return _describe_listed(request, found, f"near {number}", mode, told, mode.configuration)


def _describe_listed(
    request: Request, found: AssemblyModes, label: str, mode: AssemblyMode, told: str, there: ClosedConfiguration | None
) -> dict[str, Any]:
    drawn = build_mode_outline(found.setup, label, mode)
    return {
        **drawn.scene(),
        "words": f"{drawn.words}: {told}",
        "pose": mode.pose.to_dict(),
        "goal": mode.goal,
        "here": None if there is None else request.describe_here(RealAndHiddenState(there)),
    }

"""Made by make index."""

from . import catalog as catalog
from .analysis.accuracy.accuracy import accuracy as accuracy
from .analysis.advice import advise as advise
from .analysis.aspects.aspects import aspects as aspects
from .analysis.aspects.path import path as path
from .analysis.branch.proof import branch as branch
from .analysis.check import check as check
from .analysis.controllability import legs as legs
from .analysis.derive import derive as derive
from .analysis.modes.modes import modes as modes
from .analysis.parallel_map import map_robots as map_robots
from .analysis.pose_requests import observe as observe
from .analysis.result_cache import clear_cache as clear_cache
from .analysis.singularity.singularities import singularities as singularities
from .certificates import certificate as certificate
from .certificates import verify as verify
from .codegen.export import export as export
from .description import list_examples as list_examples
from .description import list_robots as list_robots
from .description import load as load
from .description import save as save
from .description import to_mujoco as to_mujoco
from .description import to_urdf as to_urdf
from .kinematics.pinocchio_export import to_pinocchio as to_pinocchio
from .linting.lint import lint as lint
from .mechanism.builder import build as build
from .present.show import draw as draw
from .present.show import html as html
from .present.show import text as text
from .present.show import to_json as to_json
from .present.show import to_pandas as to_pandas
from .present.studio.server import studio as studio
from .present.view.view import view as view
from .progress import on_progress as on_progress
from .selection.select import select as select
from .simulation.equilibria.basins import basins as basins
from .simulation.equilibria.equilibria import equilibria as equilibria
from .simulation.servo import servo as servo
from .version import __version__ as __version__

__all__ = [
    "__version__",
    "accuracy",
    "advise",
    "aspects",
    "basins",
    "branch",
    "build",
    "catalog",
    "certificate",
    "check",
    "clear_cache",
    "derive",
    "draw",
    "equilibria",
    "export",
    "html",
    "legs",
    "lint",
    "list_examples",
    "list_robots",
    "load",
    "map_robots",
    "modes",
    "observe",
    "on_progress",
    "path",
    "save",
    "select",
    "servo",
    "singularities",
    "studio",
    "text",
    "to_json",
    "to_mujoco",
    "to_pandas",
    "to_pinocchio",
    "to_urdf",
    "verify",
    "view",
]

"""Made by make index."""

from . import catalog as catalog
from .analysis.accuracy.accuracy import accuracy as accuracy
from .analysis.advice import advise as advise
from .analysis.asked import observe as observe
from .analysis.aspects.atlas import atlas as atlas
from .analysis.aspects.path import path as path
from .analysis.branch.proof import branch as branch
from .analysis.check import check as check
from .analysis.controllability import legs as legs
from .analysis.derive import derive as derive
from .analysis.modes.modes import modes as modes
from .analysis.question import forget as forget
from .analysis.singularity.singular import singular as singular
from .analysis.study import map as map
from .certificates import certificate as certificate
from .certificates import verify as verify
from .codegen.export import export as export
from .description import examples as examples
from .description import load as load
from .description import save as save
from .description import shipped as shipped
from .kinematics.pinocchio_export import to_pinocchio as to_pinocchio
from .linting.lint import lint as lint
from .present.show import draw as draw
from .present.show import html as html
from .present.show import text as text
from .present.studio.server import studio as studio
from .present.view.view import view as view
from .progress import following as following
from .selection.select import select as select
from .simulation.endings.basins import basins as basins
from .simulation.endings.endings import endings as endings
from .simulation.servo import servo as servo
from .version import __version__ as __version__

__all__ = [
    "__version__",
    "accuracy",
    "advise",
    "atlas",
    "basins",
    "branch",
    "catalog",
    "certificate",
    "check",
    "derive",
    "draw",
    "endings",
    "examples",
    "export",
    "following",
    "forget",
    "html",
    "legs",
    "lint",
    "load",
    "map",
    "modes",
    "observe",
    "path",
    "save",
    "select",
    "servo",
    "shipped",
    "singular",
    "studio",
    "text",
    "to_pinocchio",
    "verify",
    "view",
]

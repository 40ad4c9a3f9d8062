"""lagrange: equations of motion from a scene file.

>>> from lagrange_cli import load
>>> derivation = load("systems/lecture/bead_on_parabola.yaml").derive()
>>> trajectory = derivation.simulate(accuracy=1e-9)

Importing this package imports nothing heavy; each step imports what it uses.
"""

from lagrange_cli.api import Derivation, LoadedScene, load, loads
from lagrange_cli.errors import AccuracyError, InputError, InternalError, LagrangeError
from lagrange_cli.version import __version__

__all__ = [
    "AccuracyError",
    "Derivation",
    "InputError",
    "InternalError",
    "LagrangeError",
    "LoadedScene",
    "__version__",
    "load",
    "loads",
]

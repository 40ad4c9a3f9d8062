"""lagrange: equations of motion from a scene file.

>>> from lagrange_cli import load
>>> derivation = load("systems/lecture/bead_on_parabola.yaml").derive()
>>> trajectory = derivation.simulate(accuracy=1e-9)

Importing this package imports nothing heavy; each step imports what it uses.
"""

from typing import TYPE_CHECKING, Any

from lagrange_cli.errors import AccuracyError, InputError, InternalError, LagrangeError
from lagrange_cli.version import __version__

if TYPE_CHECKING:
    from lagrange_cli.api import Derivation, LoadedScene, load, loads, sampled

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
    "sampled",
]


def __getattr__(name: str) -> Any:
    """Import the Python interface when it is used: the command line does without."""
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from lagrange_cli import api

    return getattr(api, name)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})

"""The Python interface: the pipeline's values, with the steps between them as methods.

``load("scene.yaml").derive().simulate(accuracy=1e-9)`` returns the results of the commands. Every
value is frozen; the modules behind a step are imported when it is taken.

Read :mod:`.scenes` first, then :mod:`.derivation`: its methods are functions in :mod:`.analysis`,
:mod:`.motion` and :mod:`.studies`, or stand there.
"""

from lagrange_cli.api.derivation import Derivation
from lagrange_cli.api.motion import sampled
from lagrange_cli.api.scenes import LoadedScene, load, loads

__all__ = ["Derivation", "LoadedScene", "load", "loads", "sampled"]

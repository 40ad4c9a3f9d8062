"""Sources of the libraries that nearly every run needs: a system, and its integrators.

They are known before there are numbers, so that a command compiles them while it does other work.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from lagrange_cli.simulate import kernels
from lagrange_cli.toolchain.compiler import PEELED_LOOPS, REGISTERS_BY_PRIORITY
from lagrange_cli.toolchain.shared_library import CSource

if TYPE_CHECKING:
    from lagrange_cli.simulate.model.model import Code

#: Options for the text of a system. By priorities GCC gives registers to long functions in less
#: time, a fifth of all for a bicycle, and runs them as fast.
OPTIONS = ("-O2", REGISTERS_BY_PRIORITY)

#: Loops are peeled in texts of no more characters: small systems of equations are solved in a fifth
#: less time without loops. Longer texts would be compiled a quarter longer, and run as fast.
_SHORT = 2**16


def system_source(code: Code) -> CSource:
    """Return what is compiled of a model, for doubles."""
    options = (*OPTIONS, PEELED_LOOPS) if len(code.c) <= _SHORT else OPTIONS
    return CSource({"system.c": code.c + code.lanes, **kernels.kernel_headers()}, options)


def stepping_source(size: int) -> CSource:
    """Return what is compiled for a system whose states have so many numbers."""
    return CSource(kernels.kernel_files("stepping"), kernels.kernel_options(size))

"""The library of the integrators that nearly every run needs."""

from __future__ import annotations

from lagrange_cli.simulate import kernels
from lagrange_cli.simulate.toolchain.shared_library import CSource


def stepping_source(coordinates: int) -> CSource:
    """Return what is compiled for a system of so many coordinates."""
    return CSource(kernels.kernel_files("stepping"), kernels.kernel_options(2 * coordinates))

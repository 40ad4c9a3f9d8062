"""Methods that can be tested here: those whose optional packages are installed."""

from __future__ import annotations

from importlib.util import find_spec

import pytest

from lagrange_cli.simulate.integrators import INTEGRATORS


def installed(method):
    return method.package is None or find_spec(method.package[0]) is not None


#: Every method that runs here, by name; it is tested on scenes.
INSTALLED = {name: m for name, m in INTEGRATORS.items() if installed(m)}

#: Those that need nothing but values of a right-hand side.
BY_VALUES = [method for method in INSTALLED.values() if not method.traces]


def or_skip(name):
    """A method; the test is skipped where its package is not installed."""
    method = INTEGRATORS[name]
    if not installed(method):
        pytest.skip(f"{name} needs {method.package[0]}, which is not installed")
    return method

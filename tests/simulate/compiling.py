"""What tests of compiled code share."""

from __future__ import annotations

import os
from typing import NoReturn

import pytest

from lagrange_cli.simulate.model.model import Model
from lagrange_cli.simulate.system.functions import RightHandSide, right_hand_side


def compiled_or_skip(model: Model) -> RightHandSide:
    """The compiled functions; without a compiler the test is skipped, but never in CI."""
    found = right_hand_side(model)
    if not found.implementation.startswith("compiled"):
        skip_without_compiler(found.implementation)
    return found


def skip_without_compiler(reason: str) -> NoReturn:
    """Skip the test, but never in CI."""
    assert os.environ.get("CI") != "true", reason
    pytest.skip(reason)

"""What tests of compiled code share."""

from __future__ import annotations

import os

import pytest

from lagrange_cli.simulate.model import Model
from lagrange_cli.simulate.right_hand_side import RightHandSide, right_hand_side


def compiled_or_skip(model: Model) -> RightHandSide:
    """The compiled functions; without a compiler the test is skipped, but never in CI."""
    found = right_hand_side(model)
    if not found.implementation.startswith("compiled"):
        assert os.environ.get("CI") != "true", found.implementation
        pytest.skip(found.implementation)
    return found

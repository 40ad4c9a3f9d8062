"""Functions that are stored and read again are the same."""

from __future__ import annotations

import pytest

from lagrange_cli.program.lowered.functions import Solve, steps_in
from lagrange_cli.program.lowered.lowering import lowered
from lagrange_cli.program.lowered.stored import StoredFunctions
from lagrange_cli.program.program import build_program
from lagrange_cli.simulate.model.build import programs_of
from tests.program.test_large_systems import CASES, chain
from tests.systems.shipped import NARROW, SCENES, derived, sliced


@sliced(SCENES, NARROW)
def test_functions_of_scenes(name):
    functions = {f: lowered(program, f) for f, program in programs_of(derived(name)).items()}
    stored = StoredFunctions.from_functions(functions)
    assert dict(StoredFunctions(stored.text)) == functions
    assert list(stored) == list(functions)


@pytest.mark.parametrize("make", [lambda: chain(30), CASES["large_net"]])
def test_functions_of_families(make):
    """Loops, tables of indices, bands and supernodes."""
    rhs = lowered(build_program(make(), ["acceleration"]), "rhs")
    assert any(isinstance(step, Solve) for step in steps_in(rhs.body))
    assert StoredFunctions.from_functions({"rhs": rhs})["rhs"] == rhs


def test_no_functions():
    stored = StoredFunctions.from_functions({})
    assert (len(stored), stored.text, "rhs" in stored) == (0, "", False)

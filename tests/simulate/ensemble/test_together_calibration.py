"""Members stepped side by side keep their accuracy, judged by references of 113 binary digits."""

from __future__ import annotations

import importlib
import random
from pathlib import Path
from types import ModuleType, SimpleNamespace

import numpy as np
import pytest

from lagrange_cli.simulate.ensemble.run.batched_results import batched_results
from lagrange_cli.simulate.ensemble.store.blocks import BlockPart
from lagrange_cli.simulate.options import SimulationOptions
from lagrange_cli.toolchain.compiler import CompileError, find_compiler
from tests.simulate.compiling import skip_without_compiler

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parents[3]
SYSTEMS, REFERENCES = ROOT / "systems", ROOT / "tests" / "references"
MINIMAL = sorted(REFERENCES.rglob("*.minimal.json"))
ACCURACIES = (1e-3, 1e-6, 1e-9, 1e-12)

#: Those that are looked at until enough of them have been judged.
ORDER = random.Random(1789).sample(MINIMAL, len(MINIMAL))
ENOUGH = 4


@pytest.fixture(scope="module")
def calibration() -> ModuleType:
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(ROOT / "benchmarks")
        yield importlib.import_module("calibration")


def judged(calibration, path, accuracy):
    """True and estimated error of a scene's own motion; None where it is left to a single run."""
    scene = SYSTEMS / path.relative_to(REFERENCES).parent / f"{path.name.split('.')[0]}.yaml"
    model = calibration.system(scene, "minimal").model
    batched = batched_results(model, SimulationOptions(accuracy=accuracy), ())
    if batched is None:
        return None
    given = np.array([[p.value or 0.0 for p in model.parameters]])
    found = next(iter(batched.run(np.array([model.initial]), given)), None)
    if not isinstance(found, BlockPart):
        return None
    columns = {name: column[0] for name, column in found.columns.items()}
    run = SimpleNamespace(t=batched.request.times[:], columns=columns, exempt=(), events=())
    error = calibration.judged(run, calibration.read(path))
    return error, float(found.figures["estimated"][0])


def test_seeded_slice(calibration):
    try:
        find_compiler()
    except CompileError as error:
        skip_without_compiler(error.reason)
    count = 0
    for number, path in enumerate(ORDER):
        accuracy = ACCURACIES[number % 4]
        found = judged(calibration, path, accuracy)
        if found is not None:
            error, estimated = found
            assert error <= estimated <= accuracy, path.name
            count += 1
        if count == ENOUGH:
            return
    raise AssertionError(f"only {count} scenes are stepped side by side")

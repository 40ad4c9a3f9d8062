"""The C of every shipped scene with contacts, with `--main`: its motion is that of `simulate`."""

from __future__ import annotations

import io
import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from lagrange_cli.api.emitters import EMITTERS
from tests.systems.shipped import CONTACTS, derived, simulated

COMPILER = shutil.which("gcc")

STRICT = ["-std=c99", "-Og", "-Wall", "-Wextra", "-pedantic", "-Werror"]

#: Steps between two of 500 rows: errors of fourth order are far below what is compared.
STEPS = 8

pytestmark = [
    pytest.mark.slow,
    pytest.mark.compiler,
    pytest.mark.skipif(COMPILER is None, reason="gcc is not installed"),
]


def program(name: str, folder: Path) -> Path:
    """The compiled program of a scene."""
    for file, text in EMITTERS["c"].emit(derived(name), {"real": "double", "main": True}).items():
        (folder / file).write_text(text, encoding="utf-8")
    target = folder / "motion"
    (source,) = folder.glob("*.c")
    done = subprocess.run(
        [str(COMPILER), *STRICT, str(source), "-o", str(target), "-lm"],
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert done.returncode == 0, done.stderr[:2000]
    return target


@pytest.mark.parametrize("name", CONTACTS)
def test_main_follows_the_motion(name: str, tmp_path: Path):
    trajectory = simulated(name)
    done = subprocess.run(
        [str(program(name, tmp_path)), f"until={float(trajectory.t[-1])!r}", f"steps={STEPS}"],
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert done.returncode == 0, done.stderr
    header, _, body = done.stdout.partition("\n")
    rows = np.loadtxt(io.StringIO(body), delimiter=",", ndmin=2)
    columns = dict(zip(header.split(","), rows.T, strict=True))
    found = re.findall(r"t = (\S+): (contact|release):(\S+)", done.stderr)
    expected = [event for event in trajectory.events if not event.name.startswith("zeno")]
    # Of contacts that close at once the program names the one that it found.
    assert len(expected) >= len(found) >= len({event.t for event in expected})
    span = trajectory.t[-1] - trajectory.t[0]
    times = np.array([event.t for event in expected])
    for t, kind, contact in found:
        same = [e for e in expected if e.name == f"{kind}:{contact}"]
        assert min(abs(e.t - float(t)) for e in same) <= 1e-6 * span
        assert np.abs(times - float(t)).min() <= 1e-6 * span
    for coordinate in trajectory.coordinates:
        last = trajectory.state[coordinate]
        scale = trajectory.scales[coordinate]
        assert abs(columns[coordinate][-1] - last) <= 1e-6 * scale
        rate = f"dot({coordinate})"
        assert abs(columns[rate][-1] - trajectory.state[rate]) <= 1e-5 * trajectory.scales[rate]

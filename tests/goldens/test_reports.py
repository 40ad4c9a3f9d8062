"""Reports of four scenes in every format, as they were last read and approved.

The scenes have between them a plain motion, an axis that is driven, constraints with multipliers
and contacts. ``pytest tests/goldens --update-goldens`` writes the reports anew; read the difference
before you commit it. Values that are measured are replaced: those of trade-offs and stress, of
which nothing else is left, are in ``tests/report/approved``.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import chdir
from dataclasses import replace
from functools import cache, partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import pytest

from lagrange_cli import Derivation, load
from lagrange_cli.api import check_paths
from lagrange_cli.report.formats import ReportForm
from lagrange_cli.report.values.simulation import Simulated
from tests.goldens.in_formats import EVERY, LIGHT, compared, headed, in_formats, settled

HERE = Path(__file__).resolve().parent / "reports"
SYSTEMS = HERE.parents[2] / "systems"

SCENES = {
    "pendulum": "pendulums/pendulum.yaml",
    "pendulum_driven_support": "lecture/pendulum_driven_support.yaml",
    "knife_edge_on_incline": "rolling/knife_edge_on_incline.yaml",
    "bouncing_ball": "contact/bouncing_ball.yaml",
}


@cache
def derivation(scene: str) -> Derivation:
    """The derivation with its steps, and with constraint forces, which all reports share."""
    found = load(SYSTEMS / SCENES[scene]).derive(steps="lagrange", forces=True)
    parts = found.equations.derivation
    shown = replace(
        parts,
        certificate=replace(parts.certificate, mismatch=1e-30),
        steps=replace(parts.steps, mismatch=1e-30),
    )
    return replace(found, equations=replace(found.equations, derivation=shown))


@cache
def without_steps(scene: str) -> Derivation:
    found = derivation(scene)
    shown = replace(found.equations.derivation, steps=None)
    return replace(found, equations=replace(found.equations, derivation=shown))


def written(found: Any, format_: str, code: str) -> object:
    language = {} if format_ == "json" else {"language": code}
    return found.written(format_, **language)


def reported(value: object, format_: str, code: str) -> object:
    return ReportForm(format_, code).written(value)


def derive(scene: str) -> str:
    found = without_steps(scene)
    return in_formats(partial(written, found)) + headed("text in ASCII", found.text(ascii=True))


def emit(scene: str) -> str:
    """LaTeX in other styles than that of documents."""
    chosen = {"snippet": {"macros": True}, "beamer": {"language": "de"}}
    found = without_steps(scene)
    emitted = {style: found.emit("latex", style=style, **more) for style, more in chosen.items()}
    return "".join(headed(style, *files.values()) for style, files in emitted.items())


def steps(scene: str) -> str:
    return in_formats(partial(written, derivation(scene)), LIGHT)


def analyze(scene: str) -> str:
    return in_formats(partial(written, without_steps(scene).analyze()))


def simulate(scene: str) -> str:
    found = without_steps(scene)
    trajectory = found.simulate(extra=["conserved"])
    simulated = Simulated(settled(trajectory), found.model(), ("energy",), 0.1)
    return in_formats(partial(reported, simulated))


def section(scene: str) -> str:
    condition = {"pendulum": "theta = 0", "knife_edge_on_incline": "x = 0.1, dot(x) > 0"}[scene]
    found = without_steps(scene).section(condition, until=5.0)
    return in_formats(partial(reported, settled(found)))


def path(scene: str) -> str:
    name = {"pendulum": "theta", "pendulum_driven_support": "theta"}[scene]
    found = without_steps(scene).path({name: 0, "t": 0}, {name: 0.5, "t": 1}, starts=4)
    return in_formats(partial(reported, settled(found)))


def ensemble(scene: str) -> str:
    """Of two members one cannot be begun."""
    members = {"theta": [0.1], "m": [1, -1]}
    found = without_steps(scene).ensemble(members, until=1.0, reduce=["max(theta)"])
    arrays = {
        name: settled(array, "error" if name.startswith(("reduced_error", "member/est")) else "")
        for name, array in found.arrays.items()
    }
    value = replace(found, arrays=arrays)
    of_values = [(format_, code) for format_, code in EVERY if format_ != "json"]
    return in_formats(partial(reported, value), of_values)


def fit(scene: str) -> str:
    """Of two periods, of which every measurement is off by a thousandth, either way."""
    found = without_steps(scene)
    angle = found.simulate(until=2.0, samples=21, initial={"theta": 0.3}).columns["theta"]
    sides = "+-++-+--+---+-+-++--+"
    rows = (f"{k / 10},{x + float(sides[k] + '1e-3'):.4f}\n" for k, x in enumerate(angle))
    with TemporaryDirectory() as folder:
        file = Path(folder) / "measured.csv"
        file.write_text("t,theta\n" + "".join(rows))
        return in_formats(partial(reported, settled(found.fit(file, ["l", "theta"]))))


def check(scene: str) -> str:
    """Expectations that hold, and one that does not."""
    text = (SYSTEMS / SCENES[scene]).read_text(encoding="utf-8")
    with TemporaryDirectory() as folder, chdir(folder):
        Path("good.yaml").write_text(text, encoding="utf-8")
        Path("bad.yaml").write_text(text.replace("dof: 1", "dof: 2"), encoding="utf-8")
        return in_formats(partial(reported, settled(check_paths(["good.yaml", "bad.yaml"]))))


COMMANDS: dict[Callable[[str], str], tuple[str, ...]] = {
    derive: tuple(SCENES),
    steps: tuple(SCENES),
    analyze: tuple(SCENES),
    simulate: tuple(SCENES),
    section: ("pendulum", "knife_edge_on_incline"),
    path: ("pendulum", "pendulum_driven_support"),
    emit: ("pendulum_driven_support",),
    ensemble: ("pendulum",),
    fit: ("pendulum",),
    check: ("pendulum",),
}

CASES = [(scene, command) for command, scenes in COMMANDS.items() for scene in scenes]


@pytest.mark.parametrize(
    ("scene", "command"), CASES, ids=lambda part: getattr(part, "__name__", part)
)
def test_reports_are_those_that_were_approved(scene, command, updates):
    compared(command(scene), HERE / scene / f"{command.__name__}.txt", updates)


def test_every_file_has_its_report():
    listed = {HERE / scene / f"{command.__name__}.txt" for scene, command in CASES}
    assert set(HERE.rglob("*.txt")) == listed

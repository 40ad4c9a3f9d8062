"""Extremes with their exact motions: what is asked for, what is found, how far it is off.

``python benchmarks/extremes.py`` runs all of them for the table in docs/quality/extremes.md;
tests run those that take a moment.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from lagrange_cli import load
from lagrange_cli.api import loads
from lagrange_cli.errors import InputError
from tests.extremes import extreme_exact as exact

__all__ = ["CASES", "Case", "Found", "found"]

SYSTEMS = Path(__file__).parents[2] / "systems"

#: Columns of the exact motion at some times.
Columns = Callable[[Sequence[float]], Mapping[str, Sequence[float]]]


@dataclass(frozen=True)
class Case:
    """A scene (a path in systems/, or its text) at an extreme.

    ``expected`` are the outcomes that are right, ``says`` what a reason has to contain;
    ``long``: it takes more than a moment.
    """

    axis: str
    value: float
    title: str
    scene: str
    exact: Columns | None = None
    parameters: Mapping[str, float | str] = field(default_factory=dict)
    initial: Mapping[str, float | str] = field(default_factory=dict)
    until: float = 1.0
    samples: int = 41
    accuracy: float = 1e-9
    expected: tuple[str, ...] = ("holds",)
    says: str = ""
    long: bool = False
    how: Mapping[str, Any] = field(default_factory=dict)

    @property
    def name(self) -> str:
        return f"{self.axis}-{self.title}".replace(" ", "_")


@dataclass(frozen=True)
class Found:
    """What came of a case; see :class:`lagrange_cli.studies.stress.runs.StressRun`."""

    case: Case
    outcome: str
    error: float | None = None
    estimated: float | None = None
    holds_until: float | None = None
    reason: str = ""
    energy_drift: float | None = None


def as_it_is(value: float | str) -> float | str:
    """A double as a quotient: its decimal is another number, which a separatrix tells apart."""
    if isinstance(value, str) or float(value).is_integer():
        return value
    above, below = float(value).as_integer_ratio()
    return f"{above}/{below}"


def found(case: Case) -> Found:
    """Simulate a case and compare it with its exact motion."""
    try:
        given = {
            "initial": {name: as_it_is(value) for name, value in case.initial.items()},
            "parameters": {name: as_it_is(value) for name, value in case.parameters.items()},
        }
        scene = (
            loads(case.scene, **given)
            if "\n" in case.scene
            else load(SYSTEMS / f"{case.scene}.yaml", **given)
        )
        asked = {"accuracy": case.accuracy} | dict(case.how)
        run = scene.derive().simulate(until=case.until, samples=case.samples, **asked)
    except InputError as refusal:
        return Found(case, "refused", reason=str(refusal))
    if len(run.t) < 2:
        return Found(case, "refused", reason=run.reason)
    assert case.exact is not None
    right = {name: np.array(values) for name, values in case.exact(run.t.tolist()).items()}
    # Places that are no coordinates of the run are measured as if they were.
    moved = {name: np.abs(x - x[0]).max() for name, x in right.items() if name not in run.scales}
    scales = {name: max(x, 1e-3 * max(moved.values())) for name, x in moved.items()}
    scales |= run.scales
    error = max(
        float(np.abs(run.columns[name] - values).max() / scales[name])
        for name, values in right.items()
    )
    outcome = "holds" if run.status == "ok" else "degraded"
    if run.requested is not None and error > run.requested:
        outcome = "wrong"
    return Found(case, outcome, error, run.estimated, run.holds_until, run.reason, run.energy_drift)


def _columns(names: Sequence[str], rows: Sequence[Sequence[Any]]) -> dict[str, list[float]]:
    return {name: [float(row[k]) for row in rows] for k, name in enumerate(names)}


def _stored(name: str, names: Sequence[str], times: Sequence[float]) -> dict[str, list[float]]:
    """Of a stored reference, the rows at these times, which are among its own."""
    known, rows = exact.stored(name)
    return _columns(names, [rows[known.index(t)] for t in times])


# Mass ratios.

ANGLES = ("theta1", "theta2", "dot(theta1)", "dot(theta2)")


def _double_pendulums() -> Iterator[Case]:
    for ratio, end in exact.RATIOS.items():
        name = f"double pendulum {ratio:.0e}"
        yield Case(
            *("mass ratio", ratio, f"double pendulum, m2/m1 = {ratio:.0e}"),
            "pendulums/double_pendulum",
            partial(_stored, name, ANGLES),
            {"m1": 1.0, "m2": ratio} if ratio > 1 else {"m1": 1 / ratio, "m2": 1.0},
            until=end,
            samples=5,
            expected=("holds", "degraded"),
            long=ratio in (1e9, 1e12),
        )


def _atwood(m1: float, m2: float, times: Sequence[float]) -> dict[str, list[float]]:
    a = (m1 - m2) / (m1 + m2) * 9.81
    return {
        "x": [1.0 - 0.2 * t + a * t * t / 2 for t in times],
        "dot(x)": [-0.2 + a * t for t in times],
    }


def _atwoods() -> Iterator[Case]:
    for ratio in (1e-12, 1e-6, 1e6, 1e12):
        yield Case(
            *("mass ratio", ratio, f"Atwood's machine, m2/m1 = {ratio:.0e}"),
            "pulleys/atwood",
            partial(_atwood, 1.0, ratio),
            {"m1": 1.0, "m2": ratio},
            until=2.0,
            accuracy=1e-12,
        )


# Stiffness.

SPRINGS = ("x1", "x2", "dot(x1)", "dot(x2)")


def _springs(
    k: float, k2: float, times: Sequence[float], start: Sequence[float] = (0.1, 0.1 + 1e-9)
) -> dict[str, list[float]]:
    return _columns(SPRINGS, exact.springs(start, [0.0, 0.0], times, 1.0, k, k2))


def _stiff() -> Iterator[Case]:
    for k2 in (1e4, 1e6, 1e8, 1e10, 1e12):
        yield Case(
            *("stiffness", k2, f"a spring of {k2:.0e} N/m beside one of 10 N/m"),
            "oscillators/coupled_oscillators",
            partial(_springs, 10.0, k2),
            {"k2": k2},
            {"x1": 0.1, "x2": 0.1 + 1e-9},
            until=2.0,
            accuracy=1e-6,
            expected=("holds", "degraded", "refused"),
            long=k2 > 1e6,
            how={"budget": 40.0},
        )


# Eccentricity.

KEPLER = """\
parameters: {mu: 1}
particles: {planet: {mass: 1, position: [x, y, 0]}}
coordinates: [x, y]
potentials: {gravitation: "-mu/norm(x, y)"}
"""

PLANE = ("x", "y", "dot(x)", "dot(y)")


def _orbits() -> Iterator[Case]:
    # No sample is at a perihelion, where velocities are the most sensitive.
    for power, accuracy, turns, outcomes in (
        *((1, 1e-9, 10.25, ("holds",)), (3, 1e-9, 10.25, ("holds",))),
        *((6, 1e-6, 10.25, ("holds",)), (6, 1e-9, 10.25, ("refused",))),
        *((8, 1e-6, 0.3, ("holds",)), (9, 1e-6, 0.3, ("holds", "degraded"))),
        *((9, 1e-3, 10.25, ("holds", "refused")), (9, 1e-9, 10.25, ("refused",))),
    ):
        near = 10.0**-power
        speed = math.sqrt((2 - near) / near)
        yield Case(
            *("eccentricity", near, f"{turns} orbits of e = 1 - {near:.0e}, to {accuracy:.0e}"),
            KEPLER,
            lambda times, r=near, v=speed: _columns(PLANE, exact.kepler(r, v, times)),
            initial={"x": near, "y": 0.0, "dot(x)": 0.0, "dot(y)": speed},
            until=2 * math.pi * turns,
            samples=11,
            accuracy=accuracy,
            expected=outcomes,
            says="can be held" if (power, accuracy) == (6, 1e-9) else "",
            long=power > 5 and turns > 1,
        )


# Separatrices, long motions, large angles.

PENDULUM = ("theta", "dot(theta)")


def _pendulum(start: float, times: Sequence[float]) -> dict[str, list[float]]:
    return _columns(PENDULUM, exact.pendulum(start, times))


def _pendulums() -> Iterator[Case]:
    shared = {"scene": "pendulums/pendulum", "parameters": {"l": 1.0, "g": 9.81}}
    for distance in (1e-3, 1e-6, 1e-9, 1e-12):
        start = math.pi - distance
        yield Case(
            *("separatrix", distance, f"pendulum released at pi - {distance:.0e}"),
            exact=partial(_pendulum, start),
            initial={"theta": start},
            until=12.0,
            samples=25,
            expected=("holds",),
            **shared,
        )
    for periods, long in ((1e2, False), (1e4, True), (1e6, True)):
        yield Case(
            *("duration", periods, f"pendulum for {periods:.0e} periods"),
            exact=partial(_pendulum, 1.0),
            initial={"theta": 1.0},
            until=periods * 2.14,
            samples=21,
            accuracy=1e-6,
            expected=("holds", "degraded"),
            long=long,
            how={"budget": 120.0},
            **shared,
        )
    far = 1.0 + 2 * math.pi * 15915494
    for accuracy, outcome, says in ((1e-6, "holds", ""), (1e-9, "refused", "6e-08")):
        yield Case(
            *("angle", far, f"pendulum at 1e8 rad, to {accuracy:.0e}"),
            exact=partial(_pendulum, far),
            initial={"theta": far},
            until=10.0,
            accuracy=accuracy,
            expected=(outcome,),
            says=says,
            **shared,
        )


# Singular places of coordinates.

SPACE = tuple(f"{form}" for form in ("x", "y", "z", "dot(x)", "dot(y)", "dot(z)"))


def _sphere(theta: float, turning: float, times: Sequence[float]) -> dict[str, list[float]]:
    sine, cosine = (float(f(theta)) for f in (exact.mp.sin, exact.mp.cos))
    start = [sine, 0.0, -cosine, 0.0, turning * sine, 0.0]
    return _columns(SPACE[:3], exact.spherical_pendulum(start, times))


def _poles() -> Iterator[Case]:
    for turning in (0.0, 1e-9, 1e-3):
        yield Case(
            *("chart", turning, f"spherical pendulum past the pole, turning at {turning:.0e}"),
            "pendulums/spherical_pendulum",
            partial(_sphere, 1.2, turning),
            initial={"theta": 1.2, "dot(phi)": turning},
            until=1.0,
            samples=5,
            expected=("holds", "degraded"),
        )


def _from_the_top(start: float, times: Sequence[float]) -> dict[str, list[float]]:
    """Beside the upper pole all grows as a hyperbolic cosine; the azimuth does not depend on how
    close it begins."""
    w = math.sqrt(9.81)
    return {"phi": [math.atan2(1.3 / w * math.tanh(w * t), 1.0) for t in times]}


def _tops() -> Iterator[Case]:
    """Angles whose last place is as large as their distance from the pole, and not."""
    for distance, outcomes in ((0.0, ("refused",)), (1e-12, ("refused",)), (1e-5, ("holds",))):
        start = math.pi - distance
        yield Case(
            *("chart", distance, f"spherical pendulum from {distance:.0e} beside the upper pole"),
            "pendulums/spherical_pendulum",
            partial(_from_the_top, start),
            initial={"theta": start},
            until=0.2,
            samples=5,
            expected=outcomes,
            accuracy=1e-9,
        )


TOP = """\
parameters: {I1: 2, I3: 1}
coordinates: [phi, theta, psi]
kinetic:
  transverse: I1/2*(dot(theta)^2 + dot(phi)^2*sin(theta)^2)
  axial: I3/2*(dot(psi) + dot(phi)*cos(theta))^2
"""


def _still(times: Sequence[float]) -> dict[str, list[float]]:
    """A free top that turns about an axis across its own: theta grows evenly."""
    return {"theta": [0.5 - t for t in times], "dot(theta)": [-1.0 for _ in times]}


def _gimbal() -> Iterator[Case]:
    yield Case(
        *("chart", 0.0, "Euler angles at the start in gimbal lock"),
        TOP,
        None,
        initial={"phi": 0.0, "theta": 0.0, "psi": 0.0, "dot(phi)": 1.0},
        expected=("refused",),
        says="singular",
    )
    yield Case(
        *("chart", 1.0, "Euler angles through gimbal lock"),
        TOP,
        _still,
        initial={"phi": 0.0, "theta": 0.5, "psi": 0.0, "dot(theta)": -1.0},
        until=1.0,
        expected=("holds", "degraded"),
    )


# Units.


def _units() -> Iterator[Case]:
    for mass, length in ((1e-31, 1e-12), (1e30, 1e16)):
        yield Case(
            *("units", length, f"springs in units of {mass:.0e} kg and {length:.0e} m"),
            "oscillators/coupled_oscillators",
            lambda times, unit=length: {
                name: [unit * x for x in values]
                for name, values in _springs(10.0, 0.8, times, (0.1, 0.0)).items()
            },
            {"m": mass, "k": 10.0 * mass, "k2": 0.8 * mass, "d": length},
            {"x1": 0.1 * length},
            until=20.0,
        )


# What vanishes.

WHEEL = """\
parameters: {J: 1, k: 1, m: 1, l: 1}
particles: {bob: {mass: m, position: [l*sin(theta), 0, -l*cos(theta)]}}
coordinates: [theta, phi]
kinetic: {wheel: J/2*dot(phi)^2}
potentials: {spring: k/2*(phi - theta)^2}
initial: {theta: 1, phi: 0}
"""


def _vanishing() -> Iterator[Case]:
    for name, says in (("J", "'phi'"), ("l", "'theta'"), ("m", "the mass of 'bob'")):
        yield Case(
            *("degenerate", 0.0, f"{name} = 0"),
            WHEEL,
            parameters={name: 0},
            expected=("refused",),
            says=says,
        )
    yield Case(
        *("degenerate", 0.0, "k2 = 0: two springs apart"),
        "oscillators/coupled_oscillators",
        lambda times: _springs(10.0, 0.0, times, (0.1, 0.0)),
        {"k2": 0},
        until=20.0,
    )
    for length in (1e200, 1e-200):
        yield Case(
            *("degenerate", length, f"a pendulum of {length:.0e} m"),
            "pendulums/pendulum",
            parameters={"l": length},
            expected=("refused",),
            says="overflow" if length > 1 else "underflow",
        )


# Constraints.


def _taut(times: Sequence[float]) -> dict[str, list[float]]:
    known, rows = exact.stored("taut chain")
    angles = np.array([rows[known.index(t)][:6] for t in times])
    places = {}
    for axis, share in (("x", np.sin(angles)), ("z", -np.cos(angles))):
        for k, column in enumerate(np.cumsum(0.5 * share, axis=1).T, 1):
            places[f"{axis}[{k}]"] = column.tolist()
    return places


def _constraints() -> Iterator[Case]:
    angles = np.array([1e-3 * (-1) ** k for k in range(6)])
    start = {}
    for axis, share in (("x", np.sin(angles)), ("z", -np.cos(angles))):
        start |= {f"{axis}[{k}]": float(x) for k, x in enumerate(np.cumsum(0.5 * share), 1)}
    yield Case(
        *("constraints", 6.0, "chain of six rods, almost taut"),
        (SYSTEMS / "chains/chain_of_rods.yaml")
        .read_text()
        .replace("{n: 4}", "{n: 6}")
        .partition("expect:")[0],
        _taut,
        initial=start,
        until=2.0,
        samples=5,
        accuracy=1e-7,
    )
    yield Case(
        *("constraints", 0.0, "parallelogram linkage, folded"),
        (SYSTEMS / "constraints/four_bar_linkage.yaml").read_text().partition("near:")[0],
        parameters={"a": 1.0, "b": 2.0, "c": 1.0, "d": 2.0},
        initial={"alpha": 0.0, "beta": 0.0, "gamma": 0.0, "dot(alpha)": 1.0},
        expected=("refused",),
        says="singular",
    )


# Ends of motions.

LINE = """\
parameters: {{}}
particles: {{p: {{mass: 1, position: [x, 0, 0]}}}}
coordinates: [x]
potentials: {{v: "{}"}}
"""


def _ends() -> Iterator[Case]:
    yield Case(
        *("blow-up", 1.0, "x'' = 2 x^3: infinite at t = 1"),
        LINE.format("-x^4/2"),
        lambda times: {
            "x": [1 / (1 - t) for t in times],
            "dot(x)": [1 / (1 - t) ** 2 for t in times],
        },
        initial={"x": 1.0, "dot(x)": 1.0},
        until=2.0,
        samples=501,
        expected=("degraded",),
        says="cannot be continued past t = 1",
    )
    yield Case(
        *("blow-up", 1e308, "x'' = x: beyond doubles at t = 710"),
        LINE.format("-x^2/2"),
        lambda times: {"x": list(map(math.exp, times)), "dot(x)": list(map(math.exp, times))},
        initial={"x": 1.0, "dot(x)": 1.0},
        until=1000.0,
        samples=501,
        expected=("degraded",),
    )
    yield Case(
        *("blow-up", 0.0, "the edge of where a root exists"),
        LINE.format("sqrt(1 - x)"),
        _towards_the_edge,
        initial={"x": 0.0, "dot(x)": 0.0},
        until=4.0,
        samples=201,
        expected=("degraded",),
        says="cannot be continued past t = 1.88",
    )


def _towards_the_edge(times: Sequence[float]) -> dict[str, list[float]]:
    """x'' = 1/(2 sqrt(1 − x)) from rest at 0 reaches 1 at t = 4 sqrt(2)/3.

    With s = sqrt(1 − x) and w = sqrt(1 − s): dot(x) = sqrt(2) w, t = 2 sqrt(2) (w − w³/3).
    """
    places, rates = [], []
    for t in map(exact.mpf, times):
        w = 2 * exact.mp.sin(exact.mp.asin(3 * t / (4 * exact.mp.sqrt(2))) / 3)
        places.append(float(1 - (1 - w * w) ** 2))
        rates.append(float(exact.mp.sqrt(2) * w))
    return {"x": places, "dot(x)": rates}


def _chaos() -> Iterator[Case]:
    yield Case(
        *("chaos", 30.0, "double pendulum from (3, 3) for 30 s"),
        "pendulums/double_pendulum",
        partial(_stored, "chaos", ANGLES),
        initial={"theta1": 3.0, "theta2": 3.0},
        until=30.0,
        samples=16,
        expected=("holds",),
    )


CASES = tuple(
    case
    for family in (
        *(_double_pendulums, _atwoods, _stiff, _orbits, _pendulums, _poles, _tops, _gimbal, _units),
        *(_vanishing, _constraints, _ends, _chaos),
    )
    for case in family()
)

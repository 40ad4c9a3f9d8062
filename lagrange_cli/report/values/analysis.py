"""An analysis as JSON values: what ``lagrange analyze --json`` writes.

Closed forms are in the scene language, so that they can be read back.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from lagrange_cli.analysis.symmetries.linear_symmetries import Symmetries, Symmetry
from lagrange_cli.analysis.values import continuous_phase
from lagrange_cli.notation.build import display
from lagrange_cli.notation.scene_language import ScenePrinter
from lagrange_cli.notation.vocabulary import vocabulary
from lagrange_cli.report.contents.analysis.contacts import contacts_report, with_results
from lagrange_cli.report.values.steps import closed_form

if TYPE_CHECKING:
    from numpy.typing import NDArray
    from sympy import Expr

    from lagrange_cli.analysis.branches.values import Branch, Branches, MarkedPoint
    from lagrange_cli.analysis.equilibria.steady import SteadyForm
    from lagrange_cli.analysis.result import Analysis, Exponents
    from lagrange_cli.analysis.values import (
        Channel,
        Equilibria,
        Equilibrium,
        Existence,
        FrequencyResponse,
        Linearization,
        Mode,
        Turning,
    )

_Say = Callable[["Expr"], str]


def analysis_report(analysis: Analysis) -> dict[str, Any]:
    """Return an analysis as values that JSON can hold.

    Parts that were not asked for, or are left out, are null.
    """
    equations = analysis.equations

    letters, steady = with_results(analysis, vocabulary(equations)), analysis.steady

    def say(expression: Expr) -> str:
        return ScenePrinter().inline(display(expression, letters))

    every = [c.name for c in equations.system.coordinates]
    names = [c.name for c in analysis.rest_equations.system.coordinates]
    symmetries = analysis.symmetries or Symmetries((), complete=False, unproven=0)
    equilibria, linear, modes = analysis.equilibria, analysis.linearization, analysis.modes
    return {
        "name": equations.presentation.name,
        "coordinates": every,
        "cyclic": list(equations.derivation.cyclic),
        "conserved": [
            {"name": c.name, "expression": say(c.expression), "symmetry": c.reason}
            for c in equations.derivation.conserved
        ]
        + [_symmetry(s, every, say) for s in symmetries.proven],
        "symmetries": None
        if analysis.symmetries is None
        else {"matrices": symmetries.complete, "unproven": symmetries.unproven},
        "steady": None if steady is None else _steady(steady),
        **_equilibria(equilibria, names, say, steady),
        "linearization": None if linear is None else _linearization(linear, names, say),
        "modes": None if modes is None else [_mode(mode, say) for mode in modes],
        "left_out": [{"part": left.part, "reason": left.reason} for left in analysis.left_out],
        **_exponents(analysis.exponents),
        **branches_report(analysis.branches, every),
        **({} if analysis.along is None else {"along": dict(analysis.along.report)}),
        **_response(analysis.response),
        **contacts_report(analysis.contacts, say),
    }


def _response(result: FrequencyResponse | None) -> dict[str, Any]:
    if result is None:
        return {}
    return {
        "response": {
            "from": result.low,
            "to": result.high,
            "inputs": list(result.inputs),
            "outputs": list(result.outputs),
            "settles": result.settles,
            "error": result.error,
            "omega": result.frequencies.tolist(),
            "channels": [_channel(result, channel) for channel in result.channels],
        }
    }


def _channel(result: FrequencyResponse, channel: Channel) -> dict[str, Any]:
    """Gains and phases along ω, null at undamped poles."""
    gains = result.gains[
        :, result.outputs.index(channel.output), result.inputs.index(channel.source)
    ]
    known = np.isfinite(gains)
    columns = (("gain", np.abs(gains)), ("phase", continuous_phase(gains)))
    return {
        "input": channel.source,
        "output": channel.output,
        "static": channel.static,
        "peaks": [{"omega": p.frequency, "gain": p.gain, "phase": p.phase} for p in channel.peaks],
        **{
            name: [x if is_known else None for x, is_known in zip(x.tolist(), known, strict=True)]
            for name, x in columns
        },
    }


def response_arrays(report: Mapping[str, Any]) -> dict[str, NDArray[Any]]:
    """Return the response of a report as arrays: ``omega``, and ``response`` of shape (ω, outputs,
    inputs), complex, not a number at undamped poles."""
    response = report["response"]
    shape = len(response["omega"]), len(response["outputs"]), len(response["inputs"])
    gains = np.zeros(shape, dtype=complex)
    for channel in response["channels"]:
        sizes, phases = (
            np.array([np.nan if x is None else x for x in channel[key]], dtype=float)
            for key in ("gain", "phase")
        )
        place = (
            response["outputs"].index(channel["output"]),
            response["inputs"].index(channel["input"]),
        )
        gains[:, *place] = sizes * np.exp(1j * phases)
    return {"omega": np.array(response["omega"]), "response": gains}


def _exponents(result: Exponents | None) -> dict[str, Any]:
    if result is None:
        return {}
    return {
        "lyapunov": {
            "exponents": list(result.values),
            "spreads": list(result.spreads),
            "from": result.start,
            "until": result.until,
        }
    }


def _symmetry(symmetry: Symmetry, names: Sequence[str], say: _Say) -> dict[str, Any]:
    field = {n: say(x) for n, x in zip(names, symmetry.field, strict=True) if x != 0}
    return {
        "name": symmetry.name,
        "expression": say(symmetry.expression),
        "symmetry": symmetry.described(names),
        "field": field,
    }


def _steady(steady: SteadyForm) -> dict[str, Any]:
    return {
        "ignored": [m.coordinate.name for m in steady.momenta],
        "momenta": [m.name for m in steady.momenta],
        "given": {symbol.name: value for symbol, value in steady.given_values},
    }


def _turning(turning: Turning | None, steady: SteadyForm | None, say: _Say) -> dict[str, Any]:
    """Write momenta and rates of ignored coordinates; nothing of an equilibrium at rest."""
    if turning is None or steady is None:
        return {}
    written: dict[str, Any] = {}
    for key, symbols, numbers, exact in (
        ("momenta", [m.symbol for m in steady.momenta], turning.momenta, turning.exact_momenta),
        ("rates", [m.coordinate.v for m in steady.momenta], turning.rates, turning.exact_rates),
    ):
        names = [symbol.name for symbol in symbols]
        values = [None] * len(names) if numbers is None else map(float, numbers)
        written[key] = _named(names, values)
        written[f"exact_{key}"] = None if exact is None else _named(names, map(say, exact))
    return written


def _equilibria(
    equilibria: Equilibria | None, names: Sequence[str], say: _Say, steady: SteadyForm | None
) -> dict[str, Any]:
    if equilibria is None:
        return {"equilibria": None}
    return {
        "equilibria": [_equilibrium(point, names, say, steady) for point in equilibria.points],
        "absent": [
            {
                "exact": _named(names, map(say, point.exact)),
                "exists": _conditions(point.conditions, say),
            }
            for point in equilibria.absent
        ],
        "complete": equilibria.complete,
        "nonzero": list(equilibria.nonzero),
        "starts": equilibria.starts,
        "held": dict(equilibria.held_inputs),
        "near": [_named(names, map(float, x.position)) for x in equilibria.unproven],
    }


def _equilibrium(
    point: Equilibrium, names: Sequence[str], say: _Say, steady: SteadyForm | None
) -> dict[str, Any]:
    stability = point.stability
    return {
        "at": _position(point, names),
        **closed_form(point, names, say),
        "isolated": point.isolated and not point.free,
        "stability": None if stability is None else stability.verdict,
        "reason": None if stability is None else stability.reason,
        "stable_where": [] if stability is None else _conditions(stability.stable_where, say),
        **_turning(point.turning, steady, say),
    }


def _position(point: Equilibrium, names: Sequence[str]) -> dict[str, float | None]:
    if point.position is None:
        return dict.fromkeys(names)
    return _named(names, map(float, point.position))


def _named(names: Sequence[str], values: Any) -> dict[str, Any]:
    return dict(zip(names, values, strict=True))


def _conditions(conditions: Sequence[Existence], say: _Say) -> list[str]:
    return [f"{say(c.smaller)} {c.relation} {say(c.larger)}" for c in conditions]


def _linearization(linear: Linearization, names: Sequence[str], say: _Say) -> dict[str, Any]:
    space, exact = linear.state_space, linear.exact
    rows = {}
    if exact is not None:
        rows = {"M": exact.mass, "C": exact.damping, "K": exact.stiffness}
        rows |= {} if exact.a is None or exact.b is None else {"A": exact.a, "B": exact.b}
    return {
        "at": _position(linear.at, names),
        "coordinates": list(linear.coordinates),
        "M": linear.mass.tolist(),
        "C": linear.damping.tolist(),
        "K": linear.stiffness.tolist(),
        "damping": linear.dissipative.tolist(),
        "gyroscopic": linear.gyroscopic.tolist(),
        "exact": {k: [[say(e) for e in row] for row in m] for k, m in rows.items()} or None,
        "state_space": {
            "states": list(space.states),
            "inputs": list(space.inputs),
            "outputs": list(space.outputs),
            "A": space.a.tolist(),
            "B": space.b.tolist(),
            "C": space.c.tolist(),
            "D": space.d.tolist(),
        },
    }


def _mode(mode: Mode, say: _Say) -> dict[str, Any]:
    pole, square, shape = mode.pole, mode.exact_square, mode.exact_shape
    return {
        "frequency": mode.frequency,
        "shape": [_amplitude(a, pole is not None) for a in mode.shape],
        "pole": None if pole is None else [pole.real, pole.imag],
        "exact_square": None if square is None else say(square),
        "exact_shape": None if shape is None else list(map(say, shape)),
    }


def _amplitude(value: complex, has_phase: bool) -> float | list[float]:
    """Write an amplitude: one number, or real and imaginary part."""
    value = complex(value)
    return [value.real, value.imag] if has_phase else value.real


def linearization_arrays(report: dict[str, Any]) -> dict[str, Any]:
    """Return the matrices of a report by name, as NumPy arrays for a file.

    C and D are those of outputs; ``mass``, ``damping``, ``gyroscopic`` and ``stiffness`` those of
    second order, damping being the symmetric part.
    """
    linear = report["linearization"]
    space = linear["state_space"]
    n, inputs = len(space["states"]), len(space["inputs"])
    shapes = {"B": (n, inputs), "D": (len(space["outputs"]), inputs)}
    arrays: dict[str, Any] = {
        name: np.array(space[name], dtype=float).reshape(shapes.get(name, (-1, n)))
        for name in ("A", "B", "C", "D")
    }
    arrays |= {name: np.array(space[name], dtype=str) for name in ("states", "inputs", "outputs")}
    arrays |= {
        "mass": np.array(linear["M"]),
        "damping": np.array(linear["damping"]),
        "gyroscopic": np.array(linear["gyroscopic"]),
        "stiffness": np.array(linear["K"]),
        "coordinates": np.array(linear["coordinates"], dtype=str),
    }
    return arrays


def branches_report(result: Branches | None, names: Sequence[str]) -> dict[str, Any]:
    """Return branches as values that JSON can hold; nothing if they were not asked for.

    ``names``: those of all coordinates.
    """
    if result is None:
        return {}
    return {
        "branches": {
            "parameter": result.parameter,
            "from": result.low,
            "to": result.high,
            "values": result.values,
            "starts": result.starts,
            "skipped": result.skipped,
            "left": result.left,
            "held": dict(result.held_inputs),
            "free": list(result.free),
            "marks": [_mark(mark, names) for mark in result.marks],
            "curves": [_branch(branch, result.parameter, names) for branch in result.branches],
        }
    }


def _mark(mark: MarkedPoint, names: Sequence[str]) -> dict[str, Any]:
    return {
        "kind": mark.kind,
        "value": mark.value,
        "error": mark.error,
        "at": dict(zip(names, mark.position, strict=True)),
        "frequency": mark.frequency,
    }


def _branch(branch: Branch, parameter: str, names: Sequence[str]) -> dict[str, Any]:
    columns = zip(names, branch.positions.T.tolist(), strict=True)
    poles = [_pole(column) for column in branch.locus.poles.T]
    return {
        "ends": list(branch.ends),
        "points": {parameter: branch.values.tolist(), **dict(columns)},
        "poles": {parameter: branch.locus.values.tolist(), "columns": poles},
        "marks": [{"point": k, "mark": number} for k, number in branch.marks],
        "stretches": [
            {
                "first": s.first,
                "last": s.last,
                "stability": s.stability.verdict,
                "reason": s.stability.reason,
            }
            for s in branch.stretches
        ],
    }


def _pole(column: NDArray[np.complex128]) -> dict[str, list[float | None]]:
    parts = {"real": column.real.tolist(), "imag": column.imag.tolist()}
    return {
        name: [x if math.isfinite(x) else None for x in values] for name, values in parts.items()
    }

"""Linear systems as JSON: at an equilibrium, along a motion, and their responses."""

from __future__ import annotations

from operator import itemgetter, methodcaller
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from lagrange_cli.analysis.values import continuous_phase
from lagrange_cli.report.values.equilibria import AT, at_rest
from lagrange_cli.report.values.expressions import (
    COMPLEX,
    ROWS,
    coordinate_names,
)
from lagrange_cli.report.values.json_types import (
    EXPRESSION,
    MAYBE_NUMBER,
    NAMES,
    NUMBER,
    REASON,
    TEXT,
    ConvertedType,
    JsonObject,
    Key,
    list_of,
    one_of,
    optional,
    or_null,
    through,
)
from lagrange_cli.report.values.steps import NamedEquilibrium

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from lagrange_cli.analysis.result import AlongMotion, Analysis, Exponents
    from lagrange_cli.analysis.values import (
        Channel,
        ExactMatrices,
        FrequencyResponse,
        Linearization,
        Mode,
        ResponsePeak,
        SampledLoop,
        StateSpace,
    )

_MATRIX = list_of(list_of(NUMBER))

# The linear system and its modes.


class NamedLinearization(NamedTuple):
    """A linear system with the names of the coordinates that rest."""

    linear: Linearization
    at: NamedEquilibrium


def named_linearization(analysis: Analysis) -> NamedLinearization | None:
    """Return the linear system of an analysis, None without one."""
    linear = analysis.linearization
    if linear is None:
        return None
    names = coordinate_names(analysis.rest_equations)
    return NamedLinearization(linear, at_rest(analysis.steady, linear.at, names))


_EXACT: JsonObject[ExactMatrices] = JsonObject(
    Key("M", ROWS, "M in closed form.", lambda exact: exact.mass),
    Key("C", ROWS, "C in closed form.", lambda exact: exact.damping),
    Key("K", ROWS, "K in closed form.", lambda exact: exact.stiffness),
    *optional(
        Key("A", ROWS, "A, where it is short.", lambda e: None if e.b is None else e.a),
        Key("B", ROWS, "B, where it is short.", lambda e: None if e.a is None else e.b),
    ),
)
_STATE_SPACE: JsonObject[StateSpace] = JsonObject(
    Key("states", NAMES, "Names of the states."),
    Key("inputs", NAMES, "Names of the inputs."),
    Key("outputs", NAMES, "Names of the outputs."),
    Key("A", _MATRIX, "A of ẋ = A x + B u.", lambda space: space.a),
    Key("B", _MATRIX, "B of ẋ = A x + B u.", lambda space: space.b),
    Key("C", _MATRIX, "C of y = C x + D u.", lambda space: space.c),
    Key("D", _MATRIX, "D of y = C x + D u.", lambda space: space.d),
)
LINEARIZATION: JsonObject[NamedLinearization] = JsonObject(
    *through(lambda value: value.at, AT),
    *through(
        lambda value: value.linear,
        Key("coordinates", NAMES, "Independent coordinates."),
        Key("M", _MATRIX, "M of M ẍ + C ẋ + K x = 0.", lambda linear: linear.mass),
        Key("C", _MATRIX, "C of this.", lambda linear: linear.damping),
        Key("K", _MATRIX, "K of this.", lambda linear: linear.stiffness),
        Key("damping", _MATRIX, "The symmetric part of C.", lambda linear: linear.dissipative),
        Key("gyroscopic", _MATRIX, "The antisymmetric part of C."),
        Key("exact", or_null(_EXACT), "The matrices in closed form, or null."),
        Key("state_space", _STATE_SPACE, "The same of first order."),
    ),
)


class _Amplitude(NamedTuple):
    value: complex
    has_phase: bool


_AMPLITUDE = ConvertedType(
    {"anyOf": [NUMBER.schema, COMPLEX.schema]},
    lambda a, say: COMPLEX.write(complex(a.value), say) if a.has_phase else complex(a.value).real,
)
MODE: JsonObject[Mode] = JsonObject(
    Key("frequency", NUMBER, "Its angular frequency."),
    Key(
        "shape",
        list_of(_AMPLITUDE),
        "Amplitudes of the independent coordinates; real and imaginary parts with a pole.",
        lambda mode: [_Amplitude(value, mode.pole is not None) for value in mode.shape],
    ),
    Key("pole", or_null(COMPLEX), "The exponent s of exp(s t); null of an undamped mode."),
    Key("exact_square", or_null(EXPRESSION), "ω² in closed form, or null."),
    Key("exact_shape", or_null(list_of(EXPRESSION)), "The amplitudes in closed form, or null."),
)

SAMPLED: JsonObject[SampledLoop] = JsonObject(
    Key("period", NUMBER, "Time until all controllers sample together again."),
    Key("states", NAMES, "Names of the states."),
    Key("inputs", NAMES, "Names of what is held."),
    *optional(
        Key("A", _MATRIX, "A of x after a period = A x + B u.", lambda loop: loop.a),
        Key("B", _MATRIX, "B of this.", lambda loop: loop.b),
    ),
    Key("poles", list_of(COMPLEX), "Poles of the loop that are not 0, the largest first."),
)

# Along motions.

EXPONENTS: JsonObject[Exponents] = JsonObject(
    Key("exponents", list_of(NUMBER), "The exponents, the largest first.", lambda e: e.values),
    Key("spreads", list_of(NUMBER), "Their standard errors."),
    Key("from", NUMBER, "Begin of the average.", lambda exponents: exponents.start),
    Key("until", NUMBER, "Its end."),
)
_ALONG_ACCURACY: JsonObject[AlongMotion] = JsonObject(
    Key("requested", NUMBER, "Largest error of a matrix that was asked for."),
    Key("estimated", NUMBER, "The estimated one."),
)
_MATRICES = {
    "A": "A(t) of δẋ = A δx + B δu.",
    "B": "B(t) of δẋ = A δx + B δu.",
    "C": "C(t) of δy = C δx + D δu.",
    "D": "D(t) of δy = C δx + D δu.",
}
_TENSOR = list_of(_MATRIX)
ALONG: JsonObject[AlongMotion] = JsonObject(
    Key("status", one_of("ok", "accuracy_not_reached", "stopped", "blow_up"), "How it ended."),
    Key("reason", REASON, "Why it is not ok; null if it is."),
    Key("accuracy", _ALONG_ACCURACY, "What is promised of the matrices.", lambda along: along),
    *through(
        lambda along: along.arrays,
        Key("t", list_of(NUMBER), "Times.", itemgetter("t")),
        Key("y", _MATRIX, "States there.", itemgetter("y")),
        Key("u", _MATRIX, "Inputs there.", itemgetter("u")),
        *(Key(name, _TENSOR, text, itemgetter(name)) for name, text in _MATRICES.items()),
        Key(
            "E",
            _TENSOR,
            "E(t) of E δx = 0, with constraints beside the coordinates.",
            methodcaller("get", "E"),
            optional=True,
        ),
    ),
    Key("inputs", NAMES, "Names of the inputs."),
    Key("outputs", NAMES, "Names of the outputs."),
    Key("states", NAMES, "Names of the states."),
)

# Frequency responses.


class _Response(NamedTuple):
    """A channel with its gains, shape (frequencies,); not a number at undamped poles."""

    channel: Channel
    gains: NDArray[np.complex128]


def _channels(result: FrequencyResponse) -> list[_Response]:
    inputs, outputs = result.inputs.index, result.outputs.index
    return [
        _Response(c, result.gains[:, outputs(c.output), inputs(c.source)]) for c in result.channels
    ]


_PEAK: JsonObject[ResponsePeak] = JsonObject(
    Key("omega", NUMBER, "Its angular frequency.", lambda peak: peak.frequency),
    Key("gain", MAYBE_NUMBER, "The gain; null where it is infinite."),
    Key("phase", MAYBE_NUMBER, "The phase in radians; null where the gain is infinite."),
)
_CHANNEL: JsonObject[_Response] = JsonObject(
    *through(
        lambda response: response.channel,
        Key("input", TEXT, "Name of the input.", lambda channel: channel.source),
        Key("output", TEXT, "Name of the output."),
        Key("static", MAYBE_NUMBER, "Response to a constant input; null if infinite."),
        Key("peaks", list_of(_PEAK), "Largest gains, and undamped poles."),
    ),
    Key(
        "gain",
        list_of(MAYBE_NUMBER),
        "Gains over omega; null at undamped poles.",
        lambda response: np.abs(response.gains),
    ),
    Key(
        "phase",
        list_of(MAYBE_NUMBER),
        "Phases over omega in radians; null at undamped poles.",
        lambda response: continuous_phase(response.gains),
    ),
)
RESPONSE: JsonObject[FrequencyResponse] = JsonObject(
    Key("from", NUMBER, "Lowest angular frequency.", lambda result: result.low),
    Key("to", NUMBER, "Highest angular frequency.", lambda result: result.high),
    Key("inputs", NAMES, "Names of the inputs."),
    Key("outputs", NAMES, "Names of the outputs."),
    Key(
        "settles",
        one_of("yes", "undamped", "unstable"),
        "yes: motions settle to these responses; undamped, unstable: some poles keep them from it.",
    ),
    Key("error", NUMBER, "Bound of relative rounding errors."),
    Key("omega", list_of(NUMBER), "Angular frequencies.", lambda result: result.frequencies),
    Key("channels", list_of(_CHANNEL), "Pairs of an input and an output that answers.", _channels),
)

# Arrays of a report, for files.


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

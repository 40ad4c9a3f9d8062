"""The section ``simulate`` of a scene as numbers, each within its range.

Every command that derives refuses a mistake in the scene here, at its place; an option that
replaces a number is checked at the begin of a run.
"""

from __future__ import annotations

from collections.abc import Callable

from lagrange_cli.errors import InputError, Mark, Problem
from lagrange_cli.mechanics.symbols.values import ParameterValues
from lagrange_cli.scene.conditions import MOST_SAMPLES, SimulationDefaults
from lagrange_cli.scene.language.expression import Expression
from lagrange_cli.scene.model import Scene


def simulation_defaults(scene: Scene, values: ParameterValues) -> SimulationDefaults:
    """Return the numbers of the section, None for absent ones.

    Raises
    ------
    InputError
        Located: a number that is out of its range.
    """
    section = scene.simulate

    def number(written: Expression | None) -> float | None:
        return None if written is None else values.float(written)

    defaults = SimulationDefaults(
        until=number(section.until),
        start=number(section.start) or 0.0,
        accuracy=number(section.accuracy),
        samples=_samples(section.samples, values),
        step=number(section.step),
        method=section.method,
        rtol=number(section.rtol),
        atol=number(section.atol),
        formulation=section.formulation,
        mark=section.mark or Mark(scene.file, 1, 1),
    )
    for name in ("accuracy", "rtol"):
        _require(getattr(section, name), getattr(defaults, name), name, "between 0 and 1", _is_part)
    for name in ("atol", "step"):
        _require(getattr(section, name), getattr(defaults, name), name, "positive", _is_positive)
    return defaults


def _is_part(value: float) -> bool:
    return 0 < value < 1


def _is_positive(value: float) -> bool:
    return value > 0


def _require(
    written: Expression | None,
    value: float | None,
    name: str,
    range_in_words: str,
    is_within: Callable[[float], bool],
) -> None:
    if written is not None and value is not None and not is_within(value):
        raise _refused(written, f"{name} must be {range_in_words}, found {written.text}")


def _samples(written: Expression | None, values: ParameterValues) -> int | None:
    value = None if written is None else values.number(written)
    if written is None or value is None:
        return None
    if not value.is_Integer:
        raise _refused(written, f"samples must be a whole number, found {written.text}")
    if not 2 <= value <= MOST_SAMPLES:
        says = f"samples must be from 2 to {MOST_SAMPLES:,}, found {written.text}"
        raise _refused(written, says)
    return int(value)


def _refused(written: Expression, message: str) -> InputError:
    return InputError(Problem(message, written.mark(), rule="simulate"))

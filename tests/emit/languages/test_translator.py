"""Routines in JavaScript run as in C; Python that is not translated is refused."""

from __future__ import annotations

import json

import numpy as np
import pytest

from lagrange_cli.api.emitters import EMITTERS
from lagrange_cli.emit.languages.interface import interface_of
from lagrange_cli.emit.languages.javascript import JavaScript as Printer
from lagrange_cli.emit.routines.signatures import routines_called, signature_of
from lagrange_cli.emit.routines.translation import routine_text
from lagrange_cli.errors import InternalError
from lagrange_cli.program.lowered.routines.elimination import solve_pivoted
from lagrange_cli.program.lowered.routines.numbers import Array, Integers
from lagrange_cli.program.lowered.routines.registry import ROUTINES
from tests.emit.emitted_c import Compiled, run, write
from tests.emit.languages.javascript import JavaScript
from tests.program.test_bandwidth import state
from tests.program.test_large_systems import CASES, near_rest
from tests.systems.shipped import APART, SCENES, derived

#: Scenes with closures: of positions and of rates, in singular mass matrices, by loops.
CLOSED = ("andrews_squeezer", "bicycle", "hanging_net", "net_of_rods_and_springs", "snakeboard")

#: Part of a scene's run that is compared: rounding has no time to grow.
SPAN = 1 / 200


def closed():
    """Scenes with closures, and those that a campaign looks at."""
    others = [name for name in (*SCENES, *APART) if name not in CLOSED]
    return [*CLOSED, *(pytest.param(name, marks=pytest.mark.campaign) for name in others)]


def emitted(equations, folder):
    ((name, text),) = EMITTERS["javascript"].emit(equations).items()
    (folder / name).write_text(text, encoding="utf-8")
    return folder / name


def table(text):
    lines = filter(None, text.splitlines()[1:])
    return np.array([[float(x) for x in line.split(",")] for line in lines])


@pytest.mark.slow
@pytest.mark.compiler
@pytest.mark.parametrize("name", closed())
def test_runs_with_closures_are_those_of_c(name, tmp_path):
    JavaScript().require()
    equations = derived(name)
    system = equations.system
    if not system.closures or system.contacts or system.initial is None:
        pytest.skip("no closures, or contacts beside them")
    start, end = system.simulate.start, system.simulate.until or system.simulate.start + 10
    words = [f"until={start + (end - start) * SPAN!r}", "steps=1"]
    source = write(equations, tmp_path, main=True)
    run("gcc", "-Og", source, "-o", tmp_path / "run", "-lm")
    expected = table(run(tmp_path / "run", *words))
    found = table(run("node", emitted(equations, tmp_path), *words))
    assert found.shape == expected.shape == (501, 1 + 2 * len(system.coordinates))
    assert np.abs(found[0] - expected[0]).max() <= 1e-15 * np.abs(expected[0]).max()
    assert (np.abs(found - expected) <= 1e-11 * np.abs(expected).max(axis=0) + 1e-300).all()


def called(module, calls):
    """Results of functions of a module, an array for each call."""
    text = f"import * as module from {json.dumps(str(module))};"
    text += f"for (const [f, t, y] of {json.dumps(calls)})"
    text += " console.log([...module[f](t, y)].join(' '));"
    (module.parent / "calls.mjs").write_text(text)
    return [
        np.array([float(x) for x in line.split()])
        for line in run("node", module.parent / "calls.mjs").splitlines()
    ]


@pytest.mark.slow
@pytest.mark.compiler
@pytest.mark.parametrize(("name", "routine"), [("tree", "sparse"), ("own_masses", "banded")])
def test_large_systems_are_solved_as_in_c(name, routine, tmp_path):
    JavaScript().require()
    equations = CASES[name]()
    compiled = Compiled(equations, tmp_path)
    y = near_rest(state(equations, 1))
    n, m = len(equations.system.coordinates), len(equations.system.closures)
    functions = {"rhs": 2 * n, "multipliers": m, "constraints": 2 * m}
    module = emitted(equations, tmp_path)
    calls = [[function, 0.0, y.tolist()] for function in (*functions, "project")]
    *results, projected = called(module, calls)
    for (function, size), found in zip(functions.items(), results, strict=True):
        status, expected = compiled(function, 0.0, y, compiled.defaults, size)
        assert status == 0
        np.testing.assert_allclose(found, expected, atol=1e-13 * np.abs(expected).max())
    assert f"solve_{routine}(" in module.read_text()
    if routine == "banded":  # no state near this one obeys the other's closures
        status, off = compiled("constraints", 0.0, projected, compiled.defaults, 2 * m)
        assert status == 0
        assert np.abs(off).max() < 1e-13 * np.abs(projected).max()


@pytest.mark.slow
def test_nothing_comes_of_singular_configurations(tmp_path):
    """The pendulum's weight at its hinge: the closure has no gradient there."""
    JavaScript().require()
    module = emitted(derived("pendulum_in_cartesian_coordinates"), tmp_path)
    state = [0.0, 0.0, 1.0, 2.0]
    calls = [[function, 0.0, state] for function in ("rhs", "multipliers", "project")]
    calls.append(["project", 0.0, [1e200, 1e200, 0.0, 0.0]])
    assert all(np.isnan(found).all() for found in called(module, calls))


@pytest.mark.slow
def test_a_start_off_the_closures_is_refused(tmp_path):
    JavaScript().require()
    module = emitted(derived("four_bar_linkage"), tmp_path)
    names = derived("four_bar_linkage").system.coordinates
    with pytest.raises(AssertionError, match=r"violates the constraints by .*; nearest: "):
        run("node", module, f"{names[0].name}=0.1")


def language():
    return Printer(interface_of(derived("kepler"), Printer.reserved))


def test_routines_are_told_with_their_comments():
    text = routine_text(signature_of(ROUTINES["definite"]), language())
    assert "Pivots are judged against the" in text
    assert "// The four rows among themselves." in text


def test_every_routine_is_translated():
    routines = routines_called(ROUTINES)
    texts = [routine_text(routine, language()) for routine in routines]
    assert len({routine.name for routine in routines}) == len(texts) > len(ROUTINES)
    changed = {a.name: a.changed for a in signature_of(ROUTINES["saddle"]).arguments}
    assert changed == dict.fromkeys("nm", False) | dict.fromkeys(
        ("a", "b", "d", "copy", "defect"), True
    )


def test_indices_and_integers_are_those_of_a_language():
    class FromOne(Printer):
        first = 1
        augments = False

        def counted(self, index):
            return f"real({index})"

    def routine(n: int, a: Array, at: Integers) -> float:
        """Do a bit of everything."""
        a[0] = 1.0
        for i in range(n):
            a[i + 1] -= a[at[i]] - 2.0
            a[2 * i] *= (n + 1) * a[i] / -a[0]
        return max(a[0], a[1])

    text = routine_text(signature_of(routine), FromOne(language().interface))
    assert "a[1] = 1.0;" in text
    assert "a[i + 2] = a[i + 2] - (a[at[i + 1] + 1] - 2.0);" in text
    assert "a[2*i + 1] = a[2*i + 1]*(real((n + 1))*a[i + 1]/(-a[1]));" in text
    assert "return Math.max(a[1], a[2]);" in text


def no_docstring(n: int) -> bool:
    return n > 1


def no_annotation(n) -> bool:
    """Return."""
    return n > 1


def unknown_kind(n: str) -> bool:
    """Return."""
    return n > "a"


def two_kinds(n: int) -> bool:
    """Return."""
    x = n
    x = 1.0
    return x > 0.0


def name_of_another_block(n: int) -> float:
    """Return."""
    if n > 1:
        x = 1.0
    return x


def name_without_value(n: int) -> bool:
    """Return."""
    return n > unknown  # noqa: F821


def negative_integer(n: int) -> int:
    """Return."""
    return -n


def numbers_of_two_kinds(n: int, a: Array) -> float:
    """Return."""
    return max(n, a[0])


def remainder(n: int) -> int:
    """Return."""
    return n % 2


def chained(n: int) -> bool:
    """Return."""
    return 1 < n < 3


def choice(n: int) -> float:
    """Return."""
    return 1.0 if n > 1 else 2.0


def several_names(n: int) -> int:
    """Return."""
    k, m = n, n
    return k + m


def piece(a: Array) -> float:
    """Return."""
    b = a[1:]
    return b[0]


def members(a: Array) -> float:
    """Return."""
    x = 0.0
    for y in a:
        x += y
    return x


def backward(n: int) -> int:
    """Return."""
    k = 0
    for i in range(n, 0, -1):
        k += i
    return k


def loop_with_an_end(n: int) -> int:
    """Return."""
    while n > 1:
        break
    else:
        return 1
    return 0


def foreign_call(n: int) -> int:
    """Return."""
    return len(str(n))


def other_arguments(n: int, a: Array) -> bool:
    """Return."""
    return solve_pivoted(a, a, n)


def call_among_terms(n: int, a: Array) -> bool:
    """Return."""
    return n > 1 and solve_pivoted(n, a, a[0])


def text_for_number(n: int) -> bool:
    """Return."""
    return n > "x"


@pytest.mark.parametrize(
    ("routine", "reason"),
    [
        (no_docstring, "no docstring"),
        (no_annotation, "an annotation is missing or unknown"),
        (unknown_kind, "an annotation is missing or unknown"),
        (two_kinds, "int and real under one name"),
        (name_of_another_block, "outside the block that assigns it first"),
        (name_without_value, "unknown name"),
        (negative_integer, "an integer that is negative"),
        (numbers_of_two_kinds, "numbers of two kinds"),
        (remainder, "unknown operator: n % 2"),
        (chained, "unknown expression"),
        (choice, "unknown expression"),
        (several_names, "unknown statement"),
        (piece, "unknown expression"),
        (members, "a loop without a range"),
        (backward, "a step that is not stated"),
        (loop_with_an_end, "unknown statement"),
        (foreign_call, "no routine"),
        (other_arguments, "arguments of other kinds"),
        (call_among_terms, "arguments of other kinds"),
        (text_for_number, "not a number"),
        (lambda: True, "not a plain function"),
    ],
)
def test_what_is_not_translated_is_an_internal_error(routine, reason):
    with pytest.raises(InternalError) as refusal:
        routine_text(signature_of(routine), language())
    assert reason in refusal.value.problems[0].message

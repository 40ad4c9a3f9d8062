"""Templates of emitted code are code of their language once their tokens have values."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest

import lagrange_cli.emit
from lagrange_cli.emit.c.target import CNames, CTarget, Real, real_type
from lagrange_cli.emit.python.interface import layout_tokens
from lagrange_cli.emit.template_files import c_template, filled, python_template
from lagrange_cli.state_layout import StateLayout
from tests.emit.emitted_c import WARNINGS, compiler, run

FOLDER = Path(lagrange_cli.emit.__file__).parent / "templates"
C_NAMES = sorted(path.name.removesuffix(".c.in") for path in (FOLDER / "c").iterdir())
PYTHON_NAMES = sorted(path.name.removesuffix(".py.in") for path in (FOLDER / "python").iterdir())

#: What lies within a function of another template, which is tested with it.
PARTS = ["project_positions", "projection_positions", "main_missing", "casadi_inputs"]
PARTS += [f"happens_{kind}" for kind in ("contacts", "switches", "both")]

STATE = "@REAL@ t, const @REAL@ *y, const @REAL@ *u, const system_params *p"
CANONICAL = STATE.replace("*y", "*z")
MOVED = STATE.replace("const @REAL@ *y", "@REAL@ *y")

#: Values of tokens, as those of a system with two contacts and three coordinates.
C_VALUES = {
    "@LED@": c_template("project_positions"),
    "@ARGUMENTS@": f"{STATE}, const @REAL@ *contact, @REAL@ *work, @REAL@ *out",
    "@OUT@": f"{STATE}, const int *mode, @REAL@ *work, @REAL@ *out",
    "@DYDT@": f"{STATE}, const int *mode, @REAL@ *work, @REAL@ *dydt",
    "@STATE@": f"{STATE}, const @REAL@ *contact",
    "@MODE@": f"{STATE}, const int *mode, @REAL@ *work, @REAL@ *out",
    "@PROJECT@": f"{STATE}, @REAL@ *work",
    "@PASSED@": "t, y, u, p, contact",
    "@RHS@": f"{STATE}, @REAL@ *work, @REAL@ *dydt",
    "@RESET@": f"{STATE}, int *mode, int event, @REAL@ bounce, @REAL@ *work",
    "@TESTS@": "    if (side[0]*place[0] < 0) {\n        return 1;\n    }",
    "@STATIC@": "static ",
    "@CONSTRAINTS@": "the gaps of the contacts, then their rates,",
    "@TEXT@": "force",
    "@LAST@": "2n-1",
    "@COUNTER@": "i, ",
    "@FUNCTION@": "multipliers",
    "@OF@": "",
    "@FALLING@": "    return contact[0] > @ZERO@ ? 0 : 1;",
    "@CHANGED@": "    status = contact[0] > @ZERO@ ? 0 : 1;",
    "@U@": "2",
    "@N@": "3",
    "@M@": "1",
    "@START@": "40",
    "@POSITIONS@": "2",
    "@CLOSURES@": "2",
    "@ROUNDS@": "12",
    "@ROWS@": "2",
    "@STEPS@": "20",
    "@PLACES@": "2",
    "@OFFSET@": "3",
    "@TO@": f"{STATE}, @REAL@ *work, @REAL@ *z",
    "@FROM@": f"{CANONICAL}, @REAL@ *work, @REAL@ *y",
    "@RATES@": f"{CANONICAL}, @REAL@ *work, @REAL@ *dzdt",
    "@H@": f"{CANONICAL}, @REAL@ *work, @REAL@ *out",
    "@BEHIND@": "6",
    "@ENERGIES@": "3",
    "@MOMENTA@": " *   p = dL/dv",
    "@BODY@": "    for (i = 0; i < 3; ++i) {\n        out[i] = y[i];\n    }",
}

#: Those of the program around the functions, whose tokens have other meanings.
MAIN_VALUES = {
    "@RESET@": "        status = @NAME@_reset(t, y, 0, p, mode, event, @ONE@, work);\n",
    "@BEGIN@": "    status = @NAME@_reset(t, y, 0, p, mode, -1, @ONE@, work);\n",
    "@EVENTS@": "    status = @NAME@_events(t, y, 0, p, mode, work, out);\n",
    "@RHS@": "        status = @NAME@_rhs(t + at[stage]*h, s, 0, p, work, k[stage]);\n",
    "@START@": "@ZERO@",
    "@STEP@": "@NAME@_stepped(start + (@REAL@)(row*steps + step)*h, h, &p, y)",
    "@STEPPED@": "0",
    "@STATE_NAMES@": '"a", "b", "c", "dot(a)", "dot(b)", "dot(c)"',
    "@GIVEN@": "1, 1, 1, 1, 1, 1",
    "@INITIAL@": "0, 0, 0, 0, 0, 0",
    "@RESIDUALS@": '"rod", "rate of rod"',
    "@CONTACTS@": '"floor", "wall"',
    "@REASON@": '"result is not finite"',
    "@BOUNCES@": "50",
    "@MOST@": "100",
    "@SIZE@": "7",
    "@MOVING@": "6",
    "@PLACES@": "3",
    **dict.fromkeys(["@RECORDED@", "@MODE@", "@INPUTS@", "@ADVANCE@", "@MODES@", "@SEARCH@"], ""),
    **dict.fromkeys(["@START_CHECKED@", "@PARAMETERS@", "@NEEDED@", "@WITHIN@"], ""),
    **dict.fromkeys(
        ["@START_PROJECTED@", "@CLEAR@", "@BEGUN@", "@IGNORED@", "@NAMED@", "@NOW@"], ""
    ),
    "@MODED@": "mode, ",
    "@MODE_CHANGED@": "int *mode,",
    "@COUNT@": "@NAME@_CONTACTS",
    "@VALUES@": "mode",
    "@HAPPENS@": "        status = event < 0 || work[0] > t;\n",
    "@BEGIN_VALUES@": "    status = @NAME@_change(t, y, 0, p, -1, work);\n",
}

#: Values of single templates.
OWN_VALUES = {
    "contacts": {
        "@FIRST@": "3",
        "@EVENTS@": "    return contact[0] > @ZERO@ ? 0 : 1;",
        "@RESET@": "    return contact[0] > @ZERO@ ? 0 : 1;",
    },
    "events_and_surfaces": {"@CONTACTS@": "2"},
    "guarded_lanes": {"@NUMBERS@": "6"},
    "switches": {
        "@CHANGE@": f"{MOVED}, int event, @REAL@ *work",
        "@S@": "1",
        "@CALL@": "    return event < places[0];",
    },
    "mode_project": {"@STATE@": f"{MOVED}, const int *mode, @REAL@ *work"},
    "project": {"@ARGUMENTS@": f"{MOVED}, const @REAL@ *contact, @REAL@ *work"},
    "whole_jacobian": {
        "@FUNCTION@": "jacobian",
        "@PASSED@": "t, y, u, p, mode, work",
        "@SIZE@": "4",
        "@COLUMNS@": "6",
        "@WHOLE@": "36",
    },
}

#: Templates whose functions give no int and are called by others.
NEEDED = {"coupled_residual": ["residual"], "project": ["residual", "coupled_residual"]}

PRELUDE = """\
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#define restrict __restrict
#define system_EPSILON 1e-7f
#define system_COORDINATES 3
#define system_STATE 6
#define system_CONTACTS 2
#define system_CONSTRAINTS 2
#define system_WORK 100
typedef struct { @REAL@ p[9]; } system_params;
extern const int system_jacobian_rows[4], system_jacobian_columns[4];
"""


def c_values(name: str, real: Real) -> dict[str, str]:
    """The values of the tokens of a template."""
    numbers = dict.fromkeys(["@TOLERANCE@", "@NEAR@"], real.value(0.25))
    numbers |= dict.fromkeys(["@FAR@"], real.value(0.5))
    numbers |= dict.fromkeys(["@ROUNDING@"], real.value(0.125))
    numbers |= {f"@{k}@": real.value(v) for k, v in {"HALF": 0.5, "TWO": 2.0, "SIX": 6.0}.items()}
    numbers |= {
        "@UNTIL@": real.value(10.0),
        "@NEXT@": "nextafter" + real.suffix,
        "@PARSE@": real.parse,
        "@FORMAT@": real.print_format(real.digits),
        "@SHORT@": real.print_format(3),
        "@CAST@": "(double)" if real.name == "float" else "",
    }
    own = OWN_VALUES.get(name, MAIN_VALUES if name.startswith("main") else {})
    return {**C_VALUES, **own, **numbers}


def c_code(name: str, real: Real) -> str:
    """A source file of the template and of what it needs to be declared."""
    target = CTarget(CNames("system", (), {}), real)
    names = [*NEEDED.get(name, []), name]
    codes = [
        target.fill(target.fill(c_template(one), c_values(one, real)))
        for one in dict.fromkeys(names)
    ]
    assert re.findall(r"@\w+@", codes[-1]) == []
    own = "#undef system_STATE\n" if name == "main" else ""
    return "\n".join([target.fill(PRELUDE) + own, *codes])


@pytest.mark.slow
@pytest.mark.compiler
@pytest.mark.parametrize("real", ["float", "double", "long-double"])
def test_compilers_read_every_template_of_c(real: str, tmp_path: Path) -> None:
    """Functions that stand in other templates are called undeclared, as C89 had it."""
    sources = []
    for name in C_NAMES:
        if name not in PARTS:
            sources.append(tmp_path / f"{name}.c")
            sources[-1].write_text(c_code(name, real_type(real)), encoding="ascii")
    lenient = ["-Wno-implicit-function-declaration", "-Wno-unused", "-Wno-unused-parameter"]
    warnings = [w for w in WARNINGS if w not in ("-pedantic", "-Wpedantic", "-pedantic-errors")]
    run(compiler(), "-std=gnu89", "-fsyntax-only", *warnings, *lenient, *sources)


PYTHON_VALUES = {
    "@POSITIONS@": python_template("projection_positions"),
    "@MISSING@": python_template("main_missing"),
    **dict.fromkeys(["@INPUTS@", "@HELD@", "@BEGIN@", "@NJIT@", "@NOTE@"], ""),
    "@FIELDS@": "    E: np.ndarray\n",
    "@LINES@": "    A = B = C = D = E = None",
    "@MATRICES@": "A, B, C, D, E",
    "@AND@": ", u",
    "@A@": "p=DEFAULTS, u=inputs",
    "@P@": "p",
    "@MODE@": ", mode=FLIGHT",
    "@PASSED@": ", mode",
    "@CLOSED@": "what is closed",
    "@STEP@": "y = integrate(y, t, following, steps, p)",
    "@INITIAL@": "INITIAL",
    "@N@": "3",
    "@U@": "2",
    "@ROUNDS@": "12",
    "@STEPS@": "20",
    "@ROWS@": "501",
    "@BOUNCES@": "50",
    **layout_tokens(StateLayout(3, 1)),
}

#: Those of templates in which a token has another meaning.
PYTHON_OWN = {
    "integrate_events": {
        "@U@": ", held",
        "@EVENTS@": "100",
        "@IN@": ", mode",
        "@MODED@": ", mode=mode",
        "@STEPPED@": "y",
        "@FALLS@": "events(t, y, self.p)",
        "@HELD_MODE@": ", mode",
        "@VALUES@": "mode",
        "@HAPPENS@": "        break\n",
    },
    "integrate": {"@U@": ", held", "@LED@": ""},
    "fixed_step": {"@STEP@": "step", "@HELD@": "", "@NOTES@": "A step."},
    "whole_jacobian": {"@FUNCTION@": "jacobian", "@CONSTANT@": "JACOBIAN"},
    "main": {"@STATES@": ", *STATES", "@STEPS@": "20"},
}


@pytest.mark.parametrize("name", [name for name in PYTHON_NAMES if name not in PARTS])
def test_python_reads_every_template_of_python(name: str) -> None:
    values = {"@EVENTS@": "events", **PYTHON_VALUES, **PYTHON_OWN.get(name, {})}
    code = re.sub(r"@[A-Z]+@", "0.25", filled(python_template(name), values))
    assert ast.parse(code).body


@pytest.mark.parametrize(
    ("folder", "suffix"), [("c", ".c.in"), ("python", ".py.in"), ("fmu", ".c.in")]
)
def test_every_template_is_used(folder: str, suffix: str) -> None:
    """Each is named, in quotes, by a module."""
    modules = Path(lagrange_cli.__file__).parent.rglob("*.py")
    texts = "\n".join(path.read_text(encoding="utf-8") for path in modules)
    for path in (FOLDER / folder).iterdir():
        assert path.name.endswith(suffix)
        name = path.name.removesuffix(suffix)
        stem = re.sub("^(mode|interface|happens)_", "", name)
        assert re.search(f"""['"]({name}|{stem})['"]""", texts)


def test_templates_are_plain() -> None:
    """They end with one line's end, and have no tabs."""
    for path in FOLDER.rglob("*.in"):
        text = path.read_bytes()
        assert text.isascii()
        assert re.fullmatch(rb"[^\n].*[^\n]\n", text, re.DOTALL)
        assert not re.search(rb"[\t\r]", text)

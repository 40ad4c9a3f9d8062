"""Emitted code of scenes with recorded inputs: run, and compared with the simulation."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest

from lagrange_cli.api.emitters import EMITTERS
from lagrange_cli.cli.main import run
from lagrange_cli.emit.shared_code import MOST_WRITTEN
from lagrange_cli.errors import InputError
from lagrange_cli.mechanics import derive
from lagrange_cli.report.contents.derivation.contents import derivation_text
from lagrange_cli.report.values.derivation import derivation_report
from lagrange_cli.report.writers.latex.document import latex_document
from lagrange_cli.scene import read_file
from lagrange_cli.simulate import simulate
from tests.emit.emitted_c import WARNINGS, compiler, write

pytestmark = pytest.mark.slow

#: Rows at multiples of the time between two lines that the emitted programs print.
SCENE = """
name: cart
parameters: {m: 2.0, k: 18.0}
inputs:
  w: cos(t)
  a: {file: "a */b.csv", column: "a [m/s^2] */", interpolation: KIND}
  h: {file: "a */b.csv", column: h, interpolation: previous}
particles: {cart: {mass: m, position: [x, 0, 0]}}
coordinates: [x]
potentials: {spring: k*x^2/2}
forces: {push: {on: x, force: m*(a + w) + h}}
initial: {x: 0.25, dot(x): 0}
simulate: {until: 4, samples: 501, accuracy: 1e-10}
"""

TABLE = "t,a [m/s^2] */,h\n0,1,0\n0.8,-1.5,3\n1.6,2.5,-1\n3.2,0.5,2\n4,1,5\n"


@pytest.fixture(params=["previous", "linear", "cubic"])
def cart(request, tmp_path):
    return made(tmp_path, request.param)


def made(folder, kind, table=TABLE):
    (folder / "a *").mkdir(exist_ok=True)
    (folder / "a *" / "b.csv").write_text(table)
    (folder / "cart.yaml").write_text(SCENE.replace("KIND", kind))
    return derive(read_file(str(folder / "cart.yaml")))


def printed(*command):
    done = subprocess.run([str(c) for c in command], capture_output=True, text=True, timeout=120)
    return done.returncode, done.stdout, done.stderr


def last_line(text):
    return [float(x) for x in text.splitlines()[-1].split(",")]


def executable(equations, folder, real="double"):
    source = write(equations, folder, real, main=True)
    done = printed(compiler(), "-std=c99", "-O1", *WARNINGS, source, "-o", folder / "cart", "-lm")
    assert done[0] == 0, done[2]
    return folder / "cart"


@pytest.mark.compiler
def test_the_c_program_follows_the_recording(cart, tmp_path):
    wanted = simulate(cart).state
    code, out, _ = printed(executable(cart, tmp_path))
    assert code == 0
    assert last_line(out) == pytest.approx([4, wanted["x"], wanted["dot(x)"]], abs=1e-8)


def test_the_python_module_follows_the_recording(cart, tmp_path):
    wanted = simulate(cart).state
    (text,) = EMITTERS["python"].emit(cart).values()
    (tmp_path / "cart.py").write_text(text)
    code, out, _ = printed(sys.executable, tmp_path / "cart.py")
    assert code == 0
    assert last_line(out) == pytest.approx([4, wanted["x"], wanted["dot(x)"]], abs=1e-8)


@pytest.mark.compiler
@pytest.mark.parametrize(("until", "code"), [("4", 0), ("4.01", 2)])
def test_the_c_program_ends_with_the_recording(tmp_path, until, code):
    program = executable(made(tmp_path, "linear"), tmp_path)
    found = printed(program, f"until={until}")
    assert found[0] == code
    assert ("begins at t = 0.0, ends at t = 4.0" in found[2]) == (code == 2)


@pytest.mark.compiler
def test_columns_may_be_named_like_places_in_templates(tmp_path, monkeypatch):
    column = "@REAL@ @RECORDED@ @NAME@"
    monkeypatch.setattr(f"{__name__}.SCENE", SCENE.replace("a [m/s^2] */", column))
    program = executable(made(tmp_path, "linear", TABLE.replace("a [m/s^2] */", column)), tmp_path)
    code, _, stderr = printed(program, "until=4.01")
    assert code == 2
    assert f"column {column} of" in stderr
    assert column in (tmp_path / "cart.c").read_text()


@pytest.mark.compiler
def test_what_is_held_goes_on(tmp_path):
    program = executable(made(tmp_path, "previous"), tmp_path, "float")
    assert printed(program, "until=9")[0] == 0


def test_the_python_module_knows_nothing_beyond(tmp_path):
    (text,) = EMITTERS["python"].emit(made(tmp_path, "cubic")).values()
    module: dict[str, object] = {"__name__": "cart"}
    exec(compile(text, "cart", "exec"), module)
    inputs, rhs = module["inputs"], module["rhs"]
    y = np.array([0.0, 0.0])
    assert inputs(0.8, y) == pytest.approx([np.cos(0.8), -1.5, 3])
    assert inputs(4.0, y) == pytest.approx([np.cos(4), 1, 5])
    assert np.isnan([rhs(4.5, y)[1], rhs(-0.5, y)[1]]).all()
    assert rhs(7.0, y, module["DEFAULTS"], lambda t, y, p: [0, 1, 2]) == pytest.approx([0, 2])


def test_c_without_main_needs_no_file(tmp_path):
    made(tmp_path, "linear")
    (tmp_path / "a *" / "b.csv").unlink()
    equations = derive(read_file(str(tmp_path / "cart.yaml")))
    files = EMITTERS["c"].emit(equations)
    assert "takes the recorded ones" in files["cart.h"]
    assert "a: column a [m/s^2] * / of a * /b.csv, linear between rows" in files["cart.h"]
    for to, options in (("c", {"main": True}), ("python", {})):
        with pytest.raises(InputError, match="no such file"):
            EMITTERS[to].emit(equations, options)


def test_what_is_too_long_is_not_written_into_code(tmp_path):
    rows = MOST_WRITTEN // 2 + 2
    table = "t,a [m/s^2] */,h\n" + "".join(f"{k},0,0\n" for k in range(rows))
    equations = made(tmp_path, "linear", table)
    with pytest.raises(InputError, match="too long to be written into code"):
        EMITTERS["python"].emit(equations)


def test_documents_say_where_inputs_come_from(tmp_path):
    equations = made(tmp_path, "cubic")
    text = derivation_text(equations, ascii=False, form="lagrange")
    assert "  a: column a [m/s^2] */ of a */b.csv, a cubic spline through the rows" in text
    assert "  w = cos t" in text
    latex = latex_document(equations)
    assert r"$h$: column h of a */b.csv, each row until the next." in latex
    assert derivation_report(equations, "lagrange")["inputs"] == [
        {"name": "w", "expression": "cos(t)"},
        {
            "name": "a",
            "expression": None,
            "file": "a */b.csv",
            "column": "a [m/s^2] */",
            "interpolation": "cubic",
        },
        {
            "name": "h",
            "expression": None,
            "file": "a */b.csv",
            "column": "h",
            "interpolation": "previous",
        },
    ]


def test_emitted_tables_are_those_of_the_file_now(tmp_path, monkeypatch, capsys):
    monkeypatch.setenv("LAGRANGE_CACHE_DIR", str(tmp_path / "cache"))
    made(tmp_path, "linear")
    command = ["emit", str(tmp_path / "cart.yaml"), "--to", "python"]
    texts = []
    for table in (TABLE, TABLE.replace("2.5", "7.5"), TABLE):
        (tmp_path / "a *" / "b.csv").write_text(table)
        assert run(command) == 0
        texts.append(capsys.readouterr().out)
    assert texts[0] == texts[2] != texts[1]
    assert "7.5" in texts[1]

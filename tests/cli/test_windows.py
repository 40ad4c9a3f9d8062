"""Width, colours and characters of what is printed, on terminals and elsewhere."""

from __future__ import annotations

import fcntl
import os
import pty
import re
import struct
import subprocess
import sys
import termios
import unicodedata
from pathlib import Path

import pytest

from lagrange_cli import load

SYSTEMS = Path(__file__).resolve().parents[2] / "systems"
SCENE = str(SYSTEMS / "pendulums" / "triple_pendulum.yaml")
SIMULATED = ("simulate", str(SYSTEMS / "contact" / "bouncing_ball.yaml"))

#: Variables by which a user sets terminals and encodings up.
SETTINGS = (
    *("COLUMNS", "NO_COLOR", "FORCE_COLOR", "CLICOLOR_FORCE", "TERM"),
    *("LC_ALL", "PYTHONIOENCODING", "PYTHONUTF8"),
)

_ESCAPE = re.compile("\x1b\\[[0-9;]*m")


def environment(**settings: str) -> dict[str, str]:
    kept = {name: value for name, value in os.environ.items() if name not in SETTINGS}
    return kept | {"TERM": "xterm", "PYTHONIOENCODING": "utf-8"} | settings


def on_terminal(columns: int, *words: str, **settings: str) -> str:
    """What a command prints on a terminal of that width."""
    master, slave = pty.openpty()
    fcntl.ioctl(slave, termios.TIOCSWINSZ, struct.pack("HHHH", 24, columns, 0, 0))
    process = subprocess.Popen(
        [sys.executable, "-m", "lagrange_cli", *words],
        stdout=slave,
        stderr=subprocess.DEVNULL,
        env=environment(**settings),
    )
    os.close(slave)
    parts = []
    while True:
        try:
            part = os.read(master, 2**16)
        except OSError:
            # Linux reports the end of a terminal whose other side is closed as an error.
            break
        if not part:
            break
        parts.append(part)
    os.close(master)
    assert process.wait(timeout=60) == 0
    return b"".join(parts).decode().replace("\r\n", "\n")


def piped(*words: str, **settings: str) -> bytes:
    command = [sys.executable, "-m", "lagrange_cli", *words]
    done = subprocess.run(
        command, capture_output=True, env=environment(**settings), timeout=60, check=False
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def plain(text: str) -> str:
    return _ESCAPE.sub("", text)


def widest(text: str) -> int:
    return max(sum(not unicodedata.combining(c) for c in line) for line in plain(text).splitlines())


@pytest.fixture(scope="module")
def derivation():
    return load(SCENE).derive()


@pytest.fixture(scope="module", autouse=True)
def derived_before():
    """The answer is in the cache: what follows lays it out anew."""
    piped("derive", SCENE)


class TestWidth:
    @pytest.mark.slow
    @pytest.mark.parametrize("columns", [60, 80, 97, 130])
    def test_windows_are_filled(self, derivation, columns):
        # The longest equation, whole, has more columns than any of these windows.
        shown = plain(on_terminal(columns, "derive", SCENE))
        assert shown == derivation.text(width=columns)
        assert columns - 12 < widest(shown) <= columns

    @pytest.mark.slow
    def test_pipes_have_80_columns(self, derivation):
        assert piped("derive", SCENE).decode() == derivation.text(width=80) == derivation.text()
        assert 70 < widest(derivation.text()) <= 80

    @pytest.mark.parametrize("columns", ["100", "60"])
    def test_columns_of_the_environment_go_before(self, derivation, columns):
        expected = derivation.text(width=int(columns))
        assert piped("derive", SCENE, COLUMNS=columns).decode() == expected
        assert plain(on_terminal(80, "derive", SCENE, COLUMNS=columns)) == expected

    @pytest.mark.parametrize("columns", ["", "0", "-5", "wide", "²", "1" * 30])
    def test_columns_that_are_none(self, derivation, columns):
        shown = piped("derive", SCENE, COLUMNS=columns).decode()
        assert shown == derivation.text(width=10**9 if columns.startswith("1") else 80)

    def test_terminals_that_do_not_know_their_width(self, derivation):
        assert plain(on_terminal(0, "derive", SCENE)) == derivation.text(width=80)

    def test_the_narrowest(self, derivation):
        assert plain(on_terminal(7, "derive", SCENE)) == derivation.text(width=40)

    def test_files_are_the_same_wherever_they_are_written(self, derivation, tmp_path):
        on_terminal(150, "derive", SCENE, "-o", str(tmp_path / "a.txt"))
        assert (tmp_path / "a.txt").read_text() == derivation.text()

    def test_equations_go_on_at_signs(self, derivation):
        """Further lines begin with a sign, deeper than the first one, and lose nothing."""
        lines = derivation.text(width=60).splitlines()
        begin = lines.index("Equations of motion") + 1
        rows = lines[begin : lines.index("", begin)]
        further = [line for line in rows if not line.startswith("  θ")]
        assert len(further) >= 6
        assert all(re.match(r" {9}[+-] ", line) for line in further)
        one_line = derivation.text(width=1000).splitlines()
        wide = one_line[one_line.index("Equations of motion") + 1 :][:3]
        assert " ".join(" ".join(rows).split()) == " ".join(" ".join(wide).split())

    @pytest.mark.slow
    def test_reports_are_broken_in_windows_alone(self):
        shown, whole = plain(on_terminal(50, *SIMULATED)), piped(*SIMULATED).decode()
        assert widest(shown) <= 50 < widest(whole)
        assert shown.split() == whole.split()
        assert "\n          the right-hand side\n" in shown
        assert widest(piped(*SIMULATED, COLUMNS="50").decode()) <= 50


class TestColours:
    @pytest.mark.slow
    def test_headings_and_names_on_a_terminal(self):
        shown = on_terminal(80, "derive", SCENE)
        assert "\x1b[1mEquations of motion\x1b[0m\n" in shown
        assert "  \x1b[36mθ1\x1b[0m   " in shown
        assert "\x1b[36mE\x1b[0m = T + V" in shown
        report = on_terminal(80, *SIMULATED)
        assert "\x1b[1mAccuracy\x1b[0m  " in report

    @pytest.mark.slow
    def test_outcomes_of_checks(self):
        path = str(SYSTEMS / "refused" / "misspelt_name.yaml")
        assert on_terminal(80, "check", path).startswith("\x1b[32mpass\x1b[0m     ")

    @pytest.mark.slow
    @pytest.mark.parametrize("settings", [{"NO_COLOR": "1"}, {"TERM": "dumb"}])
    def test_terminals_without(self, settings):
        assert "\x1b" not in on_terminal(80, "derive", SCENE, **settings)
        assert "\x1b" not in on_terminal(80, *SIMULATED, **settings)

    @pytest.mark.slow
    def test_pipes_have_none(self):
        assert b"\x1b" not in piped("derive", SCENE) + piped(*SIMULATED)
        assert b"\x1b" not in piped("derive", SCENE, NO_COLOR="1", FORCE_COLOR="1")
        assert b"\x1b" not in piped("derive", SCENE, FORCE_COLOR="0", CLICOLOR_FORCE="")

    @pytest.mark.parametrize("name", ["FORCE_COLOR", "CLICOLOR_FORCE"])
    def test_unless_they_are_asked_for(self, derivation, name):
        forced = piped("derive", SCENE, **{name: "1"}).decode()
        assert "\x1b[1m" in forced
        assert plain(forced) == derivation.text()

    @pytest.mark.slow
    def test_json_and_files_have_none(self, tmp_path):
        written = tmp_path / "a.txt"
        assert b"\x1b" not in piped("derive", SCENE, "--json", FORCE_COLOR="1")
        piped("derive", SCENE, "-o", str(written), FORCE_COLOR="1")
        assert "\x1b" not in written.read_text()

    @pytest.mark.slow
    def test_errors(self, tmp_path):
        scene = tmp_path / "a.yaml"
        scene.write_text("particles: 3\n")
        command = [sys.executable, "-m", "lagrange_cli", "derive", str(scene)]
        for settings, is_coloured in (({}, False), ({"FORCE_COLOR": "1"}, True)):
            done = subprocess.run(
                command, capture_output=True, env=environment(**settings), check=False
            )
            assert done.returncode == 2
            assert done.stderr.startswith(b"\x1b[31m") == is_coloured


class TestCharacters:
    @pytest.mark.slow
    @pytest.mark.parametrize(
        "settings",
        [
            {"PYTHONIOENCODING": "ascii"},
            {"PYTHONIOENCODING": "latin-1"},
            {"LC_ALL": "C", "PYTHONIOENCODING": ""},
            {"LC_ALL": "POSIX", "PYTHONIOENCODING": ""},
        ],
    )
    def test_what_the_encoding_has_no_more_of(self, derivation, settings):
        expected = derivation.text(ascii=True)
        assert piped("derive", SCENE, **settings).decode() == expected
        assert "dot(theta1)^2" in expected
        assert plain(on_terminal(80, "derive", SCENE, **settings)) == expected

    @pytest.mark.parametrize(
        "settings",
        [
            {"LC_ALL": "C.UTF-8", "PYTHONIOENCODING": ""},
            {"LC_ALL": "C", "PYTHONIOENCODING": "utf-8"},
            {"LC_ALL": "C", "PYTHONIOENCODING": "", "PYTHONUTF8": "1"},
        ],
    )
    def test_what_has_them(self, derivation, settings):
        assert piped("derive", SCENE, **settings).decode() == derivation.text()

    @pytest.mark.slow
    def test_documents_are_in_utf_8_whatever_the_locale(self, tmp_path):
        scene = tmp_path / "a.yaml"
        scene.write_text(Path(SCENE).read_text().replace("title: Triple", "title: Träge"))
        words = ("emit", str(scene), "--to", "latex")
        shown = piped(*words, LC_ALL="C", PYTHONIOENCODING="").decode()
        assert "Träge" in shown
        assert shown == piped(*words).decode()

    @pytest.mark.slow
    def test_names_of_scenes_are_escaped_where_they_must(self, tmp_path):
        scene = tmp_path / "a.yaml"
        scene.write_text(Path(SCENE).read_text().replace("title: Triple", "title: Träge"))
        shown = piped("derive", str(scene), PYTHONIOENCODING="ascii").decode()
        assert shown.splitlines()[0] == r"triple_pendulum: Tr\xe4ge pendulum"

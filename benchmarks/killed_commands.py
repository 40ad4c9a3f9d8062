"""The commands that `soundness_kills.py` ends, and the folders they run in."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]

SCENE = """\
name: swing
parameters: {l: 1, a: 0.5}
particles: {bob: {mass: 1, position: [l*sin(theta), 0, -l*cos(theta)]}}
coordinates: [theta]
inputs: {u: {file: push.csv, column: u, interpolation: linear}}
potentials: {weight: 9.81*z_bob}
forces: {push: {on: bob, force: [a*u, 0, 0]}}
initial: {theta: 2.0}
simulate: {until: 5}
expect: {dof: 1}
"""

PUSH = "t,u\n" + "".join(f"{t},{t % 3}\n" for t in range(401))

#: The command line, with a state written far more often than a person would want.
PROGRAM = """\
import signal
# A shell has what it starts in the background ignore the first, nohup the second.
signal.signal(signal.SIGINT, signal.default_int_handler)
signal.signal(signal.SIGHUP, signal.SIG_DFL)
import lagrange_cli.simulate.checkpoint.checkpoint as checkpoint
checkpoint.INTERVAL = 0.05
from lagrange_cli.cli.main import main
main()
"""

#: A long run, of a method with a fixed step.
LONG = ("--method", "Gauss4", "--step", "0.002", "--until", "400")
MEMBERS = ("--vary", "l=linspace(0.5,2,24)", "--method", "Gauss4", "--step", "0.005")


#: Seconds that a command may take.
LONGEST = 120.0


@dataclass(frozen=True)
class Scenario:
    """A command, and the files it writes.

    ``before``: the words that make their old content, else it is a line of text. ``state``: what is
    there where a run can go on. ``together``: the files are all old or all new. ``texts``: scenes
    that the command writes anew, as they are before.
    """

    words: tuple[str, ...]
    outputs: tuple[str, ...]
    before: tuple[str, ...] | None = None
    state: str | None = None
    together: bool = False
    texts: Mapping[str, str] = field(default_factory=dict)


#: The scene in another layout, and with an expectation that fails.
UNTIDY = SCENE.replace(": {l: 1, a: 0.5}", ":   { l: 1,a: 0.5 }   # a remark")
UNEXPECTED = SCENE.replace("dof: 1", "dof: 2")

SCENARIOS: dict[str, Scenario] = {
    "derive": Scenario(("derive", "scene.yaml", "-o", "a.txt"), ("a.txt",)),
    "emit c": Scenario(
        ("emit", "scene.yaml", "--to", "c", "-o", "out"),
        ("out/swing.h", "out/swing.c"),
        ("emit", "scene.yaml", "--to", "c", "--real", "float", "-o", "out"),
        together=True,
    ),
    "emit python": Scenario(("emit", "scene.yaml", "--to", "python", "-o", "."), ("swing.py",)),
    "csv": Scenario(("simulate", "scene.yaml", "-o", "a.csv"), ("a.csv",)),
    "npz, picture": Scenario(
        ("simulate", "scene.yaml", "-o", "a.npz", "--plot", "a.svg"), ("a.npz", "a.svg")
    ),
    "many samples": Scenario(
        ("simulate", "scene.yaml", *LONG, "--samples", "300001", "-o", "a.npz"), ("a.npz",)
    ),
    "checkpoint": Scenario(
        ("simulate", "scene.yaml", *LONG, "--samples", "2001", "-o", "a.csv", "--checkpoint", "c"),
        ("a.csv",),
        state="c",
    ),
    "checkpoint, many samples": Scenario(
        (
            "simulate",
            "scene.yaml",
            *LONG,
            "--samples",
            "300001",
            "-o",
            "a.npz",
            "--checkpoint",
            "c",
        ),
        ("a.npz",),
        state="c",
    ),
    "ensemble": Scenario(
        ("simulate", "scene.yaml", *MEMBERS, "-j", "1", "-o", "a.npz"),
        ("a.npz",),
        state="a.npz.parts",
    ),
    "ensemble, 2 jobs": Scenario(
        ("simulate", "scene.yaml", *MEMBERS, "-j", "2", "-o", "a.npz"),
        ("a.npz",),
        state="a.npz.parts",
    ),
    "check": Scenario(
        ("check", "scene.yaml", "--format", "json", "-o", "a.json", "--junit", "a.xml"),
        ("a.json", "a.xml"),
    ),
    "check --update": Scenario(
        ("check", "b.yaml", "--update"), ("b.yaml",), texts={"b.yaml": UNEXPECTED}
    ),
    "fmt": Scenario(
        ("fmt", "b.yaml", "c.yaml"),
        ("b.yaml", "c.yaml"),
        texts={"b.yaml": UNTIDY, "c.yaml": UNTIDY.replace("swing", "other")},
    ),
}


class Place:
    """A folder with the scene, on a disk of its own where that can be."""

    def __init__(self, root: Path, number: int, *, own_disk: bool = False) -> None:
        root.mkdir(exist_ok=True)
        self.folder = root / f"run{number}"
        self.folder.mkdir()
        self.temporary = root / f"tmp{number}"
        self.temporary.mkdir()
        self.cache = root / "cache"
        self.mounted = own_disk and self._mount("-t", "tmpfs", "-o", "size=64m", "tmpfs")
        (self.folder / "scene.yaml").write_text(SCENE)
        (self.folder / "push.csv").write_text(PUSH)

    def _mount(self, *words: str) -> bool:
        done = subprocess.run(["mount", *words, str(self.folder)], capture_output=True, check=False)
        return done.returncode == 0

    def limit(self, size: int) -> None:
        """Leave so many bytes on the disk."""
        taken = sum(path.stat().st_size + 8192 for path in self.folder.rglob("*"))
        self._mount("-o", f"remount,size={taken + size}")

    def protect(self) -> None:
        self._mount("-o", "remount,ro")

    def mend(self) -> None:
        if self.mounted:
            self._mount("-o", "remount,rw,size=64m")

    def remove(self) -> None:
        if self.mounted:
            subprocess.run(["umount", str(self.folder)], check=True)
        shutil.rmtree(self.folder)
        shutil.rmtree(self.temporary)

    def start(self, words: Sequence[str], *, quiet: bool = False) -> subprocess.Popen[bytes]:
        """A command in this folder, in a group of its own."""
        changed = {"TMPDIR": str(self.temporary), "XDG_CACHE_HOME": str(self.cache)}
        kept = {k: v for k, v in os.environ.items() if k != "LAGRANGE_CACHE"}
        return subprocess.Popen(
            [sys.executable, "-c", PROGRAM, *words],
            cwd=self.folder,
            env={**kept, **changed, "PYTHONPATH": str(ROOT), "MPLCONFIGDIR": str(self.cache)},
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL if quiet else subprocess.PIPE,
            start_new_session=True,
        )

    def run(self, words: Sequence[str]) -> tuple[int, str]:
        """The exit code and what is said of a command that runs to its end."""
        with self.start(words) as process:
            try:
                _, said = process.communicate(timeout=LONGEST)
            except subprocess.TimeoutExpired:
                os.killpg(process.pid, signal.SIGKILL)
                return 124, "it hangs"
        return process.returncode, said.decode("utf-8", "replace")

    def contents(self, outputs: Sequence[str]) -> dict[str, bytes]:
        """The bytes of files, those of one that is not there are none."""
        found = {name: self.folder / name for name in outputs}
        return {name: path.read_bytes() if path.exists() else b"" for name, path in found.items()}

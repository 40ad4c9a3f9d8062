"""What Python knows of structures and constants of the C kernels is what the compiler knows."""

from __future__ import annotations

import ctypes
import platform
import re
import subprocess
from collections.abc import Iterator, Mapping
from graphlib import TopologicalSorter
from pathlib import Path
from typing import Any

import pytest

from lagrange_cli.simulate import kernels, sharpness
from lagrange_cli.simulate.integrators.events import EVENT_PARTS, RISES
from lagrange_cli.simulate.integrators.hybrid import surface_motion
from lagrange_cli.simulate.integrators.native.c_types import (
    DOUBLE,
    EXTENDED,
    LANDMARK_ROWS,
    MOST_EVENTS,
    WIDER_TYPES,
    KernelStatus,
    NativeReal,
    structure,
)
from lagrange_cli.simulate.integrators.native.methods import CompiledTaylor
from lagrange_cli.toolchain.compiler import find_compiler

#: Lanes of motions that are stepped side by side, by the options that make so many.
WIDTHS: dict[tuple[str, ...], int] = {(): 2}
if platform.machine() == "x86_64":
    WIDTHS |= {("-mavx",): 4, ("-mavx512f",): 8}

#: A constant of C → its twin, by the file that has it.
CONSTANTS: Mapping[str, Mapping[str, float]] = {
    "events.c": {"MOST": MOST_EVENTS, "LAGRANGE_PARTS": EVENT_PARTS, "LAGRANGE_RISES": RISES},
    "landmarks.c": {"TIMES + 1": LANDMARK_ROWS, "RESOLVED": sharpness.RESOLVED_EXPONENT},
    "advance.c": {"EARLY": surface_motion.EARLY, "BEHIND": surface_motion.BEHIND},
    "series.c": {"ORDER": CompiledTaylor.order},
    "kernel.h": {f"LAGRANGE_{status.name}": status.value for status in KernelStatus},
}


def claims(name: str, twin: Any) -> Iterator[str]:
    """What C says of a structure if it is the same as the one of ctypes."""
    yield f"sizeof({name}) == {ctypes.sizeof(twin)}"
    for field, kind in twin._fields_:
        yield f"offsetof({name}, {field}) == {getattr(twin, field).offset}"
        yield f"sizeof((({name} *)0)->{field}) == {ctypes.sizeof(kind)}"


def compiled(
    folder: Path, sources: Mapping[str, str], file: str, claimed: list[str], *options: str
) -> subprocess.CompletedProcess[str]:
    """Have the compiler judge some claims behind a file."""
    for name, text in sources.items():
        (folder / name).write_text(text, encoding="ascii")
    lines = [f'_Static_assert({claim}, "{claim}");' for claim in claimed]
    text = "\n".join([f'#include "{file}"', "#include <stddef.h>", *lines, ""])
    (folder / "claims.c").write_text(text, encoding="ascii")
    command = [
        *find_compiler().command,
        "-std=c11",
        "-fsyntax-only",
        *options,
        str(folder / "claims.c"),
    ]
    return subprocess.run(command, capture_output=True, text=True, timeout=60)


@pytest.mark.compiler
@pytest.mark.parametrize("real", [DOUBLE, *WIDER_TYPES], ids=lambda real: real.name)
def test_a_run_is_the_same_in_both_languages(real: NativeReal, tmp_path: Path) -> None:
    claimed = [
        *claims("lagrange_run", structure("run", real)),
        *claims("lagrange_events", structure("events")),
        *claims("lagrange_landmarks", structure("landmarks")),
    ]
    done = compiled(
        tmp_path, kernels.kernel_files(), "events.h", claimed, *kernels.options_of(real)
    )
    assert done.returncode == 0, done.stderr[:2000]


@pytest.mark.compiler
def test_what_is_seen_of_a_motion_is_the_same_in_both_languages(tmp_path: Path) -> None:
    claimed = list(claims("lagrange_observed", structure("observed")))
    done = compiled(tmp_path, kernels.kernel_files(), "kernel.h", claimed)
    assert done.returncode == 0, done.stderr[:2000]


@pytest.mark.compiler
@pytest.mark.parametrize("real", [DOUBLE, EXTENDED], ids=["double", "extended"])
@pytest.mark.parametrize("options", WIDTHS, ids=lambda options: "".join(options) or "plain")
def test_members_are_the_same_in_both_languages(
    real: NativeReal, options: tuple[str, ...], tmp_path: Path
) -> None:
    width = WIDTHS[options] if real is DOUBLE else 1
    claimed = [f"LAGRANGE_WIDTH == {width}"]
    claimed += claims("lagrange_members", structure("members", real, width))
    wide = kernels.options_of(real)
    done = compiled(tmp_path, kernels.batched_files(), "taylor.c", claimed, *options, *wide)
    assert done.returncode == 0, done.stderr[:2000]


@pytest.mark.compiler
@pytest.mark.parametrize("file", CONSTANTS)
def test_constants_are_the_same_in_both_languages(file: str, tmp_path: Path) -> None:
    claimed = [f"{name} == {value!r}" for name, value in CONSTANTS[file].items()]
    done = compiled(tmp_path, kernels.kernel_files(), file, claimed)
    assert done.returncode == 0, done.stderr[:2000]


@pytest.mark.compiler
def test_a_field_out_of_place_is_told(tmp_path: Path) -> None:
    fields = list(structure("run")._fields_)
    fields[0], fields[1] = fields[1], fields[0]
    swapped = type("Swapped", (ctypes.Structure,), {"_fields_": fields})
    claimed = list(claims("lagrange_run", swapped))
    done = compiled(tmp_path, kernels.kernel_files(), "events.h", claimed)
    assert "offsetof(lagrange_run, rhs)" in done.stderr


def test_no_status_is_missing() -> None:
    (body,) = re.findall(
        r"enum \{\s*(LAGRANGE_OK.*?)\}", kernels.kernel_files()["kernel.h"], re.DOTALL
    )
    assert re.findall(r"^\s*LAGRANGE_(\w+)", body, re.MULTILINE) == [s.name for s in KernelStatus]


def test_files_of_c_include_each_other_in_no_circle() -> None:
    texts = {**kernels.kernel_files(), **kernels.batched_files()}
    graph = {name: re.findall(r'#include "(\S+)"', text) for name, text in texts.items()}
    assert graph["taylor.c"] == ["taylor.h"]
    assert set(TopologicalSorter(graph).static_order()) == texts.keys()

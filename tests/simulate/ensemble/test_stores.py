"""Results in files that other programs open: Zarr stores and Parquet tables."""

from __future__ import annotations

import hashlib
import json
import math
import os
import resource
import time
import warnings
from contextlib import contextmanager

import numpy as np
import pytest

from lagrange_cli import InputError, loads, sampled
from lagrange_cli.simulate.ensemble.store.store import settled

zarr = pytest.importorskip("zarr")
xarray = pytest.importorskip("xarray")
parquet = pytest.importorskip("pyarrow.parquet")

SCENE = """
name: pendulum
title: A pendulum
parameters: {m: {value: 1, unit: kg}, l: {value: 1, unit: m}, g: {value: 9.81, unit: m/s^2}}
plane: xz
particles: {bob: {mass: m, position: [l*sin(theta), 0, -l*cos(theta)]}}
coordinates: {theta: {unit: rad}}
potentials: {weight: {gravity: g}}
initial: {theta: 1, dot(theta): 0}
simulate: {until: 2, samples: 21, accuracy: 1e-8}
"""

KEPT = {"columns": ["theta"], "final": True, "reduce": ["max(theta/l)", "first(theta < 0)"]}
FIGURES = {**KEPT, "columns": []}

#: The accuracy is a method's, one member at a time: members are run by other processes.
ALONE = {"method": "DOP853", "rtol": 1e-10}


@pytest.fixture(scope="module")
def pendulum():
    return loads(SCENE).derive()


def drawn(members=50):
    return sampled({"theta": "uniform(-1, 1)", "m": "uniform(1, 2)"}, members, seed=7)


def same(found, expected):
    assert set(found.arrays) == set(expected.arrays)
    for name, values in expected.arrays.items():
        assert np.array_equal(found.arrays[name], values, equal_nan=values.dtype.kind == "f"), name


def opened(path):
    """What xarray makes of a store, without a remark."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        return xarray.open_zarr(path)


@contextmanager
def files_below(size):
    """Let no file be longer, as on a disk that is full."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


@pytest.mark.slow
@pytest.mark.parametrize("ending", [".npz", ".zarr"])
@pytest.mark.parametrize(("jobs", "how"), [(1, {}), (2, {}), (2, ALONE)])
def test_a_store_has_what_memory_has(pendulum, tmp_path, ending, jobs, how):
    """Whether blocks are written by this process, its threads or others."""
    path = tmp_path / f"out{ending}"
    members = drawn(50 if not how else 12)
    expected = pendulum.ensemble(members, **KEPT, **how)
    found = pendulum.ensemble(members, **KEPT, **how, store=path, jobs=jobs)
    same(found, expected)
    assert repr(found) == repr(expected)
    assert [p.name for p in tmp_path.iterdir()] == [path.name]


@pytest.mark.slow
def test_xarray_opens_a_store_as_it_is(pendulum, tmp_path):
    path = str(tmp_path / "out.zarr")
    result = pendulum.ensemble(drawn(), **KEPT, store=path)
    data = opened(path)
    assert dict(data.sizes) == {"member": 50, "t": 21, "block": 17}
    assert data["theta"].dims == ("member", "t")
    assert np.array_equal(data["theta"].sel(t=2.0), data["final.theta"])
    assert np.array_equal(data["theta"].values, result.columns["theta"])
    assert set(data.coords) == {"t", "given.theta", "given.m"}
    assert set(data["member.status"].values) == {"ok"}
    units = {name: data[name].attrs.get("units") for name in data.variables}
    assert units["t"] == units["reduced.first(theta < 0)"] == units["member.holds_until"] == "s"
    assert (units["theta"], units["final.dot(theta)"], units["given.m"]) == ("rad", "rad/s", "kg")
    assert data["block.finished"].values.all()
    # A slash would make a folder.
    assert np.array_equal(data["reduced.max(theta÷l)"], result.reduced["max(theta/l)"])
    # A block is a chunk.
    assert data["theta"].chunks[0] == data["member.steps"].chunks[0]
    assert len(data["theta"].chunks[0]) == 17
    said = data.attrs
    assert (said["name"], said["title"], said["members"]) == ("pendulum", "A pendulum", 50)
    assert said["scene_sha256"] == hashlib.sha256(SCENE.encode()).hexdigest()
    assert json.loads(said["drawn"])["m"] == "uniform(1.0, 2.0)"
    assert (said["seed"], said["accuracy"], said["until"]) == (7, 1e-8, 2.0)
    assert json.loads(said["versions"])["numpy"] == np.__version__


@pytest.mark.slow
def test_chunks_are_those_that_zarr_writes(pendulum, tmp_path):
    """Byte for byte, and no others; they are encoded here."""
    path = tmp_path / "out.zarr"
    pendulum.ensemble(drawn(), **KEPT, store=path)

    def files():
        return {file: file.read_bytes() for file in path.glob("*/c/**/*") if file.is_file()}

    own = files()
    with zarr.config.set({"array.write_empty_chunks": True}):
        arrays = dict(zarr.open_group(str(path), mode="r+", use_consolidated=False).arrays())
        values = {name: array[...] for name, array in arrays.items()}
        for file in own:
            file.unlink()
        for name, array in arrays.items():
            array[...] = values[name]
    assert files() == own


@pytest.mark.slow
def test_a_grid_is_unstacked_by_its_values(pendulum, tmp_path):
    path = str(tmp_path / "out.zarr")
    pendulum.ensemble({"theta": [0.1, 0.2, 0.3], "l": [1, 2]}, **FIGURES, store=path)
    data = opened(path)
    assert json.loads(data.attrs["grid"]) == {"theta": 3, "l": 2}
    plane = data["final.theta"].set_index(member=["given.theta", "given.l"]).unstack("member")
    assert plane.shape == (3, 2)
    alone = pendulum.ensemble({"theta": [0.2], "l": [2]}, columns=[], final=True)
    found = float(plane.sel({"given.theta": 0.2, "given.l": 2.0}))
    assert abs(found - alone.final["theta"][0]) < 2e-8


@pytest.mark.slow
def test_a_store_may_be_at_an_address(pendulum):
    pytest.importorskip("fsspec")
    path = "memory://stores/out.zarr"
    found = pendulum.ensemble(drawn(), **KEPT, store=path, jobs=2)
    same(found, pendulum.ensemble(drawn(), **KEPT))
    assert opened(path).sizes["member"] == 50
    with pytest.raises(InputError, match="is there already"):
        pendulum.ensemble(drawn(), **KEPT, store=path)
    with pytest.raises(InputError, match=r"cannot open 'nowhere://out\.zarr'"):
        pendulum.ensemble(drawn(), **KEPT, store="nowhere://out.zarr")


def lose(path, block):
    """Leave of a block what a process leaves that is killed while it writes one."""
    group = zarr.open_group(path, mode="r+", use_consolidated=False)
    group["block.finished"][block] = False
    for name, array in group.arrays():
        if name not in ("t", "block.finished"):
            size = array.chunks[0]
            part = slice(block * size, (block + 1) * size)
            array[part] = "half" if name.startswith("member.") and array.dtype.kind == "T" else 7.0


@pytest.mark.slow
def test_what_is_not_marked_as_finished_is_run_again(pendulum, tmp_path):
    path = str(tmp_path / "out.zarr")
    whole = pendulum.ensemble(drawn(), **KEPT)
    pendulum.ensemble(drawn(), **KEPT, store=path)
    lose(path, 3)
    lose(path, 16)
    # Marked, and its texts are not there: files that the system lost with its power.
    os.remove(f"{path}/member.status/c/5")
    steps = []
    again = pendulum.ensemble(drawn(), **KEPT, store=path, resume=True, progress=steps.append)
    assert len(steps) == 3
    same(again, whole)
    done = []
    pendulum.ensemble(drawn(), **KEPT, store=path, resume=True, progress=done.append)
    assert done == []


@pytest.mark.slow
@pytest.mark.parametrize("ending", [".npz", ".parquet", ".zarr"])
def test_a_full_disk_loses_nothing(pendulum, tmp_path, ending):
    kept = FIGURES if ending == ".parquet" else {**KEPT, "columns": None}
    path = str(tmp_path / f"out{ending}")
    many = {"samples": 2001} if ending == ".zarr" else {}
    with files_below(4096), pytest.raises(InputError, match="cannot write"):
        pendulum.ensemble(drawn(), **kept, **many, store=path)
    found = pendulum.ensemble(drawn(), **kept, **many, store=path, resume=True)
    same(found, pendulum.ensemble(drawn(), **kept, **many))


def test_a_folder_that_is_read_only_is_refused(pendulum, tmp_path):
    if os.geteuid() == 0:
        pytest.skip("root writes anywhere")
    folder = tmp_path / "locked"
    folder.mkdir(mode=0o555)
    with pytest.raises(InputError, match="cannot write"):
        pendulum.ensemble(drawn(), **KEPT, store=folder / "out.zarr")


@pytest.mark.slow
def test_stores_of_something_else_are_refused(pendulum, tmp_path):
    path = tmp_path / "out.zarr"
    pendulum.ensemble(drawn(), **KEPT, store=path)
    with pytest.raises(InputError, match="is there already, with all members"):
        pendulum.ensemble(drawn(), **KEPT, store=path)
    lose(str(path), 0)
    for members, more in ((drawn(51), {}), (drawn(), {"accuracy": 1e-9})):
        with pytest.raises(InputError, match="another ensemble"):
            pendulum.ensemble(members, **KEPT, **more, store=path, resume=True)
    other = tmp_path / "other.zarr"
    other.mkdir()
    (other / "notes.txt").write_text("mine")
    with pytest.raises(InputError, match="no ensemble of this program"):
        pendulum.ensemble(drawn(), **KEPT, store=other)
    group = tmp_path / "group.zarr"
    zarr.open_group(str(group), mode="w")
    with pytest.raises(InputError, match="no ensemble of this program"):
        pendulum.ensemble(drawn(), **KEPT, store=group, resume=True)
    with pytest.raises(InputError, match=r"ends in none of \.npz, \.parquet, \.zarr"):
        pendulum.ensemble(drawn(), **KEPT, store=tmp_path / "out.hdf5")


@pytest.mark.slow
def test_members_that_fail_are_in_a_store(pendulum, tmp_path):
    members = {"m": [1, 0, -1], "theta": [0.1, 0.2]}
    path = tmp_path / "out.zarr"
    found = pendulum.ensemble(members, **KEPT, store=path)
    same(found, pendulum.ensemble(members, **KEPT))
    data = opened(path)
    assert data["member.status"].values.tolist() == ["ok"] * 2 + ["refused"] * 4
    assert "positive" in data["member.reason"].values[2]
    assert np.isnan(data["final.theta"].values[2:]).all()


# Tables.


@pytest.mark.slow
def test_a_table_has_a_row_for_each_member(pendulum, tmp_path):
    path = tmp_path / "out.parquet"
    result = pendulum.ensemble(drawn(), **FIGURES, store=path, jobs=2)
    same(result, pendulum.ensemble(drawn(), **FIGURES))
    assert [p.name for p in tmp_path.iterdir()] == ["out.parquet"]
    table = parquet.read_table(path)
    assert (table.num_rows, parquet.ParquetFile(path).num_row_groups) == (50, 17)
    assert table["final/theta"].to_pylist() == result.final["theta"].tolist()
    assert set(table["member/status"].to_pylist()) == {"ok"}
    facts = json.loads(table.schema.metadata[b"lagrange"])
    assert facts["scene_sha256"] == hashlib.sha256(SCENE.encode()).hexdigest()
    assert (facts["name"], facts["seed"]) == ("pendulum", 7)
    assert table.schema.field("given/m").metadata[b"units"] == b"kg"
    assert table.schema.field("reduced/first(theta < 0)").metadata[b"units"] == b"s"


@pytest.mark.slow
def test_an_interrupted_table_goes_on(pendulum, tmp_path):
    path = tmp_path / "out.parquet"

    def stop(part):
        if part > 0.5:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        pendulum.ensemble(drawn(), **FIGURES, store=path, progress=stop)
    assert not path.exists()
    steps = []
    found = pendulum.ensemble(drawn(), **FIGURES, store=path, resume=True, progress=steps.append)
    assert len(steps) == 8
    same(found, pendulum.ensemble(drawn(), **FIGURES))


def test_a_table_has_no_place_for_samples(pendulum, tmp_path):
    with pytest.raises(InputError, match="no place for samples") as refusal:
        pendulum.ensemble(drawn(), **KEPT, store=tmp_path / "out.parquet")
    assert "--final" in refusal.value.problems[0].hint
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("library", "ending", "hint"),
    [
        ("zarr", ".zarr", "lagrange-cli[distributed]"),
        ("pyarrow", ".parquet", "pip install pyarrow"),
    ],
)
def test_what_is_missing_is_named(pendulum, tmp_path, monkeypatch, library, ending, hint):
    import importlib.util

    find = importlib.util.find_spec
    monkeypatch.setattr(
        importlib.util, "find_spec", lambda name, *more: None if name == library else find(name)
    )
    with pytest.raises(InputError, match=f"needs {library}") as refusal:
        pendulum.ensemble(drawn(), **FIGURES, store=tmp_path / f"out{ending}")
    assert hint in refusal.value.problems[0].hint
    assert list(tmp_path.iterdir()) == []


class BegunError(Exception):
    """A run that has kept its first block."""


@pytest.mark.slow
@pytest.mark.parametrize("ending", [".npz", ".zarr"])
def test_a_thousand_million_members_begin_at_once(pendulum, tmp_path, ending):
    """None is made before it is run: the first block of them is kept within two seconds."""
    values = np.linspace(0.5, 1.5, 1000).tolist()
    given = {"columns": [], "reduce": ["max(theta)"], "until": 0.1, "samples": 3}
    pendulum.ensemble({"theta": [1.0], "m": [1.0], "l": [1.0]}, **given)  # compiles
    parts, begun = [], time.process_time()

    def end(part):
        parts.append(part)
        raise BegunError

    store = tmp_path / f"out{ending}"
    with pytest.raises(BegunError):
        pendulum.ensemble(
            {"theta": values, "m": values, "l": values}, **given, store=store, progress=end
        )
    assert time.process_time() - begun < 2.0
    assert parts == [1 / math.ceil(1e9 / 8192)]


def test_metadata_that_another_process_is_writing_are_read_again(monkeypatch):
    """An address need not have files at once with their content."""
    monkeypatch.setattr(time, "sleep", lambda seconds: None)
    texts = iter(["", "{", "[1]"])
    assert settled(lambda: json.loads(next(texts))) == [1]
    with pytest.raises(json.JSONDecodeError):
        settled(lambda: json.loads(""))

"""Open the store of an ensemble's blocks, by the ending of the result's name."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from lagrange_cli.files import cannot_write, is_temporary, write_file
from lagrange_cli.simulate.ensemble.store.parquet_store import parquet_store
from lagrange_cli.simulate.ensemble.store.store import (
    NpzStore,
    PartsStore,
    Store,
    SummaryStore,
    parts_of,
    refused,
)
from lagrange_cli.simulate.ensemble.store.zarr_store import open_zarr_store

if TYPE_CHECKING:
    from lagrange_cli.simulate.ensemble.plan.plan import Blocks

_NOTE = "ensemble.json"

#: Ending of a result that is one file → its store.
_OF_PARTS: Mapping[str, Callable[[str, Blocks], PartsStore]] = {
    ".npz": lambda output, blocks: NpzStore(blocks.size, output=output),
    ".parquet": parquet_store,
}

_ZARR = ".zarr"

#: Endings of results.
ENDINGS = (*_OF_PARTS, _ZARR)


def ending_of(output: str) -> str | None:
    """Return which of :data:`ENDINGS` a name has, None for none of them."""
    lower = output.lower().rstrip("/")
    return next((ending for ending in ENDINGS if lower.endswith(ending)), None)


def open_store(output: str | None, blocks: Blocks, *, resume: bool) -> Store:
    """Open the store of finished blocks, with ``resume`` those of an interrupted run.

    Parameters
    ----------
    output
        What the result is to be: a file, or a Zarr store by its path or its address. None if
        nothing but summaries is kept.
    blocks
        All that are to be.

    Raises
    ------
    InputError
        There are blocks and they are not to be used, or they are of another ensemble; the ending
        is of no result.
    """
    if output is None:
        return SummaryStore(blocks.size)
    ending = ending_of(output)
    if ending is None:
        raise refused(f"'{output}' ends in none of {', '.join(ENDINGS)}", "ensemble.npz")
    if ending == _ZARR:
        return open_zarr_store(output, blocks, resume=resume)
    return _opened(_OF_PARTS[ending](output, blocks), blocks, resume)


def _opened(store: PartsStore, blocks: Blocks, resume: bool) -> PartsStore:
    """Begin the folder of a store, or go on with it."""
    folder = parts_of(store.output)
    note = {"key": blocks.plan.key, "members": len(blocks.members), "size": blocks.size}
    if not _has_begun(folder):
        _begin(folder, note)
        return store
    if not resume:
        raise refused(
            f"'{folder}' has the members that an interrupted run finished",
            f"--resume goes on with the others; rm -r '{folder}' begins anew",
        )
    if _read(folder / _NOTE) != note:
        raise refused(
            f"'{folder}' is of another ensemble: the scene, its members, options that matter or"
            " the program have changed",
            f"rm -r '{folder}' begins anew",
        )
    store.load(len(blocks), blocks.length)
    return store


def _has_begun(folder: Path) -> bool:
    """Tell whether anything is in the way of a new run; a killed one can leave an empty folder."""
    try:
        return not all(is_temporary(path.name) for path in folder.iterdir())
    except FileNotFoundError:
        return False
    except OSError:
        return True


def _begin(folder: Path, note: Mapping[str, Any]) -> None:
    try:
        folder.mkdir(exist_ok=True)
    except OSError as error:
        raise cannot_write(f"'{folder}'", error) from error
    write_file(folder / _NOTE, json.dumps(note))


def _read(path: Path) -> Any:
    """Read the JSON in a file, None if there is none."""
    try:
        return json.loads(path.read_bytes())
    except (OSError, ValueError, RecursionError):
        return None

"""Open the store of an ensemble's blocks, by the ending of the result's name."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

from lagrange_cli.simulate.ensemble.store.parquet_store import parquet_store
from lagrange_cli.simulate.ensemble.store.part_files import (
    NpzStore,
    PartsStore,
)
from lagrange_cli.simulate.ensemble.store.store import Store, SummaryStore, refused
from lagrange_cli.simulate.ensemble.store.zarr_store import open_zarr_store

if TYPE_CHECKING:
    from lagrange_cli.simulate.ensemble.plan.plan import Blocks


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
        Path of a file, or path or address of a Zarr store; None to store nothing but summaries.
    blocks
        All blocks of the ensemble.

    Raises
    ------
    InputError
        There are blocks that may not be used, or that are of another ensemble; or no result has
        this ending.
    """
    if output is None:
        return SummaryStore(blocks.size)
    ending = ending_of(output)
    if ending is None:
        raise refused(f"'{output}' ends in none of {', '.join(ENDINGS)}", "ensemble.npz")
    if ending == _ZARR:
        return open_zarr_store(output, blocks, resume=resume)
    store = _OF_PARTS[ending](output, blocks)
    store.open(blocks, resume=resume)
    return store

"""Finished blocks that become a Parquet table: a row a member, a row group a block."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, BinaryIO

import numpy as np

from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.ensemble.store.blocks import TEXTS, written_name
from lagrange_cli.simulate.ensemble.store.part_files import PartsStore
from lagrange_cli.simulate.ensemble.store.result import Description, Ensemble
from lagrange_cli.simulate.ensemble.store.store import refused, require_package

if TYPE_CHECKING:
    from lagrange_cli.simulate.ensemble.plan.plan import Blocks

#: Key of the facts in the table's metadata.
_FACTS = "lagrange"


@dataclass
class ParquetStore(PartsStore):
    """Blocks that become a Parquet table.

    Attributes
    ----------
    description
        Facts and units that the table's metadata hold.
    """

    description: Description = field(kw_only=True)

    def ensemble(self, name: str, t: Array) -> Ensemble:
        return Ensemble(name, ParquetArrays(self.output, t))

    def _write(self, stream: BinaryIO, t: Array) -> None:
        """Write the rows of one block after the other, nothing where a number is NaN."""
        from pyarrow import parquet

        files, numbers = self._files, sorted(self.finished)
        names = list(dict.fromkeys(name for number in numbers for name in files.names(number)))
        schema = self._schema(names)
        with parquet.ParquetWriter(stream, schema, compression="zstd") as writer:
            for number in numbers:
                members = sum(self.finished[number].counts.values())
                missing = np.full(members, np.nan)
                arrays = (files.array(number, name) for name in names)
                columns = [missing if array is None else array for array in arrays]
                writer.write_table(_table(columns, schema))

    def _schema(self, names: list[str]) -> Any:
        import pyarrow

        fields = []
        for name in names:
            kind = pyarrow.string() if name in TEXTS else pyarrow.float64()
            written = written_name(name)
            fields.append(pyarrow.field(written, kind, metadata=self.description.of_array(written)))
        return pyarrow.schema(fields, metadata={_FACTS: json.dumps(self.description.facts)})


def _table(columns: list[Array], schema: Any) -> Any:
    import pyarrow

    arrays = [
        pyarrow.array(column.tolist() if column.dtype.kind == "U" else column, type=field.type)
        for column, field in zip(columns, schema, strict=True)
    ]
    return pyarrow.Table.from_arrays(arrays, schema=schema)


@dataclass(frozen=True)
class ParquetArrays(Mapping[str, Any]):
    """Columns of a table by their names in an NPZ, read as they are asked for.

    Attributes
    ----------
    path
        Path of the file.
    t
        Times of the samples.
    """

    path: str
    t: Array

    def __getitem__(self, name: str) -> Any:
        from pyarrow import parquet

        if name == "t":
            return self.t
        if name not in self._names():
            raise KeyError(name)
        return parquet.read_table(self.path, columns=[name])[name].to_numpy()

    def __iter__(self) -> Iterator[str]:
        return iter(["t", *self._names()])

    def __len__(self) -> int:
        return 1 + len(self._names())

    def _names(self) -> list[str]:
        from pyarrow import parquet

        names: list[str] = parquet.read_schema(self.path).names
        return names


def parquet_store(output: str, blocks: Blocks) -> ParquetStore:
    """Return the store of blocks that are to become a table.

    Raises
    ------
    InputError
        pyarrow is not installed, or samples are stored, for which a row has no place.
    """
    require_package("pyarrow", ".parquet", "pyarrow")
    if blocks.plan.selection.columns != ():
        raise refused(
            "a table has a row for each member, and no place for samples",
            "--final (from Python columns=[], final=True); -o ensemble.zarr has samples",
        )
    return ParquetStore(blocks.size, output=output, description=Description.of_blocks(blocks))

"""Files: read with bounds, written whole or not at all.

Paths and bytes go in, bytes and rows come out; refusals are located. Around them: locks of
outputs, temporary files that outlive no process for long, and recorded inputs with their
interpolation. Read :mod:`.writing` first.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from lagrange_cli.files.identity import (
    Named,
    ending_of,
    is_address,
    require_apart,
    same_file,
    stamp_of,
)
from lagrange_cli.files.locks import cannot_write, lock_of, sole_writer
from lagrange_cli.files.reading import MAX_BYTES, read_bytes, too_large
from lagrange_cli.files.temporary import (
    discard,
    is_temporary,
    remove_abandoned_files,
    remove_abandoned_folders,
    temporary_file,
    temporary_folder,
)
from lagrange_cli.files.writing import (
    can_encode,
    check_writable,
    whole_file,
    write_file,
    write_files,
)

if TYPE_CHECKING:
    from lagrange_cli.files.recordings import (
        INTERPOLATIONS,
        CarriedFile,
        FileColumn,
        Interpolation,
        Recorded,
        Recording,
        carried_files,
        read_recorded_file,
        read_recording,
        reading_carried,
    )
    from lagrange_cli.files.tables import (
        Outside,
        Table,
        TableInterpolation,
        read_table,
    )

__all__ = [
    "INTERPOLATIONS",
    "MAX_BYTES",
    "CarriedFile",
    "FileColumn",
    "Interpolation",
    "Named",
    "Outside",
    "Recorded",
    "Recording",
    "Table",
    "TableInterpolation",
    "can_encode",
    "cannot_write",
    "carried_files",
    "check_writable",
    "discard",
    "ending_of",
    "is_address",
    "is_temporary",
    "lock_of",
    "read_bytes",
    "read_recorded_file",
    "read_recording",
    "read_table",
    "reading_carried",
    "remove_abandoned_files",
    "remove_abandoned_folders",
    "require_apart",
    "same_file",
    "sole_writer",
    "stamp_of",
    "temporary_file",
    "temporary_folder",
    "too_large",
    "whole_file",
    "write_file",
    "write_files",
]

_TABLES = ("Outside", "Table", "TableInterpolation", "read_table")

_RECORDINGS = (
    "INTERPOLATIONS",
    "CarriedFile",
    "FileColumn",
    "Interpolation",
    "Recorded",
    "Recording",
    "carried_files",
    "read_recorded_file",
    "read_recording",
    "reading_carried",
)


def __getattr__(name: str) -> Any:
    """Import what reads recordings and tables when it is used: few scenes have any."""
    room = "tables" if name in _TABLES else "recordings" if name in _RECORDINGS else None
    if room is None:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{room}"), name)

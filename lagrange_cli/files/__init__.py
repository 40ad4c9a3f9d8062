"""Files: read with bounds, written whole or not at all."""

from lagrange_cli.files.reading import MAX_BYTES, read_bytes, too_large
from lagrange_cli.files.recordings import (
    INTERPOLATIONS,
    Interpolation,
    Recorded,
    Recording,
    read_recording,
)
from lagrange_cli.files.writing import (
    cannot_write,
    check_writable,
    new_file,
    whole_file,
    write_file,
    write_files,
)

__all__ = [
    "INTERPOLATIONS",
    "MAX_BYTES",
    "Interpolation",
    "Recorded",
    "Recording",
    "cannot_write",
    "check_writable",
    "new_file",
    "read_bytes",
    "read_recording",
    "too_large",
    "whole_file",
    "write_file",
    "write_files",
]

"""The refusal of a file that cannot be written."""

from __future__ import annotations

from lagrange_cli.errors import InputError, Problem


def cannot_write(name: str, error: OSError) -> InputError:
    """Return the refusal of something that cannot be written, with the system's reason."""
    return InputError(Problem(f"cannot write {name}: {error.strerror or error}", rule="output"))

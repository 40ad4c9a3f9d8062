"""What is said of a file that cannot be written."""

from __future__ import annotations

from lagrange_cli.errors import InputError, Problem


def cannot_write(name: str, error: OSError) -> InputError:
    """The refusal for something that cannot be written."""
    return InputError(Problem(f"cannot write {name}: {error.strerror or error}", rule="output"))

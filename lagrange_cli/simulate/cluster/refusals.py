"""Why a cluster is not used."""

from __future__ import annotations

from lagrange_cli.errors import InputError, Problem

#: How what a cluster needs is installed.
EXTRA = "pip install 'lagrange-cli[distributed]'"


class ClusterError(InputError):
    """A cluster cannot be used as it is, or was lost."""


def refusal(message: str, hint: str = "") -> ClusterError:
    """Return the refusal of a cluster."""
    return ClusterError(Problem(message, hint=hint, rule="cluster"))

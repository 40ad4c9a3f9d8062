"""The sentence about the certificate of a form."""

from __future__ import annotations

from typing import TYPE_CHECKING

from lagrange_cli.emit.language import Language

if TYPE_CHECKING:
    from lagrange_cli.mechanics.findings import Certificate


def certified(certificate: Certificate, say: Language) -> str:
    """``Compared at 8 states with Lagrange's equations, to 30 digits.``"""
    return say.counted(
        certificate.points,
        "Compared at {count} state with Lagrange's equations, to {digits} digits.",
        "Compared at {count} states with Lagrange's equations, to {digits} digits.",
        digits=certificate.digits,
    )

"""Formats that derivations and analyses are written in, each with its options."""

from lagrange_cli.emit.base import Emitter, Option, completed
from lagrange_cli.emit.document_options import ANALYZED, FORMS
from lagrange_cli.emit.registry import DERIVED, EMITTERS

__all__ = ["ANALYZED", "DERIVED", "EMITTERS", "FORMS", "Emitter", "Option", "completed"]

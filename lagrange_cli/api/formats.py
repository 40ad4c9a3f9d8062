"""Formats that derivations and analyses are written in, each with its options."""

from lagrange_cli.api.emitters import EMITTERS
from lagrange_cli.emit.base import Emitter, FormatList, Option, completed
from lagrange_cli.report.document_options import ANALYZED, DERIVED, ENDINGS, FORMS

__all__ = [
    "ANALYZED",
    "DERIVED",
    "EMITTERS",
    "ENDINGS",
    "FORMS",
    "Emitter",
    "FormatList",
    "Option",
    "completed",
]

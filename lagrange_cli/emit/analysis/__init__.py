"""What was found of equations of motion, as text and as JSON.

An :class:`~lagrange_cli.analysis.values.Analysis` goes in; a page or JSON values come out.
"""

__all__ = ["documents", "report", "text"]

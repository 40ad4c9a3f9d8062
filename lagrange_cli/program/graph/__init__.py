"""Values of expressions as a graph, and the order in which they are computed.

SymPy expressions go in; statements over operands come out, in which every shared part has one
name. Equal values are one node (value numbering). Read :mod:`.value_graph`, then
:mod:`.schedule`.
"""

__all__ = [
    "derivatives",
    "evaluation",
    "operands",
    "schedule",
    "statement_groups",
    "value_graph",
]

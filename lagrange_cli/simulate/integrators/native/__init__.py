"""The integrators in machine code, behind the same protocol.

A right-hand side in C goes in; runs come out that make all their steps in the kernels. Structures
of C have their twins here. Read :mod:`.function`, then :mod:`.methods`.
"""

__all__ = ["batched_taylor", "buffers", "c_types", "function", "methods"]

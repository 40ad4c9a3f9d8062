"""Methods of other packages behind the same protocol: heyoka, SUNDIALS.

A right-hand side goes in, as numbers or as expressions; runs come out where the package is
installed. Read :mod:`.sundials` first.
"""

__all__ = ["heyoka_method", "ida", "sundials"]

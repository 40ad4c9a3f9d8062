"""Recognition of indexed families in derived equations, for display as families.

Equations go in; out come forms over letters, ``m u''[i] + k (2 u[i] - u[i-1] - u[i+1])`` with
i = 1 … n, sums with Σ and pairs with i < j, each equal to the derived terms at every element. Read
:mod:`.families` first, which says what a page shows, then :mod:`.search`.
"""

__all__ = ["elements", "families", "forms"]

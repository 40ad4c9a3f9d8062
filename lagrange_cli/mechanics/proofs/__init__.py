"""Proofs that need no sample: of contradictions, of zeros, of continuity.

Equations, inequalities or one expression go in; a proof comes out, or a state that refutes the
claim, or nothing. The methods are Farkas' lemma, sums of squares (Parrilo, Math. Program. 96
(2003) 293) and values in finite fields (J. Schwartz, J. ACM 27 (1980) 701; R. Zippel, EUROSAM
1979). Read :mod:`.zero_test` first.
"""

__all__ = [
    "continuity",
    "farkas",
    "finite_field",
    "refutation",
    "sum_of_squares",
    "zero_test",
]

"""C that only the simulator compiles, and the programs it is made of.

Programs go in; text of C comes out for states side by side in vectors, for Taylor coefficients,
and for values off by rounding (Vignes, *Math. Comput. Simul.* 35 (1993) 233). Read
:mod:`.sources` first.
"""

__all__ = ["rounding_model", "sources"]

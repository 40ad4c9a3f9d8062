"""Lowered functions run by Python, over numbers of any kind.

In goes a :class:`~lagrange_cli.program.lowered.functions.Function`, out comes a function of t, y, p
and u: a chain of closures, made once. An :class:`~.arithmetic.Arithmetic` says what runs through
it: doubles, numbers of many digits, objects that remember what is done with them. No text is
written and none is run. Read :mod:`.interpreter` first; threaded code with superinstructions is
the technique of Ertl and Gregg, *J. Instruction-Level Parallelism* 5 (2003) 1.
"""

__all__ = ["arithmetic", "interpreter"]

"""Lowered functions: what is executed, without a language.

In goes a :class:`~lagrange_cli.program.program.Program`, out comes a
:class:`~lagrange_cli.program.lowered.functions.Function`: statements, loops, systems to solve,
checks. Every language prints it, and :mod:`lagrange_cli.program.lowered` knows none of them. Read
``functions`` first.
"""

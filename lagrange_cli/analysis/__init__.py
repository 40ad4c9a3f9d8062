"""Analysis of certified equations of motion, as in a course on mechanics or on control.

:class:`~lagrange_cli.mechanics.equations.Equations` go in; a :class:`~.result.Analysis` comes out,
or one of the forms of the equations, as frozen values. Read :mod:`.analyze` first: it calls the
rooms in order, and only for the parts that were asked for. ``equilibria`` finds configurations of
rest, ``linear`` linearizes there and proves stability, ``branches`` follows equilibria over a
parameter, ``symmetries`` has Noether's theorem, ``forms`` the equations of Hamilton and Routh,
``contacts`` the forces of contacts and the places where these are lost.
Values that several rooms share are in :mod:`.values`.
"""

__all__ = ["analyze", "result", "small_oscillations", "values"]

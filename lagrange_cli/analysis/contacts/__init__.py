"""Loss of contacts in symbols: forces of contacts without velocities, and where they vanish.

:class:`~lagrange_cli.mechanics.equations.Equations` with one-sided constraints go in; a
:class:`.loss.ContactLosses` comes out. Read :mod:`.loss` first; :mod:`.relations` reduces
expressions by equations that hold while contacts last, and :mod:`.zeros` solves for places.
"""

__all__ = ["loss", "zeros"]

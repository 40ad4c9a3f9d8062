"""One-sided constraints: gaps that must not become negative.

A reduction goes in; gaps φ(q, t) ≥ 0 come out, each free to open, or a refusal with a proof where
no configuration keeps all of them. Read :mod:`.gaps` first.
"""

__all__ = ["gaps"]

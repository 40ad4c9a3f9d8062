"""The members of an ensemble, and the plan that all of them share.

A scene, options and the values of members (from a file, as ranges, or drawn at random) go in;
blocks of members and a plan of one key come out. Read :mod:`.plan` first; :mod:`.recipe` derives
the model of a member, and :mod:`.variants` replaces numbers in one that was derived before.
"""

__all__ = ["enumeration", "plan", "recipe", "sampling", "sources", "variants"]

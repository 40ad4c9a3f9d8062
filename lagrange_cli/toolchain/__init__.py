"""The C compiler of this machine, and shared libraries made with it.

Text of C goes in; loaded libraries come out, from the cache where they are known. Read
:mod:`.shared_library` first.
"""

__all__ = ["compiler", "shared_library"]

"""Equations → an FMI unit: variables, XML, C around the emitted functions, and the archive.

Equations go in; the texts that a unit holds come out, the same on every machine, and of these an
archive with a library that the machine's compiler made. The standard is the Functional Mock-up
Interface of the Modelica Association, versions 2.0.5 and 3.0.2. Read :mod:`.module` first.
"""

__all__ = ["module"]

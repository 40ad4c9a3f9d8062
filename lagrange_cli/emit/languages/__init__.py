"""Languages that print lowered functions, one file each.

In go the functions of :mod:`lagrange_cli.program.lowered` and the names of a scene
(:mod:`.interface`), out comes the text of a module. :mod:`.printer` walks the statements, and a
language says how each is written. Read ``printer`` first, then ``javascript``, the shortest.
"""

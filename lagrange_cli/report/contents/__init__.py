"""Contents of reports, one module or folder a value.

Modules of a command are named like it, each with a table ``FORMATS`` from the name of a format to
the function that writes it; read :mod:`.simulate` first. Folders have what documents of a
derivation and an analysis hold.
"""

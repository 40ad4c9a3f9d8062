"""The subcommands, one file each: options in, values of the pipeline, reports out.

Each module has a Click command of its own name; read :mod:`.derive` first. What several commands
share stands above, in :mod:`lagrange_cli.cli`.
"""

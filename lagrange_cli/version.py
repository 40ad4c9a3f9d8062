"""The version, in a module that any room may import."""

__version__ = "0.1.0"

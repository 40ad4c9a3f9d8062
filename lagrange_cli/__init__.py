"""lagrange: equations of motion from a scene file."""

__version__ = "0.1.0"

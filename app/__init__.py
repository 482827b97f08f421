"""Touchline: calibrates the cameras above a robot-soccer field, and says in millimetres how far to trust it."""

__version__ = "0.1.0"

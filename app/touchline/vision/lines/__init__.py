"""Painted lines and edges, to a fraction of a pixel."""

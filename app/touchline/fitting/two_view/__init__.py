"""Fit the geometry of two views to matched points."""

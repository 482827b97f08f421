"""Fit a thin-plate spline on top of another model."""

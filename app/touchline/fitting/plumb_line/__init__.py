"""Fit lens distortion to straight edges, without a field and without a board."""

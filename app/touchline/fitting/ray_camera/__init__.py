"""Fit cameras with a pose, a focal length and a lens to points on lines, arcs and landmarks."""

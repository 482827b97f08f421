"""Fit the paper's model: curves through the borders, then the two corrections."""

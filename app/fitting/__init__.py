"""Observations → model: one fitter for each camera model, and the least squares that they share."""

"""Fit a lens to views of a calibration board."""

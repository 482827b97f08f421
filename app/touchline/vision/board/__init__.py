"""The corners of a calibration board in a picture."""

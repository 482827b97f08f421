"""What the program claims of a calibration, and what came of trying to refute it."""

"""What stands still and what moves in a series of frames."""

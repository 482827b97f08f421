"""A lens from images of a calibration board: chessboard or ChArUco."""

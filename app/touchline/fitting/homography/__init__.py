"""Fit a homography: normalised DLT, then the distances in pixels."""

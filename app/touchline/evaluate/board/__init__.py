"""What a lens from a board is worth: coverage, cross-validation, warnings, the next view."""

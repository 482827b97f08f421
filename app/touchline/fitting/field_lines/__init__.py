"""Find a camera from the field's painted lines, without clicks."""

"""What moves over the field: tracks of robots and balls, and what rolls tell of a lens."""

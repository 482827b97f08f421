"""What moves over the field: tracks of robots and balls."""

"""Whether a camera still stands as it did when it was calibrated, from the field's lines."""

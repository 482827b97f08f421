"""A model becomes pictures: correction maps (the only remap), mosaics, heat maps."""

"""Light, focus and flicker of a picture."""

"""Cameras above one field: how far they agree, two by two, and the whole field as one picture."""

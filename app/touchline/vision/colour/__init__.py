"""Colour profiles: learned, tabulated, and how well their colours can be told apart."""

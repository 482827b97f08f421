"""Patches of one colour, and patterns of such patches."""

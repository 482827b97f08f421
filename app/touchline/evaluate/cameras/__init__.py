"""How well the cameras of a pair or a rig agree where they see the same."""

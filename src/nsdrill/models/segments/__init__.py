"""A string of lumped segments in the axial and the torsional direction, with its drive."""

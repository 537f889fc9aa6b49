"""Branches of periodic motions of a study: from which seeds, on which points, into which
file."""

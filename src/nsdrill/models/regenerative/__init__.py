"""A drag bit that cuts what its last blade left: axial and torsional motion."""

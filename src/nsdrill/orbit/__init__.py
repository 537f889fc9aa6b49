"""Continuation of periodic orbits, cycles and invariant circles in a number of the
study."""

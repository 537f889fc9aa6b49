"""An elastic drill collar between two stabilisers: several bending modes in two planes,
walls at stations along it."""

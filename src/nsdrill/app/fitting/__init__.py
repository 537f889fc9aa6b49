"""Measurements of a well, read as rigs write them, and the numbers that they tell."""

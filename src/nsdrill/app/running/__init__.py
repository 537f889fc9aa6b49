"""Runs of a sweep, from the plan and its price to the file: the stages over one log,
refinement, devices, clusters, combined files."""

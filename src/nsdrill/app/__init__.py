"""The use cases, behind the commands and the Python functions: an experiment, its check,
and arguments in this room; runs, motions, branches, fits and answers in rooms of it."""

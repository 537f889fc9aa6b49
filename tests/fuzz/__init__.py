"""Fuzzers: studies and results files that nobody would write, and what must hold of
each.

    python -m tests.fuzz.studies --examples 100000 --seed 1
    python -m tests.fuzz.files --examples 10000 --seed 1

An example follows from the seed and its number alone: ``--first N --examples 1`` gives
the same one again.
"""

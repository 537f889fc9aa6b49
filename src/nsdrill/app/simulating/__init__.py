"""Single motions: a schedule, a replay, the explorer's motions, exponents."""

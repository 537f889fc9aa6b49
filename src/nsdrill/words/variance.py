"""What is said of an answer of a sensitivity that has no indices, and of an unknown
that has none."""

from __future__ import annotations

from nsdrill.data import Answer

NOT_VARIED = "the same in all samples"  # of an unknown


def without_indices(answer: Answer) -> str:
    """Where an ``answer`` without indices has its mean, and why it has none."""
    if answer["alike"] and answer["missing"]:
        return "in every sample that is known"
    if answer["alike"]:
        is_varied = all(row["varies"] for row in answer["unknowns"])
        return f"in every sample{', whatever the unknowns are' if is_varied else ''}"
    if answer["missing"]:
        return "on average over the known samples; too few are known for indices"
    return "on average; the samples are too few for indices"

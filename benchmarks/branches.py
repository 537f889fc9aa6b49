"""Stable intervals of a file of branches beside a fine scan of multipliers.

Continuation has points some hundredths of a rad/s apart, and looks in between where
multipliers come near the unit circle. Here every motion that repeats is computed anew at
equal distances of the continued number, whatever its multipliers are, from the points of
the file as guesses; an interval of instability wider than the distance cannot be
missed. Run it with
``python -m benchmarks.branches configs/branches_speed_22kN.yaml branches.h5``.
"""

from __future__ import annotations

import argparse
from itertools import pairwise

import numpy as np

import nsdrill
from nsdrill.analysis.bifurcations import PERIODIC
from nsdrill.app.following.seeding import continuation_setup
from nsdrill.app.running.run import processors
from nsdrill.orbit.flow import advance
from nsdrill.orbit.newton import corrected_at_parameter
from nsdrill.orbit.periodic import Periodic, segment_starts
from nsdrill.store import open_branches
from nsdrill.text.branch_text import summarize_branches

DISTANCE = 1e-3  # of the scan, in SI
MAX_DISTANCE = 0.5  # of a motion from the line between the points, in natural scales


def scanned(setup, flow, data, branch, distance):  # type: ignore[no-untyped-def]
    """The numbers and greatest moduli of the multipliers [n] of the motions of a
    ``branch`` at multiples of ``distance``, between points of the file; the moduli are
    NaN where Newton's method fails."""
    places = np.flatnonzero(data["branch_of_point"].values == branch)
    numbers, states = data[data.attrs["along"]].values[places], data["state"].values[places]
    lobes = int(data["lobes"].values[branch])
    problem = Periodic.at(flow, lobes, numbers[:1], states[0])

    def starts(state, number):  # type: ignore[no-untyped-def]
        found = yield from segment_starts(problem, state, np.array([number]))
        return None if found is None else problem.unknowns(found, number)

    known = zip(states, numbers, strict=True)
    ends = advance(flow, {k: starts(*one) for k, one in enumerate(known)})

    def motion(guess):  # type: ignore[no-untyped-def]
        point = yield from corrected_at_parameter(problem, guess)
        if point is None or np.linalg.norm(point.x - guess) > MAX_DISTANCE:
            return np.nan
        return float(np.abs(point.found.multipliers).max())

    tasks, at = {}, []
    for k, (low, high) in enumerate(pairwise(numbers)):
        first, last = sorted((low, high))
        inside = distance * np.arange(np.ceil(first / distance), np.floor(last / distance) + 1)
        for number in inside if low < high else inside[::-1]:
            if ends[k] is not None and ends[k + 1] is not None:
                share = (number - low) / (high - low)
                guess = (1.0 - share) * ends[k] + share * ends[k + 1]
                guess[-1] = number / flow.scales[-1]
                tasks[len(at)] = motion(guess)
                at.append(number)
    moduli = advance(flow, tasks)
    return np.array(at), np.array([moduli[k] for k in range(len(at))])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("study")
    parser.add_argument("branches")
    parser.add_argument("--distance", type=float, default=DISTANCE)
    arguments = parser.parse_args()
    data = open_branches(arguments.branches)
    setup = continuation_setup(nsdrill.load_study(arguments.study))
    scale = float(data.attrs["continue_to"] - data.attrs["continue_from"]) / 10.0
    flow = setup.flow((str(data.attrs["along_key"]),), (scale,), processors())
    print("| branch | scan: between | greatest moduli there | file |")
    print("| --- | --- | --- | --- |")
    motions, failed = 0, 0
    for branch in summarize_branches(data)["branches"]:
        if branch["motion"] != PERIODIC or not branch["stable"]:
            continue
        numbers, moduli = scanned(setup, flow, data, branch["branch"], arguments.distance)
        good = np.isfinite(moduli)
        motions, failed = motions + len(numbers), failed + int(np.sum(~good))
        numbers, moduli = numbers[good], moduli[good]
        borders = np.array(branch["stable"]).ravel()
        for k in np.flatnonzero(np.diff((moduli > 1.0).astype(int))):
            near = borders[np.argmin(np.abs(borders - numbers[k]))]
            low, high = sorted(numbers[k : k + 2])
            # the branch turns at a fold, between two motions at one number
            slack = arguments.distance if low == high else 1e-9
            missed = "" if low - slack <= near <= high + slack else " MISSED"
            print(
                f"| {branch['words']} | {numbers[k]:.3f} and {numbers[k + 1]:.3f} | "
                f"{moduli[k]:.5f}, {moduli[k + 1]:.5f} | {near:.5f}{missed} |"
            )
    print(f"\n{motions} motions, of which {failed} were not found")


if __name__ == "__main__":
    main()

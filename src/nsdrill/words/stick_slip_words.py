"""To which speed stick-slip may last, and that it ends earlier than torsion alone explains,
in words."""

from __future__ import annotations

import textwrap
from collections.abc import Iterator, Sequence

from nsdrill.data import Answer
from nsdrill.errors import count
from nsdrill.quantity import quantity
from nsdrill.words.values import Formatter

WIDTH = 100
# What leaves so many lobes, as in bit.lobes, and what lower ones mean.
OF_LOBES = {1: "a PDC bit", 3: "a roller cone"}
SMOOTH = "Many a PDC bit leaves the rock smooth, and then sticks up to the higher speeds: a height of zero shows it."
LOWER = (
    "Their height is rarely known, and under lower ones the bit sticks up to higher speeds: run the lowest that you "
    "expect as well."
)


def sticking_texts(summary: Answer, fmt: Formatter) -> Iterator[str]:
    """The warnings of a window, the ``summary``, of stick-slip that may last at points that
    are free on the way up."""
    found = summary["stick_slip"]
    if settings := found["settings"]:
        first = max(settings, key=lambda one: one["to"] - one["from"])
        where, axis = ", ".join(fmt.value(name, value) for name, value in first["at"].items()), first["axis"]
        if first["unstable"]:
            grows = "a vibration grows there by itself"
            if shown := first["shown"]:  # which the severity allows
                grows += f", and the runs show it at {count(shown, 'point')}"
            else:
                grows += ", more slowly than the runs are long"
            yield (
                f"STEADY DRILLING IS UNSTABLE, as{f' at {where},' if where else ''} "
                f"{fmt.range(axis, [first['from'], first['to']])}: {grows}. These points are not allowed."
            )
            return
        lasts, to = first["lasts_to"], "at every speed"
        if not lasts["everywhere"]:
            to = _to(first, fmt)
        if axis != "rotary_speed" and first["from"] != first["to"]:  # it differs from point to point
            to += f" at {fmt.value(axis, first['to'])}"
        step = f" ({fmt.value(axis, first['step'])})" if first["step"] else ""
        free = "free in the sweep"
        if sticking := found["sticking"]:
            others = "" if sticking == found["points"] else f" {sticking} of"
            free = f"of the sweep,{others} which stick there, at a severity of {summary['severity']} at most"
        ended = first["met"] and not first["is_dry"]
        some, of = found["started"], "" if summary["confidence"] is None else " in some of the samples"
        started = f", {'all' if some == found['points'] else some} of them when started there only" if some else ""
        yield (
            f"STICK-SLIP MAY LAST at {count(found['points'], 'point')} {free}{of}{started}, as"
            f"{f' at {where},' if where else ''} {fmt.range(axis, [first['from'], first['to']])}: once started it "
            f"lasts {to}{f', and a step of the sweep{step} ended it' if ended else ''}. They are not allowed."
        )


def _to(setting: Answer, fmt: Formatter) -> str:
    """``to 100 rpm``, and up to where the runs can show that, where that is less."""
    lasts, shown = (setting[name]["rotary_speed"] for name in ("lasts_to", "shown_to"))
    to, seen = (fmt.value("rotary_speed", fmt.outwards("rotary_speed", one, one)[1]) for one in (lasts, shown))
    if to == seen:
        return f"to {to}"
    runs = f"the smoothed friction of the runs shows it to {seen} only"
    return f"to {to} by dry friction, and {runs if shown else 'the runs, whose friction is smoothed, do not show it'}"


def stuck_through_text(summary: Answer, fmt: Formatter) -> Iterator[str]:
    """The warning of a window, the ``summary``, of points that the way up reached in
    stick-slip, which kept the collar off the wall on the way."""
    if (found := summary["stuck_through"]) is None:
        return
    weights = f", at {fmt.range('wob', found['wob'])}," if found["wob"] else ""
    wall = fmt.range_outwards("rotary_speed", found["from"], found["to"])
    here = ", the best one among them" if found["at_point"] else ""
    answer = summary["answer"]
    advice = "" if answer.trials else " Trials show which ways in are free (--trials)."
    named = ": take the way in that is named" if answer.way_in is not None and not answer.is_withdrawn else ""
    yield (
        f"STICK-SLIP TAKES THE STRING PAST WHIRL on the way up{weights} to {count(found['points'], 'allowed point')}"
        f"{here}: at {wall} the bit sticks, and the collar is not driven to the wall. "
        f"Brought up without stick-slip, as with more damping, it may whirl from there on{named}.{advice}"
    )


def unknown_end_text(summary: Answer) -> Iterator[str]:
    """The warning of a window, the ``summary``, of a model that does not tell to which speed
    stick-slip lasts, where no run at an allowed point tells it either."""
    found = summary["stick_slip"]
    if found["untried"]:
        why = "a step of the sweep may have ended it early" if found["met"] else "none was met, and nothing started it"
        remedy = (
            "Start the points with the bit at rest (sweep.procedure: all, initial.bit_speed of zero) to learn it; with "
            "a limited drive only strings that are wound up further tell it."
        )
        if summary["answer"].from_rest and "same" in summary["procedures"]:
            remedy = "The starts with the bit at rest do not tell it at every allowed point."
        of = "of this model, as with lobes or a limited drive"
        if found["by_smoothed"]:
            of = "by dry friction, as with a limited drive, and the smoothed friction of the runs ends it sooner"
            remedy = "Run with steeper friction (bit.friction.smoothing) to learn it."
        yield f"TO WHICH SPEED STICK-SLIP LASTS is not known {of}: {why}. {remedy}"


def early_lines(ends: Sequence[Answer], units: str) -> Iterator[str]:
    """The lines of a warning of settings at which stick-slip ends early, in the units
    ``si`` or ``field``; none where there are none."""
    if not ends:
        return
    yield from textwrap.wrap(early_text(ends, units), WIDTH, initial_indent="  ", subsequent_indent="  ")


def _dry(early: Answer, fmt: Formatter) -> str:
    """To which speed torsion alone keeps stick-slip by dry friction, by which the map is graded, where that is more
    than by the smoothed friction of the runs."""
    if "dry" not in early:
        return ""
    to = early["dry"]["value"]
    ends = "at every speed" if to is None else f"to {fmt.value('rotary_speed', to)}"
    return f" with the smoothed friction of the runs, and {ends} by dry friction"


def early_text(ends: Sequence[Answer], units: str) -> str:
    """The warning of these settings, of which it names the first."""
    fmt, first = Formatter(units), ends[0]
    where = ", ".join(fmt.value(name, value) for name, value in first["at"].items())
    where = f"at {where} " if where else ""
    by, alone = fmt.value("rotary_speed", first["by"]["value"]), fmt.range("rotary_speed", first["alone"]["value"])
    others = f", as at {count(len(ends) - 1, 'other setting')}" if len(ends) > 1 else ""
    but = "" if first["free"] else ", where it vibrates otherwise"
    alone += _dry(first, fmt)
    text = f"STICK-SLIP ENDS EARLY on the way up: {where}by {by}{but}{others}; torsion alone gives {alone}. "
    amplitude = first["surface_amplitude"]["value"]
    if amplitude > 0.0:
        number, height = first["lobes"], quantity("bit_surface_amplitude").text(amplitude, units, 4)
        lobes = "The lobe" if number == 1 else f"The {number} lobes"
        of = f" of {OF_LOBES[number]}" if number in OF_LOBES else ""
        return text + (
            f"{lobes}{of}, {height} high (bit.surface_amplitude), {'shakes' if number == 1 else 'shake'} the bit, "
            f"which dithers its friction away. {SMOOTH if number == 1 else LOWER}"
        )
    if first["contact"]:
        return text + "The collar was on the wall in the last run that sticks, which may take it away."
    return text + (
        "No contact was met that takes it away, so a step of the sweep ended it. Finer steps and a longer "
        "simulation.transient show it."
    )

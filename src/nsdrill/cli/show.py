"""nsdrill show."""

from __future__ import annotations

import json
from typing import Any

import click

from nsdrill.cli.reading import read
from nsdrill.units import format_quantity

AXIS_UNITS = {"depth": ("m", "ft"), "wob": ("kN", "klbf"), "rotary_speed": ("rad/s", "rpm")}
MOST_LISTED = 20


@click.command("show")
@click.argument("file", type=click.Path())
@click.option("--json", "as_json", is_flag=True, help="Machine-readable output, with every failed point.")
def command(file: str, as_json: bool) -> int:
    """Say what is in FILE, a results or a trace file."""
    from nsdrill.app.report import summarize

    summary = summarize(read(file))
    if as_json:
        click.echo(json.dumps(summary, indent=2))
    elif summary["kind"] == "trace":
        _show_trace(file, summary)
    else:
        _show_results(file, summary)
    return 0


def _axis_value(name: str, value: float) -> str:
    return format_quantity(value, AXIS_UNITS[name][0])


def _show_results(file: str, s: dict[str, Any]) -> None:
    click.echo(f"{file}: results of a sweep. {s['title']}".rstrip())
    click.echo(f"  made {s['created']} by nsdrill {s['nsdrill_version']}")
    for name, axis in s["axes"].items():
        if axis["points"] == 1:
            si, field = AXIS_UNITS[name]
            click.echo(
                f"  {name:13s} {format_quantity(axis['from'], si)} ({format_quantity(axis['from'], field)})")
        else:
            click.echo(
                f"  {name:13s} {_axis_value(name, axis['from'])} to {_axis_value(name, axis['to'])}, "
                f"{axis['points']} values")
    status = ", ".join(f"{count} {word}" for word, count in s["status"].items())
    click.echo(f"  points        {s['points']}: {status}; {s['settled']} settled")
    for procedure in s["procedures"]:
        counts = s["responses"][procedure]
        click.echo(f"\nResponses, {procedure}:")
        total = sum(counts.values())
        for word, count in counts.items():
            click.echo(f"  {word:28s} {count:8d}  {100 * count / total:5.1f} %")
        kinds = s["whirl_kinds"][procedure]
        if kinds:
            click.echo("  whirl: " + ", ".join(f"{count} {word}" for word, count in kinds.items()))
    if intervals := s.get("intervals"):
        _show_intervals(intervals)
    if s["ranges"]:
        click.echo("\nRanges over all points:")
        for name, r in s["ranges"].items():
            click.echo(f"  {name:26s} {r['min']:12.5g} to {r['max']:12.5g} {r['units']}")
    if failed := s["failed"]:
        click.echo(f"\nFailed points ({len(failed)}), to look at with nsdrill replay:")
        for point in failed[:MOST_LISTED]:
            where = ", ".join(_axis_value(name, point[name]) for name in AXIS_UNITS)
            click.echo(f"  {point['status']}: {where}, {point['procedure']}")
        if len(failed) > MOST_LISTED:
            click.echo(f"  and {len(failed) - MOST_LISTED} more (all with --json)")


def _show_intervals(intervals: list[dict[str, Any]]) -> None:
    most = 40
    click.echo("\nAlong the sweep:")
    for row in intervals[:most]:
        name = row["axis"]
        ends = _axis_value(name, row["from"])
        if row["points"] > 1:
            ends += f" to {_axis_value(name, row['to'])}"
        click.echo(f"  {row['procedure']:5s} {ends:32s} {row['points']:5d}  {row['response']}")
    if len(intervals) > most:
        click.echo(f"  and {len(intervals) - most} more (all with --json)")


def _show_trace(file: str, s: dict[str, Any]) -> None:
    click.echo(f"{file}: trace of one run. {s.get('title', '')}".rstrip())
    where = ", ".join(_axis_value(name, s[name]) for name in AXIS_UNITS if name in s)
    click.echo(f"  {where}; {s['samples']} samples over {s['duration']:g} s; ended {s.get('status', '')}")
    for name, r in s["ranges"].items():
        click.echo(f"  {name:18s} {r['min']:12.5g} to {r['max']:12.5g}")

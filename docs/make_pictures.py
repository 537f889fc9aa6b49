"""Run the studies in configs/ with the command line, draw them, and write their figures
into studies.md.

    python docs/make_pictures.py [FOLDER [GROUP ...]]

Takes some twenty minutes. The results files are kept in FOLDER (default: a temporary
one); those that are there already are drawn as they are. The groups of pictures are the
functions below. The text of the page is by hand: read it again after the numbers have
changed.
"""

from __future__ import annotations

import json
import re
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

from PIL import Image  # matplotlib needs it, so it is there

HERE = Path(__file__).parent
CONFIGS = HERE.parent / "configs"
STUDIES = {
    "fig2": "fig2_depth_same",
    "fig3": "fig3_depth_carried",
    "fig4": "fig4_speed_22kN",
    "fig5": "fig5_speed_67kN",
    "map": "map_wob_speed",
}
DRIVES = {
    "torsional": "torsional_speed",
    "soft_torque": "soft_torque_speed_67kN",
    "tuning": "soft_torque_tuning",
    "friction": "friction_laws",
    "drives": "drives_speed_67kN",
}
SEGMENTS = {"segments_rest": "segments_speed_100kN", "segments_down": "segments_speed_down"}
LATERAL = ("whirl_clearance", "inclination")
CHARTS = {
    "critical-speeds": ("fig5_speed_67kN", "Critical speeds of the default string, 66.72 kN"),
    "drive-card": ("soft_torque_speed_67kN", "Torsional waves at each kind of drive, 5000 m"),
    "drive-tuning": ("soft_torque_speed_67kN", "Tuning of a soft-torque drive, 5000 m"),
}
COEXISTENCE = {"ensemble_speed_22kN": ("shares", "attractors"), "basin_slice": ("basin",)}
UNCERTAIN = {"probability": (), "along": ("--wob", "60 kN"), "tornado": ("--kind", "tornado")}
# Of the elastic collar a sweep, and what stands in its traces.
COLLAR = "beam_modes_speed"
COLLAR_TRACES = {"beam_150kN": ("150 kN", "1 MN"), "beam_350kN": ("350 kN", "0.6 MN")}
SAME = ("sweep.procedure=same", "sweep.along=null")
WIDTH = 1400  # pixels, for the screen
BLOCK = re.compile(r"(<!-- result: (\w+) -->\n).*?(<!-- end of result -->)", re.DOTALL)
RANGES = {
    "stick_slip_index": (1, "%"),
    "lift_off_fraction": (100, "% of the time"),
    "wall_contact_fraction": (100, "% of the time"),
}


def nsdrill(*arguments: str) -> str:
    command = [sys.executable, "-c", "from nsdrill.cli.main import main; main()", *arguments]
    return subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True).stdout


def shrink(drawn: Path, picture: Path) -> None:
    """Fewer pixels and colours: the pictures are flat, and the repository keeps them
    for ever."""
    image = Image.open(drawn).convert("RGB")
    height = round(image.height * WIDTH / image.width)
    small = image.resize((WIDTH, height), Image.Resampling.LANCZOS)
    # Maximum coverage keeps the colours of responses that few points show; k-means
    # brings the colours of large areas back to what they are.
    small.quantize(96, Image.Quantize.MAXCOVERAGE, kmeans=2, dither=Image.Dither.NONE).save(picture, optimize=True)


def words(counts: dict[str, int]) -> str:
    return ", ".join(f"{name.replace('_', ' ').replace('+', ' + ')} {count}" for name, count in counts.items()) or "–"


def result(summary: dict[str, Any]) -> str:
    lines = ["| carried | points by response | kinds of whirl |", "| --- | --- | --- |"]
    for procedure in summary["procedures"]:
        lines.append(
            f"| {procedure} | {words(summary['responses'][procedure])} | {words(summary['whirl_kinds'][procedure])} |"
        )
    ranges = []
    for name, (scale, unit) in RANGES.items():
        ends = summary["ranges"][name]
        ranges.append(f"`{name}` {ends['min'] * scale:.3g} to {ends['max'] * scale:.4g} {unit}")
    lines += [
        "",
        f"Status: {words(summary['status'])}; settled {summary['settled']} of {summary['points']}. "
        f"Over all points: {'; '.join(ranges)}.",
        "",
    ]
    intervals = summary.get("intervals", [])
    if 0 < len(intervals) <= 30:
        axis, unit = (intervals[0]["axis"], {"depth": "m", "wob": "N", "rotary_speed": "rad/s"}[intervals[0]["axis"]])
        lines += [f"| carried | {axis} [{unit}] | points | response |", "| --- | --- | --- | --- |"]
        for row in intervals:
            ends = f"{row['from']:.5g}" + (f" to {row['to']:.5g}" if row["points"] > 1 else "")
            lines.append(f"| {row['procedure']} | {ends} | {row['points']} | {words({row['response']: 0})[:-2]} |")
        lines.append("")
    return "\n".join(lines)


def results_of(folder: Path, config: str, name: str = "", *changes: str) -> Path:
    """The results of a study in configs/, with these changes of keys; those that are in
    the folder already serve."""
    results = folder / f"{name or config}.h5"
    if not results.exists():
        sets = [word for change in changes for word in ("--set", change)]
        nsdrill("run", str(CONFIGS / f"{config}.yaml"), "-o", str(results), *sets)
    return results


def trace_of(folder: Path, config: str, name: str, *options: str) -> Path:
    """A run of a study in configs/, in time."""
    trace = folder / f"{name}.h5"
    nsdrill("simulate", str(CONFIGS / f"{config}.yaml"), *options, "-o", str(trace), "--overwrite")
    return trace


def draw(source: Path, name: str, *options: str) -> None:
    """Draw a file as docs/pictures/NAME.png."""
    with tempfile.TemporaryDirectory() as temporary:
        drawn = Path(temporary) / "drawn.png"
        nsdrill("plot", str(source), *options, "-o", str(drawn))
        shrink(drawn, HERE / "pictures" / f"{name}.png")


def charts(folder: Path) -> None:
    """The charts, for which nothing is run."""
    for kind, (config, title) in CHARTS.items():
        draw(CONFIGS / f"{config}.yaml", f"chart_{kind.replace('-', '_')}", "--kind", kind, "--title", title)


def studies(folder: Path) -> None:
    """The studies of the paper, and the page that tells what they find."""
    summaries = {}
    for name, config in STUDIES.items():
        results = results_of(folder, config)
        summaries[name] = json.loads(nsdrill("show", str(results), "--json"))
        draw(results, name)
    page = HERE / "studies.md"
    text = page.read_text(encoding="utf-8")
    page.write_text(BLOCK.sub(lambda m: f"{m[1]}{result(summaries[m[2]])}{m[3]}", text), encoding="utf-8")


def strings(folder: Path) -> None:
    """Drives, friction laws, segments, whirl."""
    for name, config in {**DRIVES, **SEGMENTS}.items():
        draw(results_of(folder, config), name)
    for config in LATERAL:
        draw(results_of(folder, config), config, "--kind", "whirl_kind")
    regulated = trace_of(folder, "segments_lqr", "regulated", "--rotary-speed", "13 rad/s", "--duration", "140 s")
    draw(regulated, "segments_lqr", "--title", "Segments with a regulator from 40 s on, 100 kN, 13 rad/s")


def beam(folder: Path) -> None:
    """The elastic collar: a sweep, and its span in time."""
    draw(results_of(folder, COLLAR), "beam_speed")
    for name, (wob, force) in COLLAR_TRACES.items():
        options = ("--wob", wob, "--set", f"initial.wall_force={force}", "--duration", "40 s", "--sample", "1 ms")
        title = f"Elastic collar under {wob}, released with {force} on the wall"
        draw(trace_of(folder, "beam_wob_contact", name, *options), name, "--title", title)


def coexistence(folder: Path) -> None:
    """Many starts of every operating point."""
    for config, kinds in COEXISTENCE.items():
        for kind in kinds:
            draw(results_of(folder, config), f"coexistence_{kind}", "--kind", kind)


def maps(folder: Path) -> None:
    """A refined map, one that is checked, and the safe window."""
    grid = ("simulation.transient=100 s", "simulation.observe=50 s")
    coarse = ("sweep.wob.points=16", "sweep.rotary_speed.points=16")
    titled = ("--title", "Map of weight on bit and rotary speed, 5000 m")
    refined = results_of(folder, "map_wob_speed", "maps_refined", *grid, *coarse, *SAME, "sweep.refine=2")
    draw(refined, "maps_refined", *titled)
    fine = ("sweep.wob.points=61", "sweep.rotary_speed.points=61", "simulation.verify=true")
    draw(results_of(folder, "map_wob_speed", "maps_trust", *grid, *fine), "maps_trust", *titled)
    draw(results_of(folder, "window_depth_speed"), "findings_window_22kN", "--kind", "window")


def motion(folder: Path) -> None:
    """What kind of motion each response is."""
    results = results_of(folder, "motion_speed_22kN")
    draw(
        results, "motion_poincare", "--kind", "poincare", "--title", "Returns to the Poincaré section, 5000 m, 22.24 kN"
    )
    draw(results, "motion_kinds", "--kind", "motion")


def uncertain(folder: Path) -> None:
    """Numbers that are not known."""
    results = results_of(folder, "uncertain_window")
    for name, options in UNCERTAIN.items():
        draw(results, f"uncertain_{name}", *options)


def traces(folder: Path) -> None:
    """One run in time: stick-slip at low speed, and a film of a collar that rolls along
    the wall."""
    slow = trace_of(folder, "fig4_speed_22kN", "trace", "--rotary-speed", "1.2 rad/s", "--duration", "60 s")
    draw(slow, "trace", "--title", "One run at 1.2 rad/s, 5000 m, 22.24 kN")
    whirl = ("--rotary-speed", "6.5 rad/s", "--set", "initial.x=70 mm", "--duration", "30 s")
    rolling = trace_of(folder, "fig4_speed_22kN", "whirl", *whirl)
    nsdrill(
        "plot",
        str(rolling),
        "--animate",
        "--from",
        "27s",
        "--to",
        "29s",
        "--width",
        "2.4in",
        "--no-title",
        "-o",
        str(HERE / "pictures" / "whirl.gif"),
        "--overwrite",
    )


def branches(folder: Path) -> None:
    """The motions behind figure 4."""
    sweep, found = results_of(folder, "fig4_speed_22kN"), folder / "branches_speed_22kN.h5"
    if not found.exists():
        study = str(CONFIGS / "branches_speed_22kN.yaml")
        nsdrill("branches", study, "--seeds", str(sweep), "-o", str(found))
    draw(found, "branches", "--over", str(sweep))


def learn(folder: Path) -> None:
    """The window of an assembly, what it costs to be safe, and a real ramp."""
    study = folder / "rotary.yaml"
    nsdrill("new", "--example", "rotary-assembly", "-o", str(study), "--overwrite")
    text = study.read_text(encoding="utf-8")
    unknown = folder / "uncertain.yaml"
    unknown.write_text(text.replace("# uncertain:", "uncertain:"), encoding="utf-8")
    results = folder / "engineer_window.h5"
    if not results.exists():
        nsdrill("run", str(study), "-o", str(results))
    draw(results, "engineer_window", "--kind", "window", "--units", "field")
    page = (HERE / "fit.md").read_text(encoding="utf-8")
    (data,) = re.findall(r"^```text\n(wob \[klbf\].*?)^```", page, re.MULTILINE | re.DOTALL)
    (folder / "rig.csv").write_text(data, encoding="utf-8")
    with tempfile.TemporaryDirectory() as temporary:
        drawn = str(Path(temporary) / "drawn.png")
        data = str(folder / "rig.csv")
        nsdrill("fit", str(unknown), "--data", data, "--picture", drawn, "--units", "field")
        shrink(Path(drawn), HERE / "pictures" / "fit.png")
    speeds = "{ramp: [[0 s, 3 rad/s], [600 s, 8 rad/s], [1200 s, 3 rad/s]]}"
    moved = trace_of(folder, "fig4_speed_22kN", "ramp", "--set", f"operation.rotary_speed={speeds}")
    sweep = results_of(folder, "fig4_speed_22kN")
    draw(moved, "ramp", "--kind", "ramp", "--over", str(sweep), "--title", "A real ramp")


def regenerative(folder: Path) -> None:
    """A drag bit over the rotary speed."""
    draw(results_of(folder, "regenerative_speed_44kN"), "regenerative", "--units", "field")


GROUPS: dict[str, Callable[[Path], None]] = {
    one.__name__: one
    for one in (
        *(charts, studies, strings, beam, coexistence, maps, motion, uncertain, traces, branches, learn),
        regenerative,
    )
}


def main(folder: Path, names: list[str]) -> None:
    if unknown := set(names) - GROUPS.keys():
        raise SystemExit(f"found {', '.join(sorted(unknown))}; allowed: {', '.join(GROUPS)}")
    needed = (CONFIGS, HERE / "pictures", HERE / "studies.md", HERE / "fit.md")
    if lacking := [path for path in needed if not path.exists()]:
        print(
            f"{lacking[0]}: there is no such file; this script needs a checkout of nsdrill, with the pages and "
            "studies: python docs/make_pictures.py",
            file=sys.stderr,
        )
        sys.exit(2)
    for name in names or GROUPS:
        GROUPS[name](folder)
        print(f"{name}: drawn", flush=True)


if __name__ == "__main__":
    if len(sys.argv) > 1:
        Path(sys.argv[1]).mkdir(parents=True, exist_ok=True)
        main(Path(sys.argv[1]), sys.argv[2:])
    else:
        with tempfile.TemporaryDirectory() as temporary:
            main(Path(temporary), [])

"""Run the studies in configs/ with the command line, draw them, and write their figures into studies.md.

    python docs/make_pictures.py [FOLDER]

Takes some five minutes. The results files are kept in FOLDER (default: a temporary one). The text of the page is by
hand: read it again after the numbers have changed.
"""

from __future__ import annotations

import json
import re
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from PIL import Image  # matplotlib needs it, so it is there

HERE = Path(__file__).parent
CONFIGS = HERE.parent / "configs"
STUDIES = {
    "fig2": "fig2_depth_same", "fig3": "fig3_depth_carried", "fig4": "fig4_speed_22kN", "fig5": "fig5_speed_67kN",
    "map": "map_wob_speed",
}  # fmt: skip
DRIVES = {
    "torsional": "torsional_speed", "soft_torque": "soft_torque_speed_67kN", "tuning": "soft_torque_tuning",
    "friction": "friction_laws", "drives": "drives_speed_67kN",
}  # fmt: skip
SEGMENTS = {"segments_rest": "segments_speed_100kN", "segments_down": "segments_speed_down"}
LATERAL = ("whirl_clearance", "inclination")
CHARTS = {
    "critical-speeds": "fig5_speed_67kN", "buckling": "fig5_speed_67kN", "drive-card": "soft_torque_speed_67kN",
    "drive-tuning": "soft_torque_speed_67kN",
}  # fmt: skip
COEXISTENCE = {"ensemble_speed_22kN": ("shares", "attractors"), "basin_slice": ("basin",)}
UNCERTAIN = {"probability": (), "along": ("--wob", "60 kN"), "tornado": ("--kind", "tornado")}
# Of the elastic collar a sweep, and what stands in its traces.
COLLAR = {"beam_speed": "beam_modes_speed"}
COLLAR_TRACES = {"beam_150kN": ("150 kN", "1 MN"), "beam_350kN": ("350 kN", "0.6 MN")}
WIDTH = 1400  # pixels, for the screen
BLOCK = re.compile(r"(<!-- result: (\w+) -->\n).*?(<!-- end of result -->)", re.DOTALL)
RANGES = {
    "stick_slip_index": (1, "%"), "lift_off_fraction": (100, "% of the time"),
    "wall_contact_fraction": (100, "% of the time"), "bit_force_max": (1e-3, "kN"),
    "bit_torque_max": (1e-3, "kN m"), "wall_force_max": (1e-3, "kN"),
}  # fmt: skip


def nsdrill(*arguments: str) -> str:
    command = [sys.executable, "-c", "from nsdrill.cli import main; main()", *arguments]
    return subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True).stdout


def shrink(drawn: Path, picture: Path) -> None:
    """Fewer pixels and colours: the pictures are flat, and the repository keeps them for ever."""
    image = Image.open(drawn).convert("RGB")
    height = round(image.height * WIDTH / image.width)
    small = image.resize((WIDTH, height), Image.Resampling.LANCZOS)
    # Maximum coverage keeps the colours of responses that few points show; k-means brings the colours of large areas
    # back to what they are.
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
        axis, unit = intervals[0]["axis"], {"depth": "m", "wob": "N", "rotary_speed": "rad/s"}[intervals[0]["axis"]]
        lines += [f"| carried | {axis} [{unit}] | points | response |", "| --- | --- | --- | --- |"]
        for row in intervals:
            ends = f"{row['from']:.5g}" + (f" to {row['to']:.5g}" if row["points"] > 1 else "")
            lines.append(f"| {row['procedure']} | {ends} | {row['points']} | {words({row['response']: 0})[:-2]} |")
        lines.append("")
    return "\n".join(lines)


def charts(folder: Path) -> None:
    """The charts, for which nothing is run."""
    for kind, config in CHARTS.items():
        drawn = folder / f"{kind}.png"
        nsdrill("plot", str(CONFIGS / f"{config}.yaml"), "--kind", kind, "-o", str(drawn), "--overwrite")
        shrink(drawn, HERE / "pictures" / f"chart_{kind.replace('-', '_')}.png")


def main(folder: Path) -> None:
    charts(folder)
    summaries = {}
    for name, config in STUDIES.items():
        results = folder / f"{name}.h5"
        nsdrill("run", str(CONFIGS / f"{config}.yaml"), "-o", str(results), "--overwrite")
        summaries[name] = json.loads(nsdrill("show", str(results), "--json"))
        drawn = folder / f"{name}.png"
        nsdrill("plot", str(results), "-o", str(drawn), "--overwrite")
        shrink(drawn, HERE / "pictures" / f"{name}.png")
    for name, config in {**DRIVES, **SEGMENTS, **COLLAR}.items():
        results, drawn = folder / f"{name}.h5", folder / f"{name}.png"
        nsdrill("run", str(CONFIGS / f"{config}.yaml"), "-o", str(results), "--overwrite")
        nsdrill("plot", str(results), "-o", str(drawn), "--overwrite")
        shrink(drawn, HERE / "pictures" / f"{name}.png")
    for name in LATERAL:
        results, drawn = folder / f"{name}.h5", folder / f"{name}.png"
        nsdrill("run", str(CONFIGS / f"{name}.yaml"), "-o", str(results), "--overwrite")
        nsdrill("plot", str(results), "--kind", "whirl_kind", "-o", str(drawn), "--overwrite")
        shrink(drawn, HERE / "pictures" / f"{name}.png")
    for config, kinds in COEXISTENCE.items():
        results = folder / f"{config}.h5"
        nsdrill("run", str(CONFIGS / f"{config}.yaml"), "-o", str(results), "--overwrite")
        for kind in kinds:
            drawn = folder / f"{kind}.png"
            nsdrill("plot", str(results), "--kind", kind, "-o", str(drawn), "--overwrite")
            shrink(drawn, HERE / "pictures" / f"coexistence_{kind}.png")
    results, drawn = folder / "uncertain.h5", folder / "uncertain.png"
    nsdrill("run", str(CONFIGS / "uncertain_window.yaml"), "-o", str(results), "--overwrite")
    for name, options in UNCERTAIN.items():
        nsdrill("plot", str(results), *options, "-o", str(drawn), "--overwrite")
        shrink(drawn, HERE / "pictures" / f"uncertain_{name}.png")
    for name, (wob, force) in COLLAR_TRACES.items():
        trace, drawn = folder / f"{name}.h5", folder / f"{name}.png"
        study, start = str(CONFIGS / "beam_wob_contact.yaml"), f"initial.wall_force={force}"
        nsdrill("simulate", study, "--wob", wob, "--set", start, "--duration", "40 s", "--sample", "1 ms",
                "-o", str(trace), "--overwrite")  # fmt: skip
        nsdrill("plot", str(trace), "-o", str(drawn), "--overwrite")
        shrink(drawn, HERE / "pictures" / f"{name}.png")
    # One run with its trajectory: stick-slip at low speed.
    trace, drawn = folder / "trace.h5", folder / "trace.png"
    nsdrill(
        "simulate",
        str(CONFIGS / "fig4_speed_22kN.yaml"),
        "--rotary-speed",
        "1.2 rad/s",
        "--duration",
        "60 s",
        "-o",
        str(trace),
        "--overwrite",
    )
    nsdrill("plot", str(trace), "-o", str(drawn), "--overwrite")
    shrink(drawn, HERE / "pictures" / "trace.png")
    # The collar rolls along the wall: a film.
    whirl = ("--rotary-speed", "6.5 rad/s", "--set", "initial.x=70 mm", "--duration", "30 s")
    nsdrill("simulate", str(CONFIGS / "fig4_speed_22kN.yaml"), *whirl, "-o", str(trace), "--overwrite")
    nsdrill("plot", str(trace), "--animate", "--from", "27s", "--to", "29s", "--width", "2.4in", "--no-title",
            "-o", str(HERE / "pictures" / "whirl.gif"), "--overwrite")  # fmt: skip
    regulated = ("--rotary-speed", "13 rad/s", "--duration", "140 s", "-o", str(trace), "--overwrite")
    nsdrill("simulate", str(CONFIGS / "segments_lqr.yaml"), *regulated)
    nsdrill("plot", str(trace), "-o", str(drawn), "--overwrite")
    shrink(drawn, HERE / "pictures" / "segments_lqr.png")
    results, branches, drawn = folder / "fig4.h5", folder / "branches.h5", folder / "branches.png"
    study = str(CONFIGS / "branches_speed_22kN.yaml")
    nsdrill("continue", study, "--seeds", str(results), "-o", str(branches), "--overwrite")
    nsdrill("plot", str(branches), "--over", str(results), "-o", str(drawn), "--overwrite")
    shrink(drawn, HERE / "pictures" / "branches.png")
    page = HERE / "studies.md"
    text = page.read_text(encoding="utf-8")
    page.write_text(BLOCK.sub(lambda m: f"{m[1]}{result(summaries[m[2]])}{m[3]}", text), encoding="utf-8")


if __name__ == "__main__":
    if len(sys.argv) > 1:
        Path(sys.argv[1]).mkdir(parents=True, exist_ok=True)
        main(Path(sys.argv[1]))
    else:
        with tempfile.TemporaryDirectory() as temporary:
            main(Path(temporary))

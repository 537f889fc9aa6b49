"""Models of somebody else's equations, in another package: an oscillator whose operating
point is a force and a ratio, and one without any. Through every command they say nothing of
a drill string, and their files have the axes that they declare."""

import json
import re

import h5py
import numpy as np
import pytest

from models.installed import install, python

# What only a drill string has. "To the bit" is said of numbers.
WORDS = re.compile(
    r"\b(depths?|measured depth|wob|weight on bit|bits?(?! for bit)[ _-](?:speed|bounce|torque)\w*|drill\w*|strings?|"
    r"collars?|holes?|walls?|rocks?|lobes?|rotary\w*|rpm|kN|klbf|stick\w*|slips?|whirl\w*|bounc\w*|stall\w*|torque\w*|"
    r"deeper|shallower)\b",
    re.I,
)
OWN = ("nsdrill", "continue.lobes", "lobes:", '"lobes"')  # the program and a key of every study

STUDIES = {
    "forced.yaml": """title: Up and down
model: forced
sweep: {force: {from: 0.1 N, to: 0.4 N, points: 4}, procedure: up-down}
simulation: {transient: 30 s, observe: 60 s}
record: {poincare: 4}
""",
    "map.yaml": """model: forced
sweep: {force: [0.1 N, 0.2 N, 0.3 N], ratio: [1.0, 1.2], procedure: up-down, along: force}
simulation: {transient: 30 s, observe: 30 s}
""",
    "bare.yaml": """title: A circuit
model: bare
sweep: {parameters.mu: {from: 0.5, to: 1.5, points: 3}, procedure: up-down}
simulation: {transient: 30 s, observe: 30 s}
""",
    "unknown.yaml": """model: forced
sweep: {force: [0.2 N, 0.3 N]}
uncertain: {oscillator.damping: {uniform: [0.1 N*s/m, 0.2 N*s/m]}, ratio: {uniform: [1.1, 1.3]}, samples: 16}
simulation: {transient: 30 s, observe: 30 s}
""",
    "starts.yaml": """model: bare
initial: {ensemble: 4}
simulation: {transient: 30 s, observe: 30 s}
""",
    "follow.yaml": """model: forced
continue: {along: force, from: 0.02 N, to: 0.1 N, seeds: {force: [0.05 N]}, lobes: [1], points: 60}
simulation: {transient: 100 s, observe: 30 s}
""",
    "cycles.yaml": """model: bare
continue: {along: parameters.mu, from: 0.5, to: 1.5, points: 60}
simulation: {transient: 60 s, observe: 30 s}
""",
    "fit.yaml": """model: forced
uncertain: {oscillator.damping: {uniform: [0.1 N*s/m, 0.3 N*s/m]}, samples: 16}
simulation: {transient: 30 s, observe: 30 s}
""",
    "fit.csv": "force [N],place_max [m]\n0.1,1.30\n0.2,1.35\n0.3,1.5\n",
    "log.csv": "time [s],force [N]\n0,0.1\n10,0.2\n20,0.3\n",
}
RAMP = "operation.force={ramp: [[0 s, 0.1 N], [20 s, 0.4 N]]}"
FILES = (
    "forced",
    "map",
    "bare",
    "unknown",
    "starts",
    "one",
    "combined",
    "trace",
    "traceb",
    "ramp",
    "branches",
    "cycles",
)
PAGES = (["forced.h5", "map.h5"], ["bare.h5"], ["branches.h5"])
COMMANDS = [
    *(["new", "--model", name, "-o", f"{name}0.yaml"] for name in ("forced", "bare")),
    *(["new", "--model", name, "--all", "-o", f"{name}1.yaml"] for name in ("forced", "bare")),
    *(["check", f"{name}{len(more)}.yaml"] for name in ("forced", "bare") for more in ([], ["--all"])),
    ["check", "forced.yaml", "--units", "field"],
    ["check", "bare.yaml", "--json"],
    *(["run", f"{name}.yaml", "-o", f"{name}.h5"] for name in ("forced", "map", "bare", "unknown", "starts")),
    ["run", "map.yaml", "-o", "one.h5", "--set", "sweep={}", "--set", "force=0.25 N"],
    ["run", "forced.yaml", "-o", "other.h5", "--set", "operation.ratio=1.3"],
    ["combine", "forced.h5", "other.h5", "-o", "combined.h5"],
    ["simulate", "forced.yaml", "-o", "trace.h5", "--at", "force=0.2N", "--duration", "20s"],
    ["simulate", "bare.yaml", "-o", "traceb.h5", "--at", "parameters.mu=2", "--duration", "20s"],
    ["simulate", "forced.yaml", "-o", "ramp.h5", "--set", RAMP, "--set", "sweep={}"],
    ["simulate", "forced.yaml", "-o", "logged.h5", "--set", "sweep={}", "--data", "log.csv"],
    ["replay", "forced.h5", "--at", "force=0.2N", "--procedure", "up", "-o", "again.h5"],
    ["replay", "bare.h5", "--at", "parameters.mu=0.5", "--procedure", "down", "-o", "againb.h5"],
    ["branches", "follow.yaml", "-o", "branches.h5"],
    ["branches", "cycles.yaml", "-o", "cycles.h5"],
    ["fit", "fit.yaml", "--data", "fit.csv", "-o", "fitted.yaml", "--batch", "16", "--rounds", "2"],
    *(["show", f"{name}.h5", *more] for name in FILES for more in ([], ["--json"])),
    ["diff", "forced.h5", "other.h5"],
    ["diff", "trace.h5", "ramp.h5"],
    ["classify", "forced.h5", "--set", "classify.settled.tolerance=0.1", "-o", "relabelled.h5"],
    ["export", "forced.h5", "-o", "forced.csv"],
    ["export", "bare.h5", "-o", "bare.csv"],
    ["export", "ramp.h5", "-o", "ramp.csv"],
    *(["report", *names, "-o", f"{names[0]}.html"] for names in PAGES),
]  # fmt: skip
REFUSED = {
    "window forced.h5": "declares no responses",
    "report map.h5 -o no.html --one-page": "declares no responses",
    "simulate forced.yaml -o no.h5 --depth 3m": "found with the model forced, which has no such value; allowed: --at",
    "replay bare.h5 --procedure up -o no.h5 --wob 3kN": "found wob; allowed: the axes parameters.mu",
    "check forced.yaml --set operation.wob=3kN": "which the model forced does not have",
    "check forced.yaml --set sweep.depth=[3m]": "allowed: force, ratio or another number of oscillator",
    "check bare.yaml --set operation.force=3N": "which the model bare does not have",
    "simulate bare.yaml -o no.h5 --data log.csv --set sweep={}": "which has no operating value",
}
SCRIPT = """
import io, json, os, re, sys, traceback
from contextlib import redirect_stderr, redirect_stdout
import click
os.environ["MPLBACKEND"] = "agg"
from nsdrill.cli.main import CommandExit, group
from nsdrill.errors import NsdrillError, naming_options
from nsdrill.web.session import Session

commands, FILES, said = json.loads(sys.argv[1]), sys.argv[2].split(), []

def call(args):
    out = io.StringIO()
    with redirect_stdout(out), redirect_stderr(out), naming_options():
        try:
            group.main(args, prog_name="nsdrill", standalone_mode=False)
            code = 0
        except CommandExit as end:
            code = end.code
            print(end.message)
        except (click.ClickException, NsdrillError) as error:
            code = 2
            print(error)
        except Exception as error:
            code = 1
            print("".join(traceback.format_exception(error)))
    said.append([" ".join(args), code, out.getvalue()])

for args in commands:
    call(args)
for name in FILES:
    call(["plot", f"{name}.h5", "--list"])
    for kind in re.findall(r"^([a-z-]+)  ", said[-1][2], re.M):
        call(["plot", f"{name}.h5", "--kind", kind, "-o", f"{name}_{kind}.svg"])
for name in ("forced.h5", "map.h5", "bare.h5", "branches.h5", "cycles.h5", "forced.yaml", "bare.yaml"):
    session = Session(name, "si")
    session.warm()
    told = [session.meta()]
    peaks = "u_peaks" if name in ("bare.h5", "cycles.h5") else "place_peaks"
    if session.results is not None:
        place = [0] * len(session.results.grid)
        told.append(session.diagram({"y": peaks})[0])
        motion = session.replay({"place": place, "seconds": 5.0})[0]
        told.append({key: value for key, value in motion.items() if key != "hole"})
        told += [session.saved({"place": place}), session.section({"place": place})[0]]
    elif session.branches is not None:
        told.append(session.diagram({"y": peaks})[0])
        told.append({key: value for key, value in session.orbit({"point": 1})[0].items() if key != "hole"})
    said.append([f"view {name}", 0, json.dumps(told, default=str)])
print(json.dumps(said))
"""


@pytest.fixture(scope="module")
def driven(tmp_path_factory):
    """What each command said, with the folder of the files that they made."""
    folder = tmp_path_factory.mktemp("others")
    install(folder, "forced", "bare")
    for name, text in STUDIES.items():
        (folder / name).write_text(text)
    commands = [*COMMANDS, *(command.split(" ") for command in REFUSED)]
    return folder, json.loads(python(folder, SCRIPT, json.dumps(commands), " ".join(FILES))[-1])


def drilling(text):
    text = re.sub(r"<string>:\d+: ", "", text)  # where a command is called here
    for own in OWN:
        text = text.replace(own, "")
    return sorted({text[max(0, one.start() - 30) : one.end() + 20] for one in WORDS.finditer(text)})


def test_every_command_takes_them_and_says_nothing_of_a_drill_string(driven):
    _, said = driven
    assert {what.split(" ")[0] for what, _, _ in said} >= {"new", "check", "run", "show", "plot", "view", "branches"}
    failed = [(what, text[-800:]) for what, code, text in said if code not in (0, 3) and what not in REFUSED]
    assert not failed
    spoken = {what: found for what, _, text in said if what not in REFUSED and (found := drilling(text))}
    assert not spoken


@pytest.mark.parametrize("command", REFUSED)
def test_what_needs_a_drill_string_is_refused_in_a_sentence(driven, command):
    _, said = driven
    code, text = next((code, text) for what, code, text in said if what == command)
    assert code == 2
    assert REFUSED[command] in text
    assert "Traceback" not in text


def written(path):
    """What a reader of the file reads: the texts of a picture, a page without its scripts."""
    text = path.read_text(encoding="utf-8")
    if path.suffix == ".svg":
        return " ".join([*re.findall(r"<!-- (.*?) -->", text), *re.findall(r' id="([^"]*)"', text)])
    return re.sub(r"<script>.*?</script>|<style>.*?</style>", "", text, flags=re.S)


def test_nor_do_pictures_pages_tables_and_studies(driven):
    folder, _ = driven
    files = [path for path in folder.iterdir() if path.suffix in (".svg", ".html", ".csv", ".yaml")]
    assert {path.suffix for path in files} == {".svg", ".html", ".csv", ".yaml"}
    spoken = {path.name: found for path in files if (found := drilling(written(path).replace("lobes,", "")))}
    assert not spoken


def test_a_file_has_the_axes_that_the_model_declares(driven):
    """As coordinates with unit and key, one that is not swept too, and no others."""
    folder, _ = driven
    with h5py.File(folder / "forced.h5") as file:
        assert file["force"][()].tolist() == pytest.approx([0.1, 0.2, 0.3, 0.4])
        assert (file["force"].attrs["units"], file["force"].attrs["key"]) == ("N", "operation.force")
        assert file["ratio"][()] == 1.2
        assert not {"depth", "wob", "rotary_speed"} & {*file, *file.attrs}
    with h5py.File(folder / "bare.h5") as file:
        assert file["parameters_mu"].attrs["key"] == "parameters.mu"
        assert not {"depth", "wob", "rotary_speed", "force"} & {*file, *file.attrs}
    with h5py.File(folder / "ramp.h5") as file:
        assert not {"depth", "wob", "rotary_speed"} & {*file, *file.attrs}
        assert file["force"][[0, -1]] == pytest.approx([0.1, 0.4])
        assert np.ptp(file["ratio"][:]) == 0.0


def test_a_replay_has_the_bits_of_the_sweep(driven):
    _, said = driven
    told = [text for what, _, text in said if what.startswith("replay") and what not in REFUSED]
    assert len(told) == 2
    assert all("bit for bit" in text for text in told)

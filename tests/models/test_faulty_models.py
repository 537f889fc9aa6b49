"""Models of other packages that are wrong, each in one way: every one is refused with its
name, the file and what is right, in words, and none of them gives numbers."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

PAGE = Path(__file__).parents[2] / "docs" / "dev" / "extending.md"
RETURN = '    return {"bit_speed": (-p.damping'
COLUMNS = "        spring, (_, wob, speed) = points.parameters.spring, points.operation\n"
FASTEST = '        return np.sqrt(table["stiffness"] / table["inertia"])\n'
STATIC = "equations = staticmethod(equations)"
RELATIVE = '    relative = ("twist",)'
SCALES = 'return 0.1, 0.1 * table["drive_speed"]'
CLASSIFY = "    def classify(self, features, status, thresholds, state_scales, dimension):\n        return "
MEAN = 'Mean("bit speed", "bit_speed_mean")'
FORMULA = "50.0 * (bit_speed_max - bit_speed_min) / np.maximum(bit_speed_mean, 1e-9)"
POINT = "@dataclass(frozen=True)\nclass Parameters(ModelParameters):\n    point = Operation"
# What stands in the model of the page, what stands there instead, and what is said.
FAULTS = {
    # equations
    "missing_rate": ('"bit_speed": (-p', '"bit_sped": (-p', "slopes of bit_sped; allowed: of bit_speed"),
    "extra_rate": ("/ p.inertia}", '/ p.inertia, "twist": 0.0}', "slopes of bit_speed, twist; allowed: of bit_speed"),
    "nan": ("falling = 0.4", "falling = float('nan')", "found nan as a number"),
    "infinite": ("falling = 0.4", "falling = 1e308 * 10", "found inf as a number"),
    "effect": (
        RETURN,
        f"    e = [0.0]\n    if s.bit_speed > 9.0:\n        e[0] = 3.0\n{RETURN}",
        r"e\[0\] = 3.0: found a store",
    ),
    "prints": (RETURN, f'    print("here")\n{RETURN}', "found output, 'here'"),
    "leaves": (RETURN, f"    raise SystemExit(7)\n{RETURN}", "SystemExit: 7 while the equations are read"),
    "hangs": (RETURN, f"    while True:\n        pass\n{RETURN}", "found equations that do not end"),
    "random": (
        RETURN,
        f"    import random\n    friction = friction * random.random()\n{RETURN}",
        r"random.random\(\): found what is read anew in every run, .* random numbers; allowed",
    ),
    "remembers": (
        "def equations(",
        "def equations(t, phase, s, p, o, calls=[]):\n    calls.append(1)\n    return first(t, phase, "
        "s, p, o)\n\n\ndef first(",
        "found a change of `equations`|read again",
    ),
    "method": (STATIC, "equations = equations", r"equations \(.*found a function; allowed: .*staticmethod"),
    "no_equations": (f"    {STATIC}\n", "", r"equations \(.*found none"),
    "arguments": ("def equations(t, phase, s, p, o)", "def equations(t, s, p)", r"found a function of \(t, s, p\)"),
    # methods
    "column_missing": ('            "damping": spring.damping,\n', "", "columns .*nothing for damping"),
    "column_nan": ('"damping": spring.damping', '"damping": np.nan', "columns .*found nan as damping"),
    "column_shape": (
        '"damping": spring.damping',
        '"damping": np.ones((2, 3))',
        "columns .* as damping; allowed: a number",
    ),
    "column_text": ('"damping": spring.damping', '"damping": "many"', "columns .*found many as damping"),
    "column_raises": (COLUMNS, f'{COLUMNS}        raise RuntimeError("none")\n', "columns .*RuntimeError: none"),
    "column_writes": (
        COLUMNS,
        f"{COLUMNS}        wob *= 2.0\n",
        r"columns \(.*line \d+\): ValueError: output array is read-only .*change a copy",
    ),
    "column_leaves": (COLUMNS, f"{COLUMNS}        raise SystemExit(7)\n", "columns .*SystemExit: 7"),
    "scale_negative": (SCALES, SCALES.replace("0.1,", "-0.1,"), "natural_scales .*-0.1 as the scale of twist"),
    "scale_writes": (
        SCALES,
        f'table["drive_speed"] *= 0.1\n        {SCALES}',
        r"natural_scales \(.*, line \d+\): ValueError: output array is read-only",
    ),
    "scale_zero": (SCALES, SCALES.replace("0.1,", "0.0,"), "natural_scales .*0.0 as the scale of twist"),
    "scale_huge": (SCALES, SCALES.replace("0.1,", "1e12,"), r"natural_scales .*1e\+12 as the scale of twist"),
    "scales_too_many": (SCALES, f"{SCALES}, 1.0", "natural_scales .*found 3 scales; allowed: one for each"),
    "fastest_negative": (FASTEST, FASTEST.replace("np.sqrt", "-np.sqrt"), "fastest .*a finite rate above 0"),
    "fastest_shape": (FASTEST, "        return np.ones((3, 3))\n", "fastest .*a finite rate above 0"),
    "labels_missing": ("    def fastest(", f"{CLASSIFY}{{}}\n\n    def fastest(", "classify .*those of super"),
    "labels_raise": ("    def fastest(", f"{CLASSIFY}1 / 0\n\n    def fastest(", "classify .*ZeroDivisionError"),
    # names and declarations
    "other_name": (
        'name="SPRING",\n    title',
        'name="other",\n    title',
        "not the description of a model with the name",
    ),
    "relative": (RELATIVE, '    relative = ("twst",)', "relative .*found twst; allowed: of its names twist"),
    "relative_missing": (RELATIVE, "    relative = ()", "relative .*found no twist; allowed: .*frame drive_speed"),
    "frame_missing": (', frame="drive_speed"', "", "relative .*found twist, whose channel has the frame None"),
    "contacts": (RELATIVE, f'    contacts = ("rock",)\n{RELATIVE}', "contacts .*found rock; allowed: none"),
    "singles": (RELATIVE, f"    singles = 5\n{RELATIVE}", "singles = 5; allowed: pairs"),
    "slopes": (
        '("acceleration",), ("inertia"',
        '("acceleration", "speed", "drift"), ("inertia"',
        "names, states .*found twist, bit_speed, with slopes acceleration, speed, drift; allowed: pairs",
    ),
    "first_order": (
        f"""    rows_named = NAMES
    declared = DECLARATION
{RELATIVE}""",
        f"""    rows_named = Names(
        (*STATES[:2], "filtered"), ("acceleration", "filtered_rate"), NAMES.parameters
    )
    declared = DECLARATION
{RELATIVE}""",
        "description, states .*found twist, bit_speed, drive_angle; allowed: .*filtered",
    ),
    "set_speed": ('"torque", "drive_speed")', '"torque", "speed")', "set_speed .*found drive_speed"),
    "twice": ('("inertia", "stiffness"', '("inertia", "inertia", "stiffness"', "names, parameters .*each name once"),
    "row": ('Channel("bit speed", "bit_speed"', 'Channel("bit speed", "bit_sped"', "declaration .*found 'bit_sped'"),
    "channel": (MEAN, MEAN.replace("bit speed", "bit sped"), "declaration .*found 'bit sped'; allowed: bit speed"),
    "feature_twice": (
        f"{MEAN},",
        f'{MEAN},\n        Mean("twist", "bit_speed_mean"),',
        "'bit_speed_mean' occurs twice",
    ),
    "derived": ("lambda bit_speed_max,", "lambda bit_speed_mx,", "declaration .*found 'bit_speed_mx'"),
    "formula_raises": (FORMULA, "1 / 0", "Derived 'stick_slip_index' .*found ZeroDivisionError: division by zero"),
    "formula_text": (FORMULA, "'many'", "Derived 'stick_slip_index' .*found 'many'; allowed: a real number"),
    "formula_shape": (FORMULA, "np.ones((7, 7))", "Derived 'stick_slip_index' .*found array.*one for each run"),
    "formula_complex": (FORMULA, "1j * bit_speed_max", "Derived 'stick_slip_index' .*found array.*a real number"),
    "no_formula": ("FEATURES = (", 'FEATURES = ("stuck_fraction", ', "found stuck_fraction among the features"),
    "response_twice": ('("stick_slip",)', '("stick_slip", "stick_slip")', "found stick_slip twice"),
    "response_unknown": ('("stick_slip",)', '("stickslip",)', "responses: found stickslip; allowed: .*stick_slip"),
    "response_untold": (
        '("stick_slip",)',
        '("stick_slip", "whirl")',
        "found whirl, and no feature wall_contact_fraction",
    ),
    "known_unknown": ('known("bit_speed_peaks")', 'known("bit_sped_peaks")', "KeyError: 'bit_sped_peaks'"),
    "compared_feature": (
        "compared=dict.fromkeys(FEATURES[:3]",
        'compared=dict.fromkeys((*FEATURES[:2], "bit_sped_mean")',
        "found compared: bit_sped_mean in its description",
    ),
    "compared_label": (
        "compared=dict.fromkeys(FEATURES[:3]",
        'compared=dict.fromkeys((*FEATURES[:3], "stick_slip_severity")',
        "found compared: stick_slip_severity in its description",
    ),
    "compared_scale": (
        'FEATURES[:3], "drive_speed")',
        'FEATURES[:3], "drive_sped")',
        r"description, compared \(.*found bit_speed_min in the scale drive_sped, .*allowed: .*drive_speed",
    ),
    "compared_own_scale": (
        "    def fastest(",
        '    def scales(self, table):\n        return {"speed": table[:, 4]}\n\n    def fastest(',
        r"description, compared \(.*in the scale drive_speed, .*allowed: a scale of speed, or None",
    ),
    "grouped": (
        "    compared=dict",
        '    grouped=("bit_sped_mean",),\n    compared=dict',
        "found grouped: bit_sped_mean in its description",
    ),
    "trace": ('"surface_torque"),\n    shown', '"bit_torque"),\n    shown', "found .*in its traces|drawn.histories"),
    "unit": ('565.0, "kg m^2"', '565.0, "kg furlong"', "the unit 'kg furlong' of inertia"),
    "section": (
        "spring: Spring = field(default_factory=Spring)",
        "spring: Spring = Spring",
        "found spring without its",
    ),
    "default": ("parameter(50.0,", "parameter(-50.0,", "a default outside its range, damping: found -50"),
    "start": (
        'state(None, "rad/s"',
        'state(1e9, "rad/s"',
        "initial: found a default outside its range, bit_speed: found 1e",
    ),
    "operating_unit": (
        POINT,
        '@dataclass(frozen=True)\nclass Own(Operation):\n    wob: float = parameter(1.0, "kg", high=9.0)\n\n\n'
        + POINT.replace("= Operation", "= Own"),
        r"operating point: found wob \[kg\]; allowed: wob in N",
    ),
    "operating_name": (
        POINT,
        "@dataclass(frozen=True)\nclass Own(Operation):\n    spring: float = parameter(1.0, high=9.0)\n\n\n"
        + POINT.replace("= Operation", "= Own"),
        "operating point: found the name spring, which is taken",
    ),
    "no_operating_point": (
        f"{POINT}  #",
        f"{POINT.replace('Operation', 'ModelParameters.point')}  #",
        "found an unknown key",
    ),
    "range": (
        'low=1e-3, high=1e6, meaning="Rotary',
        'low=1e6, high=1e-3, meaning="Rotary',
        "its range, inertia: found 565",
    ),
}
SCRIPT = """
import io, json, sys
from contextlib import redirect_stdout
import nsdrill
from nsdrill.equations import effects

effects.SECONDS = 0.5
STUDY = '''model: {0}
operation: {{wob: 60 kN}}
sweep: {{rotary_speed: {{from: 2 rad/s, to: 6 rad/s, points: 2}}}}
simulation: {{transient: 1 s, observe: 3 s}}
'''
said = {}
for name in sys.argv[1:]:
    out = io.StringIO()
    with redirect_stdout(out):
        try:
            study = STUDY.format(name)
            nsdrill.run(study, progress=False)
            nsdrill.simulate(study, duration=1.0, set={"operation.rotary_speed": "3 rad/s"})
            kind, text = "", "it ran"
        except nsdrill.NsdrillError as error:
            kind, text = "told", str(error)
        except BaseException as error:
            kind, text = type(error).__name__, str(error)
    said[name] = kind, text, out.getvalue()
print(json.dumps(said))
"""


def base(name):
    pieces = re.findall(r"^```python\n(.*?)^```", PAGE.read_text(encoding="utf-8"), re.M | re.S)
    (text,) = [piece for piece in pieces if "class Spring" in piece and "DESCRIPTION = " in piece]
    return text.replace('name = "spring"', f'name = "{name}"').replace('name="spring"', f'name="{name}"')


@pytest.fixture(scope="module")
def said(tmp_path_factory):
    """What is said of each faulty model, and of one without a fault, by one process."""
    folder = tmp_path_factory.mktemp("faulty")
    for name, (old, new, _) in {**FAULTS, "sound": ("", "", "")}.items():
        old, text = old.replace("SPRING", name), base(name)
        assert not old or text.count(old) == 1, name
        (folder / f"faulty_{name}.py").write_text(text.replace(old, new) if old else text)
    about = folder / "faulty-1.0.dist-info"
    about.mkdir()
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: faulty\nVersion: 1.0\n")
    entries = "".join(f"{name} = faulty_{name}\n" for name in (*FAULTS, "sound"))
    (about / "entry_points.txt").write_text(f"[nsdrill]\n{entries}")
    path = os.pathsep.join([str(folder), *filter(None, [os.environ.get("PYTHONPATH")])])
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT, *FAULTS, "sound"],
        env={**os.environ, "PYTHONPATH": path},
        capture_output=True,
        text=True,
        check=True,
    )
    return json.loads(done.stdout)


def test_the_model_of_the_page_has_no_fault(said):
    assert said["sound"] == ["", "it ran", ""]


@pytest.mark.parametrize("name", FAULTS)
def test_a_faulty_model_is_refused_in_words(said, name):
    kind, text, printed = said[name]
    assert kind == "told", text
    assert re.search(FAULTS[name][2], text, re.S), text
    assert f"faulty_{name}" in text or f"the model {name}" in text
    assert printed == ""


ELSEWHERE = {
    "another module": ("from faulty_numbers import WEIGHT\n", {"faulty_numbers.py": "WEIGHT = {}\n"}),
    "a file": (
        "import json, pathlib\nWEIGHT = json.loads((pathlib.Path(__file__).parent / 'k.json').read_text())\n",
        {"k.json": "{}"},
    ),
    "the environment": ("import os\nWEIGHT = float(os.environ['FAULTY_WEIGHT'])\n", {}),
}


@pytest.mark.parametrize("where", ELSEWHERE)
def test_a_file_knows_of_numbers_that_a_model_takes_from_elsewhere(where, tmp_path):
    """The model digest, by which a file is not resumed with other equations."""
    lines, others = ELSEWHERE[where]
    text = base("elsewhere").replace(RETURN, f"    friction = friction * WEIGHT\n{RETURN}")
    assert "* WEIGHT" in text
    (tmp_path / "faulty_elsewhere.py").write_text(f"{lines}{text}")
    about = tmp_path / "faulty-1.0.dist-info"
    about.mkdir()
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: faulty\nVersion: 1.0\n")
    (about / "entry_points.txt").write_text("[nsdrill]\nelsewhere = faulty_elsewhere\n")

    def digest(number):
        for name, content in others.items():
            (tmp_path / name).write_text(content.format(number))
        script = "from nsdrill.app.experiment import model_digest; print(model_digest('elsewhere'))"
        path = os.pathsep.join([str(tmp_path), *filter(None, [os.environ.get("PYTHONPATH")])])
        env = {**os.environ, "PYTHONPATH": path, "FAULTY_WEIGHT": str(number), "PYTHONDONTWRITEBYTECODE": "1"}
        done = subprocess.run([sys.executable, "-c", script], env=env, capture_output=True, text=True, check=True)
        return done.stdout

    assert digest(1.0) == digest(1.0)
    assert digest(1.0) != digest(3.0)


EDITED = """
import importlib, sys
from pathlib import Path

import nsdrill

study = sys.argv[2].format("edited")
nsdrill.run(study, progress=False)
file = Path(sys.argv[1])
file.write_text(file.read_text() + "\\nAFTER = 1\\n")
importlib.reload(sys.modules["faulty_edited"])
try:
    nsdrill.run(study, progress=False)
except nsdrill.InputError as error:
    print(error)
"""


def test_a_model_that_is_edited_while_a_process_runs_is_refused(tmp_path):
    """Parts of it that are imported again would be mixed with those that were not."""
    (tmp_path / "faulty_edited.py").write_text(base("edited"))
    about = tmp_path / "faulty-1.0.dist-info"
    about.mkdir()
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: faulty\nVersion: 1.0\n")
    (about / "entry_points.txt").write_text("[nsdrill]\nedited = faulty_edited\n")
    (study,) = re.findall(r"STUDY = '''(.*?)'''", SCRIPT, re.S)
    path = os.pathsep.join([str(tmp_path), *filter(None, [os.environ.get("PYTHONPATH")])])
    done = subprocess.run(
        [sys.executable, "-c", EDITED, str(tmp_path / "faulty_edited.py"), study],
        env={**os.environ, "PYTHONPATH": path},
        capture_output=True,
        text=True,
        check=True,
    )
    assert "the model edited: its files were changed after this process had imported them" in done.stdout
    assert "Start Python, or the kernel of the notebook, again." in done.stdout


JUMPING = """
import sys
import nsdrill

study = sys.argv[1].format("jumping").replace("wob: 60 kN}}", "wob: 60 kN}}").replace(
    "observe: 3 s", "observe: 30 s, max_steps: 3000000"
) + "initial: {bit_speed: 0 rad/s}\\n"
print(*nsdrill.check(study).warnings, sep="\\n")
print(nsdrill.check(study, price=True).price.text)
nsdrill.run(study, progress=True)
"""


def test_equations_that_jump_are_told_of_before_a_run_and_while_it_is_slow(tmp_path):
    """A hard sign of the velocity holds the bit in ever shorter steps, up to the limit."""
    smooth = "direction(500.0 * s.bit_speed)"
    text = base("jumping")
    assert text.count(smooth) == 1
    (tmp_path / "faulty_jumping.py").write_text(text.replace(smooth, "(1.0 if s.bit_speed > 0 else -1.0)"))
    about = tmp_path / "faulty-1.0.dist-info"
    about.mkdir()
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: faulty\nVersion: 1.0\n")
    (about / "entry_points.txt").write_text("[nsdrill]\njumping = faulty_jumping\n")
    (study,) = re.findall(r"STUDY = '''(.*?)'''", SCRIPT, re.S)
    path = os.pathsep.join([str(tmp_path), *filter(None, [os.environ.get("PYTHONPATH")])])
    env = {**os.environ, "PYTHONPATH": path}
    done = subprocess.run(
        [sys.executable, "-c", JUMPING, study], env=env, capture_output=True, text=True, check=True, timeout=300
    )
    assert "Jump: the slope of bit_speed jumps where that passes zero" in done.stdout
    assert "ever shorter steps and will end at simulation.max_steps" in done.stdout
    assert "will end at the limit of 3,000,000 (simulation.max_steps)" in done.stderr
    assert "no number of steps is enough" in done.stderr

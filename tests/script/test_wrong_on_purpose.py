"""What an author gets wrong, on purpose: wrong signs, units, shapes and names are refused with
the place, and none is silent."""

import re
import sys
import warnings
from textwrap import indent

import numpy as np
import pytest

import nsdrill
from nsdrill.equations import plain
from nsdrill.errors import InputError

LAW = """from nsdrill.equations.library import direction, expm1


@nsdrill.law(fall={fall})
def wrong({arguments}):
    {body}
"""
BELL = "return direction(n.smoothing * v) * (n.dynamic + n.rise * (1.0 + expm1(-((n.decay * v) ** 2))))"
LAWS = {
    "sign": ("lambda n: 0.0", "v, n", "return -direction(n.smoothing * v) * n.dynamic", "a coefficient below 0"),
    "even": ("lambda n: 0.0", "v, n", "return abs(direction(n.smoothing * v)) * n.dynamic", "not the opposite at the"),
    "bound": ("lambda n: 0.0", "v, n", BELL, r"a fall of 0\.18 s/m at usual numbers, and fall=0"),
    "less": ("lambda n: 0.7 * n.rise * n.decay", "v, n", BELL, r"a fall of 0\.18 s/m at usual numbers, and fall=0\.14"),
    "negative": ("lambda n: -1.0", "v, n", BELL, r"the fall -1\.0; allowed: the steepest fall"),
    "number": ("3.0", "v, n", BELL, r"fall=3\.0; allowed: a function of the numbers"),
    "shape": ("lambda n: 0.0", "v, n", "return direction(n.smoothing * v), 0.0", "as its value; allowed: one"),
    "nothing": ("lambda n: 0.0", "v, n", "direction(n.smoothing * v)", "None as its value"),
    "constant": ("lambda n: 0.0", "v, n", "return n.dynamic", "does not depend on v"),
    "steep": ("lambda n: 0.0", "v, n", "return direction(100.0 * v) * n.dynamic", r"does not depend on n\.smoothing"),
    "read": ("lambda n: 0.0", "v, n", "return direction(n.smoothing * v) * n.viscous", "viscous; .*rise is static"),
    "alone": ("lambda n: 0.0", "v", "return direction(v)", r"the arguments v; allowed: .*\(v, n, "),
}  # fmt: skip


@pytest.mark.parametrize("fault", LAWS)
def test_a_law_that_is_none_is_refused(script, fault):
    fall, arguments, body, words = LAWS[fault]
    with pytest.raises(InputError, match=words) as error:
        script(LAW.format(fall=fall, arguments=arguments, body=body), f"law_{fault}")
    assert re.match(rf"\S*law_{fault}.py, line \d+: (the law )?wrong: ", str(error.value))


def test_a_law_with_a_bound_that_holds_is_taken(script):
    """exp(-u^2) falls by 0.858 at most, at u = 1/sqrt(2): sqrt(2/e)."""
    script(LAW.format(fall="lambda n: 0.858 * n.rise * n.decay", arguments="v, n", body=BELL), "law_right")


MODEL = "@nsdrill.model\ndef m(x=0.1, v=0.0, *, k=1.0):\n    return v, -k * x - 0.1 * v\n\n\n"
OTHERS = {
    "bare": ("@m.feature\ndef p(v):\n    return v * v\n", r"m\.feature: found <function p .*allowed: the name of a"),
    "truth": ("@m.feature('p', 'W', mean='no')\ndef p(v):\n    return v * v\n", "found mean='no'; allowed: True or"),
    "parameter": ("@m.feature('k', 'W')\ndef p(v):\n    return v * v\n", "the name of a state, a parameter"),
    "of_torsion": ("@nsdrill.feature('torsion', 'p', mean=1)\ndef p(bit_speed):\n    return bit_speed\n", "mean=1;"),
    "painter": ("@nsdrill.picture('g', of='line')\ndef g(axes, data):\n    pass\n", r"three, as \(axes, data, shown\)"),
    "order": ("nsdrill.pair('p', a=[[0.5]], b=[0, 1], embedded=[1, 0], order='2')\n", "order='2'; allowed: a whole"),
}  # fmt: skip


@pytest.mark.parametrize("fault", OTHERS)
def test_what_would_be_measured_or_drawn_otherwise_is_refused(script, fault):
    text, words = OTHERS[fault]
    with pytest.raises(InputError, match=words):
        script(MODEL + text, f"other_{fault}")


UNITS = """@nsdrill.model
def m(t, x=number(0.1, "m"), v=number(0.0, "m/s"), *, k=number(2.0, "N/m"), mass=number(1.0, "kg"),
      c=number(0.1, "N s/m"), force=number(1.0, "N"), omega=number(1.0, "rad/s"), plain=2.0):
    return {}
"""
RIGHT = (
    "v, (-k * x - c * v + force * np.cos(omega * t)) / mass",
    "v, -9.81 - 2.0 * x",  # a number in the text may have any unit
    "v, (-k * x - plain * v) / mass",
    "v, -k * nsdrill.touching('stop', x - 0.1) / mass - 2.0 * max(v, 0.0)",
    "v, -k * x / mass - nsdrill.friction('pad', slip=v, normal=force, static=0.3, smoothing=plain) / mass",
)
WRONG = {
    "v, (-k * x - k * v) / mass": r"a sum of values in N and in kg m/s\^3",
    "v, -k * x": r"the slope of v in N; allowed: in m/s\^2",
    "v * v, -k * x / mass": r"the slope of x in m\^2/s\^2; allowed: in m/s",
    "v, (force * np.cos(omega) - k * x) / mass": r"the sine or cosine of a value in 1/s; allowed: of an angle",
    "v, -k * x / mass if x > v else -plain * v": r"a comparison of values in m and in m/s",
    "v, -k * max(x, force) / mass": r"the greater or lesser of values in m and in N",
}


@pytest.mark.parametrize("slopes", RIGHT)
def test_units_that_go_together(script, slopes):
    script(UNITS.format(slopes), "units_right")


@pytest.mark.parametrize("slopes", WRONG)
def test_units_that_do_not_are_refused(script, slopes):
    with pytest.raises(InputError, match=WRONG[slopes]) as error:
        script(UNITS.format(slopes), "units_wrong")
    assert re.match(r"\S*units_wrong.py, line 9: m: (return .*: )?found ", str(error.value))


def test_a_default_is_a_number_in_si():
    with pytest.raises(InputError, match=r"the unit 'mm', of which one is 0\.001 in SI"):
        nsdrill.number(3.0, "mm")


def test_a_parameter_with_the_name_of_a_setting_is_given_in_full(script):
    made = script(
        "@nsdrill.model\ndef named(x=0.1, v=0.0, *, observe=2.0):\n    return v, -observe * x - v\n", "named_alike"
    ).named
    with pytest.raises(InputError, match=r"found observe, which several keys have; allowed: .*parameters\.observe"):
        made.study(observe=10.0)
    study = made.study(**{"simulation.observe": 10.0, "parameters.observe": 3.0})
    assert study.resolved["simulation"]["observe"] == 10.0
    assert study.resolved["parameters"]["observe"] == 3.0


AFRESH = (
    "datetime.datetime.now().hour",
    "datetime.date.today().day",
    "time.time() * 0.0",
    "time.localtime().tm_hour",
    "clock().day",
    "float(open('k.txt').read())",
)
OF_DAY = {
    "model": "@nsdrill.model\ndef m(x=0.1, v=0.0, *, k=1.0):\n    return v, -k * x - {}\n",
    "helper": "def day():\n    return {}\n\n\n@nsdrill.model\ndef m(x=0.1, v=0.0):\n    return v, -day() * x\n",
    "feature": "@nsdrill.feature('torsion', 'f')\ndef f(bit_speed):\n    return bit_speed * {}\n",
    "drive": "@nsdrill.drive\ndef f(lag, drive_speed, set_speed, *, k=900.0):\n    return -k * lag - {}\n",
    "law": "@nsdrill.law(fall=lambda n: 0)\ndef f(v, n):\n    return n.dynamic * np.tanh(n.smoothing * v) * {}\n",
}


OUTSIDE = (
    "np.loadtxt('k.txt').item()", "np.genfromtxt('k.txt').item()", "np.fromfile('k.txt').size",
    "np.load('k.npy').item()", "float(Path('k.txt').read_text())", "float(HELD.read_text())",
    "float(os.popen('cat k.txt').read())", "os.stat('k.txt').st_size", "os.getpid()", "len(os.listdir('.'))",
    "os.path.getmtime('k.txt')", "os.path.exists('k.txt')", "float(io.open('k.txt').read())", "os.cpu_count()",
    "float(subprocess.check_output(['cat', 'k.txt']))", "len(glob.glob('*.txt'))",
    "float(next(fileinput.input('k.txt')))",
    "json.loads(HELD.read_text())", "len(linecache_of('k.txt'))", "float(deep(HELD))",
)  # fmt: skip


@pytest.mark.parametrize("read", OUTSIDE)
def test_files_and_the_machine_are_refused_through_any_library(script, tmp_path, monkeypatch, read):
    """In the line of the equations, also where a library or a helper opens the file."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "k.txt").write_text("2.5")
    np.save(tmp_path / "k.npy", np.array(2.5))
    head = (
        "import fileinput, glob, io, json, os, subprocess\nfrom pathlib import Path\n\nHELD = Path('k.txt')\n\n\n"
        "def linecache_of(name):\n    return io.open(name).readlines()\n\n\n"
        "def deep(path):\n    return path.open().read()\n\n\n"
    )
    with pytest.raises(InputError, match=r"outside\w*.py, line \d+: .*found what is read anew in every run"):
        script(head + OF_DAY["model"].format(f"{read} * x"), "outside")


def test_an_import_is_no_file_that_is_read(script, monkeypatch):
    monkeypatch.delitem(sys.modules, "colorsys", raising=False)
    text = (
        "import os\nimport warnings\n\n\n@nsdrill.model\ndef m(x=0.1, v=0.0, *, k=1.0):\n    import colorsys\n"
        "    warnings.warn('seen')\n"
        "    return v, -k * os.path.join('a', 'b').count('a') * x * (colorsys.ONE_THIRD > 0.0)\n"
    )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        script(text, "imported_inside")


@pytest.mark.parametrize("kind", OF_DAY)
@pytest.mark.parametrize("read", AFRESH)
def test_the_time_of_day_and_files_are_refused(script, kind, read):
    """Two readings that follow each other do not differ."""
    head = "import datetime\nimport time\nfrom datetime import datetime as dt\n\nclock = dt.now\n\n\n"
    with pytest.raises(InputError, match=r"day_\w+.py, line \d+: \w+: .*\(.*\): found what is read anew in every run"):
        script(f"{head}{OF_DAY[kind].format(read)}", f"day_{kind}")


def test_the_time_of_day_is_refused_where_the_function_imports_it(script):
    text = "@nsdrill.model\ndef m(x=0.1, v=0.0):\n    from datetime import date\n    return v, -x * date.today().day\n"
    with pytest.raises(InputError, match="found what is read anew in every run"):
        script(text, "day_imported")


def test_names_alike_and_what_is_read_above_the_function_are_taken(script):
    text = (
        "import datetime\n\nDAY = datetime.date(2020, 5, 3).day\nHELD = float(open(__file__).read()[0] == 'i')\n\n\n"
        "def open(x):\n    return 2.0 * x\n\n\n"
        "@nsdrill.model\ndef m(x=0.1, v=0.0, *, late=1.0, k=datetime.datetime.now().hour * 1.0):\n"
        "    return v, -open(late) * x - DAY * HELD * v - datetime.date(2020, 5, 3).day * k\n"
    )
    script(text.replace("float(open(", "float(__builtins__['open']("), "day_alike")


RUBBED = (
    "@nsdrill.model\ndef rubbed(x=0.1, v=0.0, *, load=1.0, static=0.3, dynamic=0.2, steep=100.0, fall=3.0, one=0.4):\n"
    "    f = nsdrill.friction('pad', slip=v - 0.2, normal=2.0 * load, static=static, dynamic=dynamic, decay=fall,\n"
    "                         smoothing=steep)\n"
    "    g = nsdrill.friction('end', slip=v, normal=1.0 + x, static=one, smoothing=100.0)\n"
    "    return v, -x - f - g\n"
)
DRIVES = {
    "load": ({"load": -1.0}, r"parameters\.load: found a normal load of -2 in the friction 'pad', at load = -1; .*low"),
    "static": ({"static": -1.0}, r"parameters\.static: found static less dynamic of -1\.2 .*, at static = -1, dyn"),
    "dynamic": ({"dynamic": 0.5}, r"parameters\.dynamic: found static less dynamic of -0\.2 .* has orders=\('dyn"),
    "least": ({"dynamic": -0.5}, r"parameters\.dynamic: found a coefficient of -0\.5 in the friction 'pad'"),
    "smoothing": ({"steep": -100.0}, r"parameters\.steep: found a smoothing of -100"),
    "decay": ({"fall": -3.0}, r"parameters\.fall: found a decay of -3"),
    "alone": ({"one": -0.4}, r"parameters\.one: found a coefficient of -0\.4 in the friction 'end'"),
    "axis": ({"load": (-2.0, 1.0, 4)}, r"sweep\.parameters\.load: found a normal load of -4"),
    "values": ({"load": [1.0, -2.0]}, r"sweep\.parameters\.load: found a normal load of -4"),
    "corner": ({"static": (0.3, 0.5, 3), "dynamic": (0.2, 0.4, 3)}, r"less dynamic of -0\.1 .*0\.3, dynamic = 0\.4"),
    "samples": ({"uncertain": {"load": (-1.0, 2.0), "samples": 8}}, r"uncertain\.parameters\.load: found a normal "),
    "followed": ({"continued": {"load": (-1.0, 1.0)}}, r"parameters\.load: found a normal load of -2"),
}  # fmt: skip


@pytest.mark.parametrize("how", DRIVES)
def test_friction_that_drives_is_refused_at_the_values_of_a_study(script, how):
    made, (given, words) = script(RUBBED, "rubbed_at").rubbed, DRIVES[how]
    with pytest.raises(InputError, match=words):
        made.study(transient=1, observe=1, **given)


def test_friction_that_brakes_at_all_values_of_a_study_is_taken(script):
    made = script(RUBBED, "rubbed_at").rubbed
    made.study(load=0.0, steep=(0.0, 10.0, 3), static=(0.5, 0.6, 2), dynamic=[0.1, 0.5], fall=0.0, one=0.0)
    pairs = {"static": [0.3, 0.6], "dynamic": [0.2, 0.5]}  # each sample brakes, and no sample is the corner 0.3, 0.5
    made.study(uncertain={"table": pairs})


@pytest.mark.parametrize(("given", "words"), [
    ({"static": -0.1}, "found static=-0.1"),
    ({"static": 0.3, "dynamic": -0.1}, "found dynamic=-0.1"),
    ({"static": 0.3, "dynamic": 0.2, "decay": -1.0}, "found decay=-1.0"),
    ({"static": 0.3, "dynamic": 0.4}, "found dynamic=0.4 above static=0.3; allowed: at most static"),
])  # fmt: skip
def test_numbers_with_which_friction_drives_are_refused(given, words):
    with pytest.raises(InputError, match=words):
        nsdrill.friction("pad", slip=1.0, normal=1.0, smoothing=9.0, **given)


def test_an_order_with_a_number_is_refused_with_the_remedy(script):
    text = "@nsdrill.model(orders=('k >= 1',))\ndef m(x=0.1, v=0.0, *, k=1.0):\n    return v, -k * x\n"
    with pytest.raises(InputError, match=r"a bound that is a number is low= or high= of nsdrill\.number"):
        script(text, "order_number")


def test_a_first_row_of_a_pair_is_refused_with_where_rows_begin():
    with pytest.raises(InputError, match=r"for stages 2, 3, \.\.\., as a begins at stage 2"):
        nsdrill.pair("rows", a=[[], [0.5]], b=[0, 1], embedded=[1, 0], order=2)


GIVEN = {
    "complex": ({"k": 1j}, r"parameters\.k: found 1j; allowed: a number"),
    "set": ({"k": {1.0, 2.0}}, r"parameters\.k: found \{1\.0, 2\.0\}; allowed: a number"),
    "generator": ({"k": (one for one in (1.0, 2.0))}, r"parameters\.k: found <generator .*; allowed: a number"),
    "slice_number": ({"slice": {"x": 0.5, "v": (0, 1, 3)}}, r"slice: found x=0\.5; allowed: two states, each with its"),
    "slice_text": ({"slice": "x"}, "slice: found 'x'; allowed: two states"),
    "slice_names": ({"slice": ["x", "v"]}, r"slice: found \['x', 'v'\]; allowed: two states"),
    "continued": ({"continued": "k"}, "continued: found 'k'; allowed: one number with its range"),
    "continued_axis": ({"continued": {"k": (0.1, 1.0, 20)}}, "continued: found k; allowed: one number with its range"),
    "uncertain": ({"uncertain": "k"}, r"uncertain: found 'k'; allowed: numbers by name, each with \(low, high\)"),
    "correlated": ({"uncertain": {"k": (1.0, 2.0), "correlations": 0.5}}, r"correlations=0\.5; allowed: two names and"),
    "table": ({"uncertain": {"table": [1, 2]}}, r"table: found \[1, 2\]; allowed: a list of values of each name"),
    "along": ({"k": (0.1, 1.0, 3), "procedure": "up", "along": 3}, "found 3, which is none of its names"),
}


@pytest.mark.parametrize("what", GIVEN)
def test_arguments_of_a_study_of_another_kind_are_refused_in_words(script, what):
    """None ends in a TypeError of Python or of JSON."""
    given, words = GIVEN[what]
    with pytest.raises(InputError, match=words):
        script(MODEL, f"given_{what}").m.study(**given)


def test_arrays_of_numpy_are_numbers_and_lists(script):
    made = script(MODEL, "given_arrays").m
    assert made.study(k=np.array(0.3)).parameters.parameters.k == 0.3
    assert made.study(continued={"k": (0.1, 1.0), "seeds": np.array([0.2, 0.3])}).continuation.seeds == {
        "parameters.k": [0.2, 0.3]
    }


DRAWN = (
    "np.random.default_rng(1).normal()",
    "np.random.normal()",
    "random.random()",
    "random.Random(3).gauss(0.0, 1.0)",
)


@pytest.mark.parametrize("draw", DRAWN)
def test_random_numbers_in_equations_are_refused_however_they_are_seeded(script, draw):
    """With a seed two readings are alike, and what is meant as noise was one constant."""
    text = f"import random\n\n\n@nsdrill.model\ndef m(x=0.1, v=0.0):\n    return v, -x + 0.1 * {draw}\n"
    with pytest.raises(InputError, match=r"found what is read anew in every run.* or random numbers"):
        script(text, "drawn")


def test_a_random_number_that_is_drawn_once_is_a_constant(script):
    text = "@nsdrill.model\ndef m(x=0.1, v=0.0):\n    return v, -x * ROUGH\n"
    assert script(f"ROUGH = np.random.default_rng(1).normal()\n\n\n{text}", "drawn_once").m.study()


OWN = "c = 1.0\n@nsdrill.model\ndef m(x=0.1, v=0.0):\n    {}\n    {}\n    return v, -c * x\n"
HELPER = "c = 0\ndef h(y):\n    {}\n    c += 1\n    return c * y\n"
OF_HELPER = "@nsdrill.model\ndef m(x=0.1, v=0.0):\n    return v, -h(x)\n"


def within(text: str, name: str) -> str:
    return f"def made():\n{indent(text, '    ')}    return {name}\n{name} = made()\n"


KEPT = {
    "nonlocal_own": within(OWN.format("nonlocal c", "c = c + 1.0"), "m"),
    "nonlocal_read": within(OWN.format("nonlocal c", "pass"), "m"),
    "nonlocal_helper": within(HELPER.format("nonlocal c"), "h") + OF_HELPER,
    "global_own": OWN.format("global c", "c = x"),
    "global_read": OWN.format("global c", "pass"),
    "global_helper": HELPER.format("global c") + OF_HELPER,
    "global_inner": OWN.format("def kept(y):\n        global c\n        c = y", "kept(x)"),
}


@pytest.mark.parametrize("how", KEPT)
def test_what_is_kept_between_calls_is_refused_in_its_line(script, how):
    text, statement = KEPT[how], f"{how.partition('_')[0]} c"
    line = 6 + text.splitlines().index(next(one for one in text.splitlines() if statement in one))
    words = rf"kept_{how}.py, line {line}: \w+: {statement}: found `{statement[:-2]}`: .*; allowed: .* a state with its"
    with pytest.raises(InputError, match=words):
        script(text, f"kept_{how}")


def test_an_inner_function_may_add_to_a_name_of_the_equations(script):
    text = (
        "@nsdrill.model\ndef m(x=0.1, v=0.0):\n    force = -0.5 * v\n\n    def add(more):\n        nonlocal force\n"
        "        force = force + more\n\n    add(-x)\n    add(-0.1 * x * x * x)\n    return v, force\n"
    )
    made = script(text, "kept_within").m
    slopes = plain.values(made.reading.slopes, made.reading.given({"x": 0.3, "v": 0.2}, {}))
    assert [float(one) for one in slopes.values()] == pytest.approx(made(0.3, 0.2)) == [0.2, -0.1 - 0.3 - 0.0027]


RUB = "nsdrill.friction('pad', slip={}, normal=1.0, static=0.3, smoothing=100.0)"
DRIVING = {
    "turned": ("0.2 - v", "v, -x - f", "'pad', whose load makes its slip grow; allowed: one that brakes"),
    "added": ("v", "v, -x + f", "'pad', whose load makes its slip grow"),
    "loose": ("v", "v, -x", "'pad', whose load no slope reads"),
}


@pytest.mark.parametrize("fault", DRIVING)
def test_friction_that_drives_or_does_nothing_is_refused(script, fault):
    """A block that its belt threw, or that no belt touched, was run without a word."""
    slip, slopes, words = DRIVING[fault]
    text = "@nsdrill.model\ndef m(x=0.1, v=0.0):\n    f = {}\n    return {}\n"
    with pytest.raises(InputError, match=rf"driving_{fault}.py, line 6: m: found the friction {words}"):
        script(text.format(RUB.format(slip), slopes), f"driving_{fault}")


@pytest.mark.parametrize(
    "slopes", ["v, -x - f, 0.0", "v, -x - 2.0 * f, f", "v, -x - f + 0.5 * f, f", "v, -0.1 * f, 0.1 * v - f"]
)
def test_friction_that_brakes_its_slip_is_taken(script, slopes):
    """Also between two bodies, of which it drives one."""
    text = "@nsdrill.model\ndef m(x=0.1, v=0.0, w=0.0):\n    f = {}\n    return {}\n"
    slip = "w" if slopes.startswith("v, -0.1") else "v - 0.2 - w"
    assert script(text.format(RUB.format(slip), slopes), "braking").m.study()


def test_friction_the_other_way_round_is_added(script):
    text = f"@nsdrill.model\ndef m(x=0.1, v=0.0):\n    return v, -x + {RUB.format('0.2 - v')}\n"
    assert script(text, "added").m.study()


def test_each_contact_brakes_at_its_own_rest(script):
    """At a slip of 0.2 m/s a smoothing of 100 s/m is past its steepest: two contacts of one block
    rest at different speeds, each as fast as where it is alone."""
    made = script(RUBBED, "rubbed_at").rubbed
    numbers = {name: float(value) for name, value in made.reading.signature.parameters.items()}
    rates = made.reading.consequences.braking(lambda states: made.reading.given(states, numbers))
    # (2/pi) smoothing, times load and coefficient at rest
    assert rates["pad"] == pytest.approx(2.0 * 0.3 * 200.0 / np.pi, rel=0.01)
    assert rates["end"] == pytest.approx(1.0 * 0.4 * 200.0 / np.pi, rel=0.01)


@pytest.mark.parametrize("call", ['friction("slider", slip=v)', 'touching("wall")'])
def test_a_wrong_call_is_told_without_what_is_allowed_on_values(script, call):
    """A list of operators and functions helps no one who left out an argument."""
    text = f"""
@nsdrill.model
def wrong_call(t, x=0.1, v=0.0, *, damping=0.2):
    return {{"x": v, "v": -damping * v - x - nsdrill.{call}}}
"""
    with pytest.raises(InputError, match=r"missing .* required") as told:
        script(text, "wrong_call")
    assert "allowed on values" not in str(told.value)

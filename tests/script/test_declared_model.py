"""What a script may declare, what follows from it, and what is refused, with file, line and
remedy."""

import importlib
import re
from pathlib import Path

import numpy as np
import pytest

import nsdrill
from nsdrill.errors import InputError, NsdrillError, RunWarning, StudyError
from nsdrill.figures import picture_kinds
from nsdrill.kernel import own_pairs
from nsdrill.models import registry
from nsdrill.models.registry import scripted
from nsdrill.models.variant import variant_of
from nsdrill.quantity import find
from script.conftest import HEAD, example


def test_called_with_numbers_it_gives_numbers(duffing):
    slopes = duffing(0.0, 0.5, 0.0, force=0.4)
    assert slopes == {"x": 0.0, "v": pytest.approx(0.4 + 0.5 - 0.125)}


def test_pairs_frames_and_states_of_first_order(script):
    made = script(
        "@nsdrill.model\ndef mixed(a=0.0, q=1.0, b=0.0, c=0.2, *, speed=3.0):\n"
        "    return {'a': b - speed, 'b': -a - b, 'q': -q + c, 'c': a - c}\n",
        "mixed_states",
    ).mixed
    read = made.reading
    assert read.pairs == {"a": "b"}
    assert read.singles == ("q", "c")
    assert read.states == ("a", "b", "q", "c")
    table = made.model.pack(made.study(speed=5.0).parameters and _values(made.study(speed=5.0)), None)
    assert variant_of(made.model).frame_rates(table)[0].tolist() == [-5.0, 0.0, 0.0]


def _values(study):
    from nsdrill.app.simulating.integration import points_of

    return points_of(study, study.operation)


@pytest.mark.parametrize(
    ("force", "rate", "forced"),
    [
        ("np.cos(omega * t)", 2.0, True),
        ("np.cos(2 * np.pi * t / omega)", np.pi, True),
        ("np.cos(t * omega) + np.sin(-3 * omega * t)", 2.0, True),
        ("np.cos(2 * omega * t) + np.cos(3 * omega * t)", 2.0, True),
        ("np.cos(2.5 * t)", 2.5, True),
        ("np.cos(t) + np.sin(3 * t)", 1.0, True),
        ("np.cos(t) * t", None, False),
        ("np.cos(omega * (0.5 * t))", 1.0, True),
        ("np.tanh(omega * t)", None, False),  # does not repeat
        ("np.cos(omega * t) + np.cos(1.3 * x * 0 + 2.6180339887 * t)", None, False),  # two rates
        ("np.cos(omega * t) * t", None, False),
        ("np.cos(x * t)", None, False),
        ("0.0 * omega", None, True),  # no forcing: all motions may repeat
    ],
)
def test_the_forcing_is_found_in_the_graph(script, force, rate, forced):
    made = script(
        f"@nsdrill.model\ndef driven(t, x=0.1, v=0.0, *, omega=2.0):\n    return v, {force} - x - 0.1 * v\n",
        "driven_by",
    ).driven
    assert made.reading.repeats is forced
    if rate is not None:
        assert made.model.slowest == pytest.approx(rate)


def test_a_chain_of_runs_goes_on_with_its_forcing(duffing):
    """In two halves, of which the second begins with the final state of the first, phase
    included: as in one run."""
    whole = nsdrill.run(duffing.study(transient=0, observe=10, rtol=1e-10), progress=False)
    half = nsdrill.run(duffing.study(transient=0, observe=5, rtol=1e-10), progress=False)
    start = dict(zip(half.state.values, half.final_state.values.ravel(), strict=True))
    rest = nsdrill.run(duffing.study(transient=0, observe=5, rtol=1e-10, **start), progress=False)
    assert np.abs(rest.final_state - whole.final_state).max() < 1e-7


def test_what_equations_call_by_a_name_is_in_a_trace(duffing):
    trace = nsdrill.simulate(duffing.study(transient=0, observe=5))
    rub = 0.02 * 2 / np.pi * np.arctan(200.0 * trace.v.values)
    assert np.abs(trace.rub.values - rub).max() < 1e-12


REFUSED = {
    "no_default": ("def m(x, v=0.0):\n    return v, -x", "x without a default; allowed: t if"),
    "many": ("def m(*x, v=0.0):\n    return v", "allowed: t if the time is read"),
    "no_states": ("def m(t, *, k=1.0):\n    return ()", "allowed: t if the time is read"),
    "text": ("def m(x=0.0, v='fast'):\n    return v, -x", "v = 'fast'; allowed: a finite number"),
    "nan": ("def m(x=0.0, v=float('nan')):\n    return v, -x", "v = nan; allowed: a finite number"),
    "late_t": ("def m(x=0.0, t=0.0):\n    return t, -x", "t that is not the first argument"),
    "reserved": ("def m(phase=0.0, v=0.0):\n    return v, -phase", "the name phase, which every run has"),
    "clash": ("def m(x=0.0, v=0.0, *, x_max=1.0):\n    return v, -x * x_max", "the name x_max, which a feature"),
    "missing": ("def m(x=0.0, v=0.0):\n    return {'x': v}", "no slope of v; allowed: the slope of each state, x, v"),
    "surplus": ("def m(x=0.0):\n    return {'x': -x, 'y': x}", "a slope of y, which is no state"),
    "few": ("def m(x=0.0, v=0.0):\n    return (v,)", "found 1 values as its slopes"),
    "unit": ("def m(x=number(0.0, 'furlong')):\n    return (-x,)", "the unit 'furlong', which is not known"),
    "range": ("def m(x=number(2.0, high=1.0)):\n    return (-x,)", "a default within its range"),
    "law": (
        "def m(x=0.0, v=0.0):\n"
        "    return v, -nsdrill.friction('a', slip=v, normal=1.0, law='no', smoothing=9.0, static=1.0)",
        "the law 'no'; allowed: hyperbolic",
    ),
    "contact": ("def m(x=0.0):\n    return (-nsdrill.touching('a b', x),)", "a contact with the name 'a b'"),
    "twice": (
        "def m(x=0.0):\n    rub = nsdrill.friction('a', slip=x, normal=1.0, smoothing=9.0, static=1.0)\n"
        "    return (-nsdrill.touching('a', x) - rub,)",
        "two contacts with the name a",
    ),
    "two_walls": (
        "def m(x=0.0, v=0.0):\n    a = nsdrill.touching('a', x - 1.0)\n    b = nsdrill.touching('a', -x - 1.0)\n"
        "    return v, b - a",
        "line 9: .*a second contact with the name 'a'",
    ),
    "two_rubs": (
        "def m(x=0.0, v=0.0):\n    both = [nsdrill.friction('a', slip=one, normal=1.0, smoothing=9.0, static=1.0)\n"
        "            for one in (x, v)]\n    return v, -both[0] - both[1]",
        "line 8: .*a second contact with the name 'a'",
    ),
    "equal": ("def m(x=0.0):\n    return (5.0 if x == 0 else -x,)", "line 8: .*<, <=, >, >=, as abs"),
    "equal_if": (
        "def m(x=0.0):\n    if x != 0:\n        f = -x\n    else:\n        f = 5.0\n    return (f,)",
        "line 8: .*found ==, !=",
    ),
    "in": ("def m(x=0.0):\n    return (5.0 if x in (0.0, 1.0) else -x,)", "line 8: .*or `in` of a value"),
    "one": ("def m(x=0.0, v=0.0):\n    return v", "line 8: m: found one value as its slopes"),
    "array": (
        "def m(x=0.0, v=0.0):\n    return np.array([[0, 1], [-1, 0]]) @ np.array([x, v])",
        "line 8: m: found an array as its slopes; allowed: .*or a tuple of values",
    ),
    "star": ("def m(x=0.0, k=1.0):\n    return {'x': -k * x}", r"no slope of k; .*A parameter stands after \*"),
    "range_of": (
        "def m(x=0.0, *, n=3):\n    return (-sum(x for _ in range(n)),)",
        "line 8: .*whole number is wanted.*allowed: a constant of the module",
    ),
    "int_of": ("def m(x=0.0, *, n=3):\n    return (-x * int(n),)", "line 8: .*allowed: a constant of the module"),
    "jump": (
        "def m(x=0.0, v=0.0):\n    if x < 0.0:\n        v = -0.8 * v\n    return v, -x",
        "a new value of the state v.*A state does not jump: for an impact there is a stiff contact, nsdrill.touching",
    ),
    "store": ("def m(x=0.0):\n    e = [0.0]\n    if x > 1.0:\n        e[0] = 3.0\n    return (-x,)", r"e\[0\] = 3.0"),
    "while": ("def m(x=0.0):\n    while x > 1.0:\n        pass\n    return (-x,)", "condition on a value"),
    "log": (
        "def m(x=1.0):\n    return (-np.log(x),)",
        r"line 8: .*np.log of a value, for which there is a state with the slope dx / x.*on values: .*numpy sin, cos",
    ),
    "table": (
        "def m(x=1.0):\n    return (-np.interp(x, [0.0, 1.0], [0.0, 2.0]),)",
        r"line 8: .*np.interp of a value, for which there is a sum of slopes times np.maximum\(x - corner",
    ),
    "where": ("def m(x=1.0):\n    return (np.where(x > 0.0, -1.0, 1.0),)", "np.where of a value, .*a if x > 0.0"),
    "clip": ("def m(x=1.0):\n    return (-np.clip(x, 0.0, 1.0),)", r"np.clip of a value, .*np.minimum\(np.maximum"),
    "modulo": ("def m(x=1.0):\n    return (-(x % 1.0),)", "found % with a value, for which there is nothing"),
    "floor": ("def m(x=1.0):\n    return (-np.floor(x),)", "np.floor of a value, for which there is nothing, as it"),
    "rounded": ("def m(x=1.0):\n    return (-round(x),)", "a value that is rounded, for which there is nothing, as it"),
    "array_times": ("def m(x=1.0):\n    return (-(np.ones(1) * x)[0],)", "np.multiply of a value and an array"),
    "power_of": ("def m(x=1.0, v=1.0):\n    return v, -(x**v)", "found a value as a power; allowed: whole numbers"),
    "text_number": ("def m(x=number('5 m')):\n    return (-x,)", "line 7: nsdrill.number.*default='5 m'; allowed"),
    "math": ("def m(x=1.0):\n    import math\n    return (-math.sin(x),)", "as by math.sin, for which there is np.sin"),
    "sign": ("def m(x=1.0):\n    return (-np.sign(x),)", "np.sign of a value, for which there is direction.*friction"),
    "hertz": ("def m(x=1.0):\n    return (-max(x, 0.0)**1.5,)", r"found the power 1.5; .*x\*\*1.5 is x \* sqrt"),
    "prints": ("def m(x=1.0):\n    print('here')\n    return (-x,)", "found output, 'here'"),
    "exits": ("def m(x=1.0):\n    raise SystemExit(3)", "SystemExit: 3 while the equations are read"),
    "random": ("def m(x=1.0):\n    return (-x * np.random.default_rng().random(),)", "read anew in every run"),
    "no_function": ("m = 3.0", ""),
    "built_in": ("def torsion(x=1.0):\n    return (-x,)", "a model of nsdrill or of a package has"),
}  # fmt: skip

PLACELESS = {"no_function"}  # of a value, before there is a function


@pytest.mark.parametrize("fault", REFUSED)
def test_a_faulty_model_is_refused_in_words(script, fault, capsys):
    text, words = REFUSED[fault]
    if fault == "no_function":
        text, words = "m = nsdrill.model(3.0)", "found 3.0; allowed: a function"
    else:
        text = f"@nsdrill.model\n{text}\n"
    with pytest.raises(NsdrillError, match=words) as error:
        script(text, f"faulty_{fault}")
    assert "Traceback" not in str(error.value)
    if fault not in PLACELESS:
        assert re.match(rf"\S*faulty_{fault}.py(, line \d+)?: ", str(error.value))  # first the author's own file
    assert scripted("m") is None


def test_a_range_of_a_number_is_that_of_the_study(script):
    made = script(
        "@nsdrill.model\ndef ranged(x=1.0, *, k=number(1.0, low=0.5)):\n    return (-k * x,)\n", "ranged"
    ).ranged
    with pytest.raises(StudyError, match=r"parameters.k: found .*0.1; allowed: .*at least 0.5"):
        made.study(k=0.1)


def test_names_of_a_study_are_those_of_the_function(duffing):
    with pytest.raises(InputError, match=r"found forse, .*allowed: damping, .*Did you mean force\?"):
        duffing.study(forse=0.2)
    with pytest.raises(InputError, match=r"found force=\(0.1, 0.2\); allowed: a number, an axis \(from, to, points\)"):
        duffing.study(force=(0.1, 0.2))
    with pytest.raises(InputError, match=r"parameters.force: found nan; allowed: a number"):
        duffing.study(force=float("nan"))
    with pytest.raises(InputError, match="found no axis"):
        duffing.study(procedure="up-down")
    study = duffing.study(force=(0.1, 0.2, 3), x=0.4, observe=7, peaks=3, procedure="up")
    assert study.axes["parameters.force"].tolist() == pytest.approx([0.1, 0.15, 0.2])
    assert (study.initial.x, study.simulation.observe, study.record.peaks) == (0.4, 7.0, 3)


JUMPING = """@nsdrill.model
def damped(t, h=0.02, w=0.0, *, stiffness=1e4, damping=100.0, mass=0.1, amplitude=1e-3, omega=120.0):
    closed = nsdrill.touching("table", amplitude * np.sin(omega * t) - h)
    push = stiffness * closed
    if closed > 0.0:
        push = push - damping * w
    return w, push / mass - 9.81
"""


def test_exponent_and_branches_are_refused_where_slopes_jump(script):
    made = script(JUMPING, "jumping").damped
    with pytest.raises(StudyError, match=r"record.exponent: found true with slopes that jump at a condition on h"):
        made.study(exponent=True)
    study = made.study(continued={"amplitude": (1e-4, 1e-3), "seeds": [5e-4]})
    with pytest.raises(InputError, match=r"found slopes that jump at a condition on h .*nsdrill.touching.*up-down"):
        nsdrill.continue_branches(study, progress=False)
    smooth = script(JUMPING.replace("damping * w", "damping * closed * w").replace("damped", "soft"), "smooth").soft
    assert smooth.study(exponent=True).record.exponent
    assert nsdrill.run(made.study(transient=0.5, observe=0.5), progress=False).status.item() == 1


def test_numbers_of_friction_may_stand_in_the_text(script):
    """They are integrated implicitly, and give what parameters with these values give."""
    head = (
        "@nsdrill.model\ndef {}(x=0.5, v=0.0, *, belt=0.1, load={}):\n    f = nsdrill.friction('pad', slip=v - belt, "
    )
    tail = "normal={}, static={}, smoothing=2000.0)\n    return v, -x - f\n"
    named, text = (
        script((head + tail).format(name, 1.0, *numbers), name)
        for name, numbers in (("named", ("load", "0.5 + 0.5 * load")), ("text", (1.0, 1.0)))
    )
    found = [
        nsdrill.run(getattr(one, name).study(method="implicit", transient=2, observe=5), progress=False)
        for one, name in ((named, "named"), (text, "text"))
    ]
    assert found[0].x_max.item() == pytest.approx(found[1].x_max.item(), rel=1e-9)
    assert found[1].pad_stuck_fraction.item() > 0.1


def test_branches_are_refused_where_the_time_does_not_repeat(script):
    text = "@nsdrill.model\ndef ramped(t, x=0.1, v=0.0, *, rate=0.1):\n    return v, -x - 0.1 * v + np.tanh(rate * t)\n"
    study = script(text, "ramping").ramped.study(continued={"rate": (0.1, 0.2), "seeds": [0.15]})
    with pytest.raises(InputError, match="read the time otherwise than as a forcing that repeats"):
        nsdrill.continue_branches(study, progress=False)


def test_a_key_without_its_section_is_proposed(duffing):
    with pytest.raises(InputError, match=r"'omega'; allowed: .*parameters.omega.*Did you mean parameters.omega\?"):
        nsdrill.simulate(duffing.study(omega=[1.0, 1.2], transient=0, observe=5), at={"omega": 1.0})


@pytest.mark.parametrize("condition", ["closed > 0.0", "closed"])
def test_a_jump_is_found_however_its_condition_is_written(script, condition):
    text = (
        "@nsdrill.model\ndef wall(x=0.1, v=0.0):\n    closed = nsdrill.touching('end', x)\n"
        f"    return v, -x - 9.0 * closed - ({{}} if {condition} else 0.0)\n"
    )
    assert script(text.format("0.5 * v"), "jumping").wall.model.places_of_jumps()
    assert not script(text.format("closed * v"), "jumping").wall.model.places_of_jumps()


def test_a_jump_is_looked_for_with_the_numbers_of_the_study(script):
    """By default the stop has no preload, with which its force would jump."""
    text = (
        "@nsdrill.model\ndef stop(t, x=0.1, v=0.0, *, preload=0.0, omega=1.0):\n"
        "    closed = nsdrill.touching('end', x)\n    push = 9.0 * closed + (preload if closed > 0.0 else 0.0)\n"
        "    return v, np.cos(omega * t) - x - 0.1 * v - push\n"
    )
    stop = script(text, "preloaded").stop
    assert stop.study(exponent=True).record.exponent
    for values in ({"preload": 0.5}, {"preload": [0.0, 0.2, 0.5]}, {"preload": [0.0, 0.5], "omega": [0.9, 1.0]}):
        with pytest.raises(StudyError, match=r"record.exponent: found true with slopes that jump"):
            stop.study(exponent=True, **values)
    with pytest.raises(StudyError, match=r"record.exponent: found true with slopes that jump"):
        stop.study(exponent=True, uncertain={"parameters.preload": {"uniform": [0.0, 0.5]}, "samples": 4})
    for values, ends in (({"preload": 0.5}, {"omega": (0.9, 1.0)}), ({}, {"preload": (0.0, 0.5)})):
        [(low, high)] = ends.values()
        study = stop.study(continued={**ends, "seeds": [0.5 * (low + high)]}, **values)
        with pytest.raises(InputError, match="found slopes that jump"):
            nsdrill.continue_branches(study, progress=False)


TURNING = """@nsdrill.model
def turning(t, angle=0.1, rate=0.0, *, torque=1.35, omega=0.667, damping=0.5):
    return {"angle": rate, "rate": -np.sin(angle) - damping * rate + torque * np.cos(omega * t)}


@nsdrill.model
def leading(t, lead=0.1, rate=0.0, *, torque=1.35, omega=0.667, damping=0.5):
    angle = lead - omega * t
    return {"lead": rate + omega, "rate": -np.sin(angle) - damping * rate + torque * np.cos(omega * t)}
"""


def test_the_remedy_of_an_angle_that_turns_is_right(script):
    """A pendulum that turns backwards once a period of its forcing: what its angle leads that
    by repeats."""
    module = script(TURNING, "turning")
    wanted = {"continued": {"torque": (1.34, 1.4), "seeds": [1.38]}, "transient": 600}
    with pytest.warns(RunWarning, match=r"seed.*angle may grow without bound.*angle - omega \* t"):
        rest = nsdrill.continue_branches(module.turning.study(**wanted), progress=False)
    assert (rest.unstable > 0).all(), "it swings about its rest, and does not turn"
    found = nsdrill.continue_branches(module.leading.study(**wanted), progress=False)
    assert found.sizes["branch"] == 1


def test_a_slow_beat_does_not_grow_without_bound(script):
    """A van der Pol oscillator beside its locking, whose beat takes hundreds of periods."""
    text = """@nsdrill.model
def pulled(t, x=2.0, v=0.0, *, omega=1.004, force=0.001, growth=0.1):
    return v, growth * (1 - x * x) * v - x + force * np.cos(omega * t)
"""
    wanted = {"continued": {"omega": (1.0, 1.01), "seeds": [1.003, 1.004, 1.005]}, "transient": 100}
    with pytest.raises(InputError, match="found no motion to follow") as refused:
        nsdrill.continue_branches(script(text, "pulled").pulled.study(**wanted), progress=False)
    assert "without bound" not in str(refused.value)


MADE = {
    "a model": ("one", "@nsdrill.model\ndef one(x=1.0):\n    return (-{} * x,)\n"),
    "a drive": (
        "winch",
        "@nsdrill.drive\ndef winch(lag, drive_speed, set_speed):\n    return -{}e3 * (drive_speed - set_speed)\n",
    ),
    "a law": (
        "rust",
        "from nsdrill.equations.library import direction\n\n\n@nsdrill.law(fall=lambda n: 2 * n.rise)\n"
        "def rust(v, n):\n    return direction(n.smoothing * v) * (n.dynamic + n.rise / (1 + {} * v * v))\n",
    ),
    "a feature": (
        "haste",
        '@nsdrill.feature("torsion", "haste", "rad s-1")\ndef haste(bit_speed):\n    return {} * bit_speed\n',
    ),
    "a picture": (
        "speeds",
        '@nsdrill.picture("speeds", of="line")\ndef speeds(axes, data, shown):\n    axes.plot([{}])\n',
    ),
    "a pair": (
        "heun",
        'nsdrill.pair("heun", a=[[1], [0.5, 0.5]], b=[0.5, 0.5, 0], embedded=[1 / {}, 1 - 1 / {}, 0], order=2)\n',
    ),
}


@pytest.fixture
def no_pictures_and_pairs(monkeypatch):
    monkeypatch.setattr(picture_kinds, "_made", {})
    monkeypatch.setattr(own_pairs, "_known", {})
    yield
    picture_kinds.all_kinds.cache_clear()
    registry.forget_known()


@pytest.mark.usefixtures("no_pictures_and_pairs")
@pytest.mark.parametrize("what", MADE)
def test_two_of_one_name_are_refused(script, what):
    """In two files, in two places of one file, and in a loop; not where a file is executed
    again, also with other lines above."""
    name, text = MADE[what]
    first, second = text.replace("{}", "3"), text.replace("{}", "4")
    module = script(first, "again")
    importlib.reload(module)
    Path(module.__file__).write_text(f"{HEAD}\n{second}")
    importlib.invalidate_caches()
    module = importlib.reload(module)
    assert what != "a model" or module.one(x=1.0) == (-4.0,)
    found = rf"line \d+: found {what} with the name {name}, as in "
    with pytest.raises(InputError, match=rf"other\.py, {found}.*again\.py, line \d+; allowed: one of each name"):
        script(first, "other")
    with pytest.raises(InputError, match=rf"again\.py, {found}line \d+; allowed"):
        script(f"{first}\n\n{second}", "again")
    looped = "for _ in range(2):\n" + "".join(f"    {line}\n" for line in first.splitlines())
    with pytest.raises(InputError, match=rf"again\.py, {found}line \d+; allowed"):
        script(looped, "again")


def test_a_changed_global_is_read_anew(script):
    """As a notebook changes it: the next study has the new number."""
    module = script(
        "MU = 0.0\n\n\n@nsdrill.model\ndef cell(x=0.1, v=0.0, *, k=1.0):\n    return v, MU - k * x - v\n", "cells"
    )
    study = {"transient": 40, "observe": 5}
    before = nsdrill.run(module.cell.study(**study), progress=False).x_mean.item()
    module.MU = 0.5
    assert before == pytest.approx(0.0, abs=1e-4)
    assert nsdrill.run(module.cell.study(**study), progress=False).x_mean.item() == pytest.approx(0.5, abs=1e-4)


def test_the_digest_is_that_of_what_is_computed(script):
    text = "@nsdrill.model\ndef one(x=1.0, *, k=2.0):\n    return (-3.0 * k * x,)\n"

    def digest(changed, name):
        made = script(changed, name).one
        Path(made.function.__code__.co_filename).unlink()  # another file of one name comes next
        return made.reading.digest

    first = digest(text, "digest_1")
    assert digest(text.replace("    return", "    # a comment\n    return"), "digest_2") == first
    for number, (old, new) in enumerate({"3.0": "3.5", "k=2.0": "k=2.5", "x=1.0": "x=number(1.0, 'm')"}.items()):
        assert digest(text.replace(old, new), f"digest_{number + 3}") != first


def test_names_mean_what_they_mean_in_each_model(duffing):
    """The main model has a variable x, too, in metres."""
    main = nsdrill.load_study({"operation.depth": "1000 m", "simulation": {"transient": "1 s", "observe": "2 s"}})
    for _ in range(2):
        trace = nsdrill.simulate(duffing.study(transient=0, observe=2))
        assert (trace.x.attrs["units"], trace.x.attrs["long_name"]) == ("1", "x")
        assert nsdrill.simulate(main).x.attrs["units"] == "m"
    with registry.showing({"model": "duffing"}):
        assert (registry.IN_TRACE["x"].units, find("x").units) == ("1", "")
    assert (registry.IN_TRACE["x"].units, find("x").units) == ("m", "m")


def test_a_law_of_a_script(script):
    module = script(
        "from nsdrill.equations.library import direction, expm1\nfrom nsdrill.testing import check_law\n\n\n"
        "@nsdrill.law(fall=lambda n: 0.8577638849607068 * n.rise * n.decay)\n"
        "def bell(v, n):\n"
        "    falling = 1.0 + expm1(-(n.decay * v) * (n.decay * v))\n"
        "    return direction(n.smoothing * v) * (n.dynamic + n.rise * falling)\n\n\n"
        "@nsdrill.model\n"
        "def belled(x=0.0, v=0.1, *, belt=0.2, load=10.0, steep=500.0):\n"
        "    rub = nsdrill.friction('belt', slip=v - belt, normal=load, law='bell', static=0.4, dynamic=0.25,\n"
        "                           decay=10.0, smoothing=steep)\n"
        "    return v, -100.0 * x - 0.1 * v - rub\n",
        "laws",
    )
    nsdrill.testing.check_law("bell")
    report = nsdrill.testing.check_model(module.belled, "simulation: {transient: 0 s, observe: 5 s}")
    assert not report.failed


def test_a_wrong_bound_of_a_law_is_found(script, monkeypatch):
    """Also by the check, as one that is wrong at other numbers only is taken."""
    from nsdrill.testing import check_law

    monkeypatch.setattr("nsdrill.script.physics._check", lambda *given: None)
    script(
        "from nsdrill.equations.library import direction, expm1\n\n\n"
        "@nsdrill.law(fall=lambda n: 0.1 * n.rise * n.decay)\n"
        "def wrong(v, n):\n"
        "    falling = 1.0 + expm1(-(n.decay * v) * (n.decay * v))\n"
        "    return direction(n.smoothing * v) * (n.dynamic + n.rise * falling)\n",
        "wrong_law",
    )
    with pytest.raises(AssertionError, match="FAIL  fall above its bound"):
        check_law("wrong")


@pytest.mark.parametrize("model", ["torsion", "christoforou_yigit", "segments", "beam"])
def test_each_derivation_of_the_models_is_checked_against_another(model):
    from nsdrill.testing import check_model

    check_model(model, "simulation: {transient: 0 s, observe: 5 s}")


def test_a_number_that_nothing_reads_is_found(script):
    from nsdrill.testing import check_model

    made = script(
        "@nsdrill.model\ndef idle(x=1.0, v=0.0, *, k=1.0, spare=2.0, far=1e3, stiff=5.0):\n"
        "    return v, -k * x - stiff * nsdrill.touching('wall', x - far)\n",
        "idles",
    ).idle
    with pytest.raises(AssertionError, match=r"FAIL  numbers that nothing reads .* allowed 0e\+00  parameters.spare\n"):
        check_model(made)  # those of a contact that no trial state reaches are read


def test_starts_and_uncertain_numbers(duffing):
    """An ensemble, and samples of a number, are those of any model."""
    several = nsdrill.run(duffing.study(ensemble=4, transient=20, observe=20, dry=0.0), progress=False)
    assert several.sizes["start"] == 4
    assert len(np.unique(several.x_mean.values.round(6))) > 1


def test_declaring_and_trying_are_quick():
    """A model is declared in less than 20 ms and tried in less than 0.3 s, on a processor
    that others do not use; the least of several times is taken."""
    import time

    from nsdrill.script.declared_model import Declared

    function = example("three_inertias").function
    times = []
    for _ in range(5):
        begun = time.process_time()
        made = Declared(function, "")
        declared = time.process_time()
        assert made.model.scale
        times.append((declared - begun, time.process_time() - declared))
    declared, tried = np.min(times, axis=0)
    assert declared < 0.04  # twice, for slower processors
    assert tried < 0.6


def test_a_function_that_makes_functions_makes_models(script):
    """Each has a number of its own from around and a name that it is given: of x'' = -(k + i) x from 1 at rest the
    greatest speed is the root of k + i."""
    text = """
def make(number):
    def osc(x=1.0, v=0.0, *, k=4.0):
        return v, -(k + number) * x

    osc.__name__ = f"made{number}"
    return nsdrill.model(osc)
"""
    make = script(text, "factory").make
    for k in range(3):
        data = nsdrill.run(make(k).study(transient=0, observe=4), progress=False)
        assert data.v_max.item() == pytest.approx(np.sqrt(4.0 + k), rel=1e-5)


@pytest.mark.parametrize("what", ["smoothing", "decay"])
def test_the_direction_of_friction_and_its_fall_do_not_follow_states(script, what):
    """Each is refused with its line; what the law exponential falls by may."""
    text = (
        "@nsdrill.model\ndef rubs(x=1.0, v=0.0, *, belt=0.5):\n    return v, -4.0 * x - nsdrill.friction(\n"
        "        'c', slip=v - belt, normal=1.0, static=0.3, dynamic=0.1, {}\n    )\n"
    )
    numbers = {"smoothing": "50.0", "decay": "2.0"}
    given = ", ".join(f"{name}={value}{' + x * x' * (name == what)}" for name, value in numbers.items())
    with pytest.raises(NsdrillError, match=rf"rubbing.py, line \d+: rubs: .*found a {what} of .*friction"):
        script(text.format(given), "rubbing")
    if what == "decay":
        made = script(text.format(f"{given}, law='exponential'"), "rubbing").rubs
        assert np.isfinite(nsdrill.run(made.study(transient=0, observe=2), progress=False).x_max.item())


@pytest.mark.parametrize("more", [{}, {"spare": [1.0, 2.0]}, {"uncertain": {"spare": (1.0, 2.0), "samples": 2}}])
def test_numbers_that_nothing_reads_are_told_of(script, more):
    made = script(
        "@nsdrill.model\ndef idle(t, x=0.1, v=0.0, *, k=1.0, omega=1.0, spare=2.0, traced=1.0):\n"
        "    seen = traced * x\n    return v, np.cos(omega * t) - k * x\n",
        "idle",
    ).idle
    said = "Unread: nothing that idle computes reads spare: no value"
    assert any(warning.startswith(said) for warning in nsdrill.check(made.study(**more)).warnings)
    with pytest.warns(RunWarning, match=said):
        nsdrill.run(made.study(transient=1, observe=1, **more), progress=False)


def test_of_numbers_that_are_read_nothing_is_said(duffing, recwarn):
    nsdrill.run(duffing.study(transient=1, observe=1), progress=False)
    assert not [one for one in recwarn if "Unread" in str(one.message)]


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("f = 1.0 if type(x) is float else 2.0", "type.x.: found `type`, which Python decides by the object"),
        ("f = 2.0 if hasattr(x, 'graph') else 1.0", "found `hasattr` of what may be a value, which Python decides"),
        (
            "f = nsdrill.friction('b', slip=v, normal=1.0, static=1.0, decay=2.0, smoothing=9.0)",
            "found decay without dynamic, so that nothing falls",
        ),
    ],
)
def test_equations_that_are_others_with_numbers_are_refused(script, line, words):
    text = f"@nsdrill.model\ndef asks(x=0.1, v=0.0, *, k=1.0):\n    {line}\n    return v, -k * x - f\n"
    with pytest.raises(NsdrillError, match=rf"asking.py, line \d+: asks: .*{words}"):
        script(text, "asking")

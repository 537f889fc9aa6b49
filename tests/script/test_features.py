"""What a script measures of a model of nsdrill: against dense traces, in files, in traces."""

import numpy as np
import pytest

import nsdrill
import nsdrill.testing
from nsdrill.store import layout

from .conftest import command

POWER = """
@nsdrill.feature("{model}", "bit_power", "W", "power of the bit")
def bit_power(bit_speed, bit_torque):
    return bit_speed * bit_torque
"""
MODELS = {
    "torsion": {},
    "christoforou_yigit": {},
    "segments": {"segments": {"pipe": 2, "collar": 2}},
    "regenerative": {},
    "beam": {"beam": {"modes": 2}},
}
SHORT = {"transient": "5 s", "observe": "10 s"}


@pytest.mark.parametrize("model", MODELS)
def test_a_feature_of_a_model_is_that_of_its_dense_trace(script, model):
    before = nsdrill.run({"model": model, **MODELS[model], "simulation": SHORT}, progress=False)
    script(POWER.format(model=model), "measuring")
    study = {"model": model, **MODELS[model], "simulation": SHORT}
    data = nsdrill.run(study, progress=False)
    assert np.array_equal(data.final_state, before.final_state)
    assert data.attrs["model_digest"] != before.attrs["model_digest"]
    assert data.bit_power_max.attrs["units"] == "W"
    trace = nsdrill.simulate(study, duration="15 s", sample="1 ms")
    power = trace.bit_power.sel(time=slice(5.0, 15.0)).values
    size = np.ptp(power)
    assert data.bit_power_max.item() == pytest.approx(power.max(), abs=5e-3 * size)
    assert data.bit_power_min.item() == pytest.approx(power.min(), abs=5e-3 * size)
    assert data.bit_power_mean.item() == pytest.approx(np.trapezoid(power, dx=1e-3) / 10.0, abs=5e-3 * size)
    assert np.array_equal(trace.bit_power, trace.bit_speed * trace.bit_torque)


def test_a_feature_may_read_what_only_some_strings_have(script):
    """The rate of the interference is that of a lobed rock; on another one it is left out, with a warning."""
    script(
        '@nsdrill.feature("segments", "closed", "m s-1", least=True)\ndef closed(closing):\n    return closing\n',
        "some",
    )
    study = {"model": "segments", **MODELS["segments"], "simulation": {"transient": "1 s", "observe": "2 s"}}
    assert np.isfinite(nsdrill.run(study, progress=False).closed_min.item())
    with pytest.warns(nsdrill.RunWarning, match="feature closed: not measured of this string, which has no closing"):
        other = nsdrill.run({**study, "bit": {"rock": {"law": "regenerative"}}}, progress=False)
    assert np.isnan(other.closed_min.item())
    assert np.isfinite(other.bit_speed_max.item())


def test_a_feature_of_drives_leaves_the_string_without_one_as_it_is(script):
    """An ideal drive has no speed of its own; where one has, the feature is that of the trace."""
    study = {"model": "torsion", "simulation": {"transient": "1 s", "observe": "5 s"}}
    before = nsdrill.run(study, progress=False)
    script(
        '@nsdrill.feature("torsion", "behind", "rad/s")\n'
        "def behind(bit_speed, drive_speed):\n    return bit_speed - drive_speed\n",
        "drives",
    )
    with pytest.warns(nsdrill.RunWarning, match="behind: not measured of this string, which has no drive_speed"):
        ideal = nsdrill.run(study, progress=False)
    assert np.array_equal(ideal.final_state, before.final_state)
    assert np.isnan(ideal.behind_max.item())
    driven = {**study, "drive": {"kind": "soft_torque"}}
    trace = nsdrill.simulate(driven, duration="6 s", sample="1 ms").sel(time=slice(1.0, 6.0))
    data = nsdrill.run(driven, progress=False)
    assert data.behind_max.item() == pytest.approx((trace.bit_speed - trace.drive_speed).max().item(), abs=1e-3)


BESIDE = """
@nsdrill.feature("torsion", "inverse", greatest=True)
def inverse(bit_speed):
    return 1 / (bit_speed - 3.0)


@nsdrill.feature("torsion", "root", mean=True)
def root(bit_speed):
    return np.sqrt(bit_speed - 0.5)


@nsdrill.feature("torsion", "jump")
def jump(bit_speed):
    return 5.0 if bit_speed > 3.0 else -5.0


@nsdrill.feature("torsion", "bend")
def bend(bit_speed):
    return np.sqrt(abs(bit_speed - 3.0))


@nsdrill.feature("torsion", "narrow")
def narrow(bit_speed):
    return 1 / (0.001 + (bit_speed - 3.0) ** 2)
"""


def test_a_pole_and_what_is_no_number_are_told(script, tmp_path, monkeypatch):
    """Of a stick-slip whose speed passes 3 rad/s and rests; a jump, a bend and a narrow peak, of 1000, are followed."""
    monkeypatch.chdir(tmp_path)
    study = (
        "model: torsion\noperation: {rotary_speed: 3 rad/s, wob: 30 kN}\nsimulation: {transient: 20 s, observe: 20 s}\n"
    )
    (tmp_path / "study.yaml").write_text(study)
    script(BESIDE, "poles")
    with pytest.warns(nsdrill.RunWarning, match="TOO FAST for the steps: inverse in 1 of 1 run, root in 1 of 1 run"):
        data = nsdrill.run(tmp_path / "study.yaml", progress=False)
    assert data.inverse_outrun.item() > 0.9
    assert data.root_outrun.item() == 1.0
    assert max(data[f"{name}_outrun"].item() for name in ("jump", "bend", "narrow")) < 0.05
    assert data.narrow_max.item() == pytest.approx(1000.0, rel=1e-4)
    (tmp_path / "poles.py").write_text("import numpy as np\nimport nsdrill\n" + BESIDE, encoding="utf-8")
    for line in (("run", "study.yaml", "-o", "r.h5"), ("show", "r.h5")):
        told = " ".join("".join(command(tmp_path, *line, "--with", "poles.py")).split())
        assert "for the steps: inverse in 1 of 1 run, root in 1 of 1 run (1 of them with NaN: it is no number" in told


FAULTY = {
    '("torsion", "power")\ndef f(speed):\n    return speed': "found the argument speed; allowed: states, parameters",
    '("torsion", "bit_speed")\ndef f(twist):\n    return twist': "found the name bit_speed, which torsion has",
    '("torsion", "stick_slip", mean=True)\ndef f(twist):\n    return 1.0': "found 1.0 as its value",
    '("torsion", "power", "kW")\ndef f(twist):\n    return twist': "feature power: found the unit 'kW', of which one",
    '("torsion", "power", scale=0.0)\ndef f(twist):\n    return twist': "feature power: found scale=0.0; allowed",
    '("torsion", "power", "N")\ndef f(bit_speed):\n    return bit_speed': "found a value in 1/s; allowed: in N, as its",
    '("torsions", "power")\ndef f(twist):\n    return twist': "found the model torsions; allowed: christoforou_yigit",
}  # fmt: skip


@pytest.mark.parametrize("text", FAULTY)
def test_what_cannot_be_measured_is_refused_with_its_line(script, text):
    with pytest.raises(nsdrill.NsdrillError) as raised:
        script(f"@nsdrill.feature{text}\n", "measuring")
    assert FAULTY[text] in str(raised.value)
    assert "measuring.py, line 6" in str(raised.value)


@pytest.mark.parametrize("model", MODELS)
def test_what_is_added_has_one_dimension(script, model):
    sums = POWER.format(model=model).replace("bit_speed * bit_torque", "bit_speed + bit_torque")
    with pytest.raises(nsdrill.NsdrillError, match=r"measuring\.py, line 9: .*found a sum of values in 1/s and in N m"):
        script(sums, "measuring")


def test_a_model_of_a_script_has_its_own(script):
    text = (
        "@nsdrill.model\ndef spring(x=1.0, v=0.0):\n    return v, -x\n\n\n"
        "@nsdrill.feature('spring', 'energy')\ndef energy(x):\n    return x * x\n"
    )
    with pytest.raises(nsdrill.InputError, match=r"found the model spring; allowed: @spring\.feature above"):
        script(text, "measuring")


def test_a_feature_of_constants_under_a_condition(script):
    """Its share of the time is that of the trace: nothing else is read than the condition."""
    script(
        'import nsdrill\n\n\n@nsdrill.feature("torsion", "heavy", "1", "torque above 2 kN m", mean=True)\n'
        "def heavy(bit_torque):\n    return 1.0 if bit_torque > 2000 else 0.0\n",
        "conditions",
    )
    study = {"model": "torsion", "operation": {"wob": "40 kN", "rotary_speed": "4 rad/s"}}
    study |= {"simulation": {"transient": "20 s", "observe": "20 s"}}
    share = float(nsdrill.run(study, progress=False).heavy_mean.item())
    trace = nsdrill.simulate(study)
    observed = trace.time.values > 20.0
    assert share == pytest.approx((trace.bit_torque.values[observed] > 2000).mean(), abs=2e-3)
    assert 0.01 < share < 0.9


def test_a_trace_of_before_the_script_is_read_without_its_feature(script, tmp_path):
    study = {"model": "torsion", "simulation": SHORT}
    before = nsdrill.simulate(study, duration="5 s")
    nsdrill.save(before, tmp_path / "before.h5")
    script(POWER.format(model="torsion"), "since")
    read = nsdrill.open_results(tmp_path / "before.h5")
    assert "bit_power" not in read
    assert np.array_equal(read.bit_speed, before.bit_speed)
    nsdrill.save(read, tmp_path / "again.h5")
    assert "bit_power" not in nsdrill.open_results(tmp_path / "again.h5")
    assert "bit_power" in nsdrill.simulate(study, duration="5 s")


def test_a_file_says_what_it_has_of_a_script_that_is_not_given(tmp_path, monkeypatch):
    (tmp_path / "f.py").write_text(f"import nsdrill\n{POWER.format(model='torsion')}")
    (tmp_path / "s.yaml").write_text("model: torsion\nsimulation: {transient: 5 s, observe: 10 s}\n")
    command(tmp_path, "run", "s.yaml", "-o", "s.h5", "--with", "f.py")
    command(tmp_path, "simulate", "s.yaml", "-o", "t.h5", "--with", "f.py")
    for words in ("show s.h5", "show t.h5", "export s.h5 -o s.csv", "export t.h5 -o t.csv"):
        monkeypatch.setattr(layout, "_told_of", set())  # each is a process of its own
        shown, said = command(tmp_path, *words.split())
        assert "bit_power" not in shown
        assert said.count("has variables that the model torsion does not have here, and that are left out") == 1
        assert "bit_power" in said
        assert "--with FILE" in said
    for file in ("s.h5", "t.h5"):
        shown, said = command(tmp_path, "show", file, "--with", "f.py")
        assert "left out" not in said
        assert "bit_power" in shown
    command(tmp_path, "run", "s.yaml", "-o", "plain.h5")
    assert "left out" not in command(tmp_path, "show", "plain.h5")[1]


def test_a_feature_in_other_words_relabels_no_old_numbers(script, tmp_path):
    """Its file says what its numbers are and in which units; a trace, and results in memory, too."""
    study = {"model": "torsion", "simulation": SHORT}
    script(POWER.format(model="torsion"), "power")
    data, trace = nsdrill.run(study, progress=False), nsdrill.simulate(study, duration="5 s")
    for name, one in {"r.h5": data, "t.h5": trace}.items():
        nsdrill.save(one, tmp_path / name)
    other = POWER.format(model="torsion").replace('"W", "power', '"N m", "torque')
    script(other.replace("bit_speed, bit_torque", "bit_torque").replace("bit_speed * ", ""), "power")
    for ask in (
        lambda: nsdrill.open_results(tmp_path / "r.h5"),
        lambda: nsdrill.show(tmp_path / "r.h5"),
        lambda: nsdrill.show(tmp_path / "t.h5"),
        lambda: nsdrill.show(data),
        lambda: nsdrill.plot(trace),
    ):
        with pytest.raises(nsdrill.FileError, match=r"CHANGED SINCE THE RUNS: bit_power.*power of the bit \[W\] there"):
            ask()
    script(POWER.format(model="torsion"), "power")
    nsdrill.show(data.drop_attrs().assign_attrs(data.attrs))  # as arithmetic leaves the variables
    assert nsdrill.open_results(tmp_path / "r.h5").bit_power_max.attrs["units"] == "W"


TONE = """
@nsdrill.model
def swung(t, x=1.0, v=0.0, *, k=0.01, c=0.02, fast=nsdrill.number(1600.0, "1/m")):
    return {"x": v, "v": -k * x - c * v + 0.01 * np.cos(0.1 * t)}


@swung.feature("tone", "", "square of a tone of the position")
def tone(x, fast):
    return np.sin(fast * x) ** 2


@swung.feature("kinked", "", "what is positive of the position")
def kinked(x):
    return max(x, 0.0)


@swung.feature("jumped", "", "its sign")
def jumped(x):
    return 1.0 if x > 0 else -1.0
"""


def test_what_varies_faster_than_the_steps_is_told(script, tmp_path, monkeypatch):
    """A square of a sine that goes through thousands of periods in a step has extremes and a mean of
    samples, which is said, everywhere; kinks and jumps of a quantity are followed."""
    monkeypatch.chdir(tmp_path)
    folder = tmp_path / "tone.py"
    folder.write_text("import numpy as np\nimport nsdrill\n" + TONE, encoding="utf-8")
    (tmp_path / "study.yaml").write_text(
        "model: swung\nsweep: {parameters.fast: [0.5 1/m, 16000 1/m]}\n"
        "simulation: {transient: 1000 s, observe: 1000 s}\n",
        encoding="utf-8",
    )
    script(TONE, "tone")
    data = nsdrill.run("study.yaml", progress=False)
    slow, fast = data.tone_max.values
    assert slow == pytest.approx(1.0, abs=5e-3)
    assert 0.9 < fast <= 1.0
    assert data.tone_outrun.values[0] < 0.01
    assert data.tone_outrun.values[1] > 0.5
    assert np.all(data.kinked_outrun == 0.0)
    assert np.all(data.jumped_outrun == 0.0)
    said = "tone in 1 of 2 runs. Within a step the motion is followed and such a quantity is not"
    for line in (("run", "study.yaml", "-o", "r.h5"), ("show", "r.h5")):
        told = " ".join("".join(command(tmp_path, *line, "--with", "tone.py")).split())
        assert said in told
        assert "kinked in" not in told
    finer = nsdrill.run(
        "study.yaml", set={"simulation.rtol": 1e-12, "parameters.fast": "300 1/m", "sweep": None}, progress=False
    )
    coarser = nsdrill.run(
        "study.yaml", set={"simulation.rtol": 1e-4, "parameters.fast": "300 1/m", "sweep": None}, progress=False
    )
    assert finer.tone_outrun.item() < 0.05 < 0.25 < coarser.tone_outrun.item()


NARROW = """
@nsdrill.model
def forced(t, x=0.1, v=0.0, *, damping=0.2, force=0.3, omega=1.2, level=0.598, width=1e-3):
    tone = np.sin(100 * t)
    return {"x": v, "v": force * np.cos(omega * t) - damping * v - x}


@forced.feature("above", "1", "whether it is above a level", mean=True)
def above(x, level):
    return 1.0 if x > level else 0.0


@forced.feature("wave", "1", "a wave at one place")
def wave(x, width):
    return np.exp(-np.square((x - 0.3) / width))


@forced.feature("both", "1", "a position and a wave")
def both(x):
    return x + np.exp(-np.square(300 * (x - 0.3)))


@forced.feature("rippled", "1", "a position and a ripple")
def rippled(x, tone):
    return 100 * x + tone


@forced.feature("near", "1", "whether it is near a place")
def near(x):
    return 1.0 if abs(x - 0.3) < 1e-3 else 0.0
"""


def test_what_changes_within_a_step_is_that_of_a_dense_solution(script):
    """Shares of time of conditions and the extremes of narrow waves, against SciPy, in runs of some
    20 steps a period: of none an end of a step shows the size."""
    from scipy.integrate import solve_ivp

    script(NARROW, "narrow")
    study = {"model": "forced", "simulation": {"transient": "100 s", "observe": "60 s"}}
    data = nsdrill.run(study, progress=False)
    found = solve_ivp(
        lambda t, y: [y[1], 0.3 * np.cos(1.2 * t) - 0.2 * y[1] - y[0]],
        (0, 160), [0.1, 0.0], method="DOP853", rtol=1e-11, atol=1e-12, dense_output=True,
    )  # fmt: skip
    t = np.linspace(100.0, 160.0, 1_000_001)
    x = found.sol(t)[0]
    wave, rippled = np.exp(-((1e3 * (x - 0.3)) ** 2)), 100 * x + np.sin(100 * t)
    both = x + np.exp(-((300 * (x - 0.3)) ** 2))
    assert data.above_mean.item() == pytest.approx(np.mean(x > 0.598), abs=2e-5)  # 0.0145
    assert data.near_mean.item() == pytest.approx(np.mean(np.abs(x - 0.3) < 1e-3), abs=2e-5)  # 0.0012
    assert data.near_max.item() == 1.0
    for name, values in {"wave": wave, "both": both, "rippled": rippled}.items():
        size = np.ptp(values)
        assert data[f"{name}_max"].item() == pytest.approx(values.max(), abs=1e-3 * size)
        assert data[f"{name}_min"].item() == pytest.approx(values.min(), abs=1e-3 * size)
        assert data[f"{name}_mean"].item() == pytest.approx(values.mean(), abs=1e-4 * size)
        assert data[f"{name}_outrun"].item() < 0.25


def test_a_model_with_a_condition_as_a_feature_is_checked(script):
    """The rate of a condition is the number 0, which reads no row."""
    script(NARROW, "narrow")
    report = nsdrill.testing.check_model("forced")
    assert "rate of the channel above" in str(report)


def test_a_comparison_is_measured_as_1_or_0(script):
    text = '@nsdrill.feature("torsion", "slow")\ndef slow(bit_speed):\n    return bit_speed < 1.0\n'
    script(text, "compares")
    data = nsdrill.run({"model": "torsion", "simulation": {"transient": "5 s", "observe": "30 s"}}, progress=False)
    assert (data.slow_min.item(), data.slow_max.item()) == (0.0, 1.0)


@pytest.mark.parametrize(
    "text",
    [
        '@nsdrill.feature("torsion", "f")\ndef f(bit_speed):\n    return bit_speed * random.random()\n',
        "@nsdrill.law(fall=lambda n: 0)\ndef f(v, n):\n    return random.random() * np.tanh(n.smoothing * v)\n",
    ],
)
def test_what_is_another_one_each_time_is_refused(script, text):
    with pytest.raises(nsdrill.NsdrillError, match=r"timed.py, line 11: f: random.random\(\): found what is read anew"):
        script(f"import random\n\n\n{text}", "timed")


BEFORE, AFTER = POWER.format(model="torsion"), POWER.format(model="torsion").replace("bit_speed *", "2 * bit_speed *")


def test_a_feature_whose_body_changed_is_told_of(script):
    """Its numbers in an old file are those of the function as it was."""
    module = script("K = [1.0]\n" + BEFORE.replace("bit_speed *", "K[0] * bit_speed *"), "changing")
    data = nsdrill.run({"model": "torsion", "simulation": SHORT}, progress=False)
    assert "bit_power" in nsdrill.show(data)
    module.K[0] = 2.0
    for ask in (nsdrill.show, nsdrill.plot):
        with pytest.raises(nsdrill.NsdrillError, match="CHANGED SINCE THE RUNS: made with the feature bit_power"):
            ask(data)
    module.K[0] = 1.0
    assert "bit_power" in nsdrill.show(data)


def test_a_file_tells_of_it_too(tmp_path):
    (tmp_path / "s.yaml").write_text("model: torsion\nsimulation: {transient: 2 s, observe: 2 s}\n", encoding="utf-8")
    (tmp_path / "f.py").write_text("import nsdrill\n" + BEFORE, encoding="utf-8")
    command(tmp_path, "run", "s.yaml", "-o", "r.h5", "--with", "f.py")
    assert "bit_power" in command(tmp_path, "show", "r.h5", "--with", "f.py")[0]
    (tmp_path / "f.py").write_text("import nsdrill\n" + AFTER, encoding="utf-8")
    _, told = command(tmp_path, "show", "r.h5", "--with", "f.py", code=2)
    assert "CHANGED SINCE THE RUNS: made with the feature bit_power of the script f.py" in " ".join(told.split())

"""A value that a function of a script reads from around it may be changed after the decorator:
what is run next has the new one, and says so in its digests."""

import pytest

import nsdrill

# How a value may be held: what stands before the function, how it reads the value, and a change
# from 1 to 3.
WAYS = {
    "global": ("C = 1.0", "C", "mod.C = 3.0"),
    "list": ("C = [1.0]", "C[0]", "mod.C[0] = 3.0"),
    "dict": ("C = {'a': 1.0}", "C['a']", "mod.C['a'] = 3.0"),
    "array": ("C = np.array([1.0])", "C[0]", "mod.C[0] = 3.0"),
    "class": ("class C:\n    a = 1.0", "C.a", "mod.C.a = 3.0"),
    "closure": (
        "def made():\n    c = [1.0]\n    def h():\n        return c[0]\n    return h, c\nh, c = made()",
        "h()",
        "mod.c[0] = 3.0",
    ),
    "default": ("def h(c=1.0):\n    return c", "h()", "mod.h.__defaults__ = (3.0,)"),
    "attribute": ("def h():\n    return h.c\nh.c = 1.0", "h()", "mod.h.c = 3.0"),
    "partial": (
        "import functools\ndef g(c):\n    return c\nh = functools.partial(g, 1.0)",
        "h()",
        "mod.h = mod.functools.partial(mod.g, 3.0)",
    ),
}
MODEL = "@nsdrill.model\ndef held(t, x=0.1, v=0.0, *, k=1.0):\n    return v, -k * x - 0.1 * v + {c}\n"
DRIVE = (
    "@nsdrill.drive\ndef held(lag, drive_speed, set_speed, *, soft=900.0, brake=1500.0):\n"
    "    return -soft * lag - brake * (drive_speed - set_speed) * {c}\n"
)
LAW = (
    "@nsdrill.law(fall=lambda n: 3.0 * n.rise * n.decay)\ndef held(v, n):\n"
    "    return np.tanh(n.smoothing * v) * (n.rise / (1.0 + n.decay * abs(v)) + n.dynamic) * {c}\n"
)
FEATURE = '@nsdrill.feature("torsion", "held", "rad/s", mean=True)\ndef held(bit_speed):\n    return bit_speed * {c}\n'
TORSION = {"model": "torsion", "simulation": {"transient": "0 s", "observe": "10 s"}}
OF_MODEL = {"model": "held", "simulation": {"transient": "0 s", "observe": "5 s"}}
KINDS = {
    "model": (MODEL, OF_MODEL, "x_max"),
    "drive": (DRIVE, {**TORSION, "drive": {"kind": "held"}}, "bit_speed_max"),
    "law": (LAW, {**TORSION, "bit": {"friction": {"law": "held"}}}, "bit_speed_min"),
    "feature": (FEATURE, TORSION, "held_mean"),
}


def values(study, name):
    data = nsdrill.run(study, progress=False)
    return data[name].item(), (data.attrs["model_digest"], data.attrs.get("used_scripts"))


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("kind", KINDS)
def test_a_value_that_is_changed_is_the_one_that_runs(script, kind, way):
    (text, study, name), (around, read, change) = KINDS[kind], WAYS[way]
    mod = script(f"{around}\n\n\n{text.format(c=read)}", f"held_{kind}_{way}")
    first, digests = values(study, name)
    exec(change, {"mod": mod})
    second, others = values(study, name)
    assert second != first
    assert others != digests
    assert values(study, name) == (second, others)  # and nothing else changes it


def test_a_study_that_was_made_before_runs_with_the_new_value(script):
    mod = script(f"C = [1.0]\n\n\n{MODEL.format(c='C[0]')}", "held_early")
    study = mod.held.study(transient=0, observe=5)
    first = values(study, "x_max")
    mod.C[0] = 3.0
    assert values(study, "x_max") == values(mod.held.study(transient=0, observe=5), "x_max") != first


def test_the_law_of_a_model_is_read_again_with_it(script):
    text = LAW.replace("def held", "def sliding").format(c="C[0]")
    text += (
        "@nsdrill.model\ndef held(t, x=0.1, v=0.3, *, k=1.0):\n    return v, -k * x - nsdrill.friction("
        "'belt', slip=v, normal=0.1, law='sliding', static=0.4, dynamic=0.3, decay=1.0, smoothing=50.0)\n"
    )
    mod = script(f"C = [1.0]\n\n\n{text}", "held_law_of_model")
    first = values(OF_MODEL, "v_min")
    mod.C[0] = 3.0
    second = values(OF_MODEL, "v_min")
    assert second[0] > first[0]
    assert second[1] != first[1]


def test_a_file_is_refused_that_was_made_with_another_value(script, tmp_path):
    mod = script(f"C = [1.0]\n\n\n{MODEL.format(c='C[0]')}", "held_file")
    nsdrill.run(OF_MODEL, tmp_path / "out.h5", progress=False)
    mod.C[0] = 3.0
    with pytest.raises(nsdrill.FileError, match=r"CHANGED SINCE THE RUNS: .*which differs here: the equations"):
        nsdrill.open_results(tmp_path / "out.h5")
    mod.C[0] = 1.0
    nsdrill.open_results(tmp_path / "out.h5").close()

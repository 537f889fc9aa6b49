"""YAML as text and back: what is read, the resolved study, the template and the schema."""

import copy
import json
import math
import re
import time
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from nsdrill.data import differences
from nsdrill.errors import FileError, StudyError
from nsdrill.kernel.settings import Simulation
from nsdrill.models.christoforou_yigit.parameters import Initial, Parameters
from nsdrill.models.operation import Operation
from nsdrill.models.registry import NAMES, described
from nsdrill.models.responses import Thresholds
from nsdrill.models.sections import MEANINGS as OF_MODELS
from nsdrill.observe.thresholds import Record
from nsdrill.study import json_schema, load_study, parse_study, study_from_resolved, template_text
from nsdrill.study.continuation import Continue
from nsdrill.study.keys import MEANINGS, SLICE, entries, keys_named
from nsdrill.study.read import parse
from nsdrill.study.uncertain import HOW
from nsdrill.study.write import changes, study_text, value_text
from nsdrill.units import from_si

BOMB = "a: &a [x,x,x,x,x,x,x,x,x,x]\n" + "".join(
    f"{chr(98 + i)}: &{chr(98 + i)} [{','.join(['*' + chr(97 + i)] * 10)}]\n" for i in range(12)
)


def test_scalars_follow_yaml_1_2():
    text = "[1, 010, 0x10, 0o17, 1_000, 1e4, 1.0e-6, .5, -3, no, yes, true, null, ~, '3', .inf, '', 1:30, 2020-01-01]"
    assert parse(text, "s").data == [
        1,
        10,
        16,
        15,
        "1_000",
        1e4,
        1e-6,
        0.5,
        -3,
        "no",
        "yes",
        True,
        None,
        None,
        "3",
        math.inf,
        "",
        "1:30",
        "2020-01-01",
    ]
    assert math.isnan(parse(".nan", "s").data)


def test_places_are_those_of_the_file():
    document = parse("sweep:\n  depth: [1 m,\n    2 m]\nmud:\n", "s")
    assert document.place(("sweep", "depth", 1)).line == 3
    assert document.place(("sweep", "depth", 1)).column == 5
    assert document.place(("sweep", "depth"), of_key=True).column == 3
    assert document.place(("mud",)).line == 4
    assert document.place(("mud", "drag")).line == 4  # not there: what is around it


def test_aliases_serve_within_bounds():
    study = parse_study("sweep: {wob: &w [1 kN, 2 kN], rotary_speed: [1 rad/s]}\noperation: {depth: &d 900 m}\n")
    assert study.operation.depth == 900.0
    assert parse("a: &a [1, 2]\nb: *a\nc: &s 3\nd: *s", "s").data == {"a": [1, 2], "b": [1, 2], "c": 3, "d": 3}


@pytest.mark.parametrize(
    ("text", "line", "says"),
    [
        ("- a", 1, "a mapping"),
        ("just text", 1, "a mapping"),
        ("sweep:\n\tdepth: 3 m", 2, "spaces, not tabs"),
        ("a: [", 1, "found a bracket [ that is not closed;"),
        ("sweep: {depth: 3 m", 1, "found a bracket { that is not closed;"),
        ("a: 3\nsweep: {depth: [1 km]\nbit: {lobes: 3}", 2, "a bracket { that is not closed before line 3"),
        ("a: }", 1, "a closing } for which there is no opening one"),
        ("sweep: {depth: [1 km,, 2 km]}", 1, "a comma without a value before it"),
        ("sweep: 'depth", 1, "a quote that is not closed"),
        ("sweep:\n  a: 3\n b: 4", 3, "another indentation than above"),
        ("title: [a] b", 1, "a key: value in each line, or quotes"),
        ("title: @b", 1, "begins with '@'"),
        ("a: 'b',\n", 1, "text behind a value"),
        ("a:\n  b: 1\n    c:\n", 3, "a colon where no key can be"),
        ("a:\n b: 3\n c\n d: 4", 3, "a line without a colon"),
        ("a:\n  b\n  c:\n", 2, "a line without a colon"),
        ("A study\nof mine\n\n# a: b\nunits: si", 1, "a line without a colon"),
        ("# A study\nof mine\nand others\nunits: si", 2, "a line without a colon"),
        ("my study: it\nis mine\nunits: si", 2, "a line without a colon"),
        ("depths:\n- a\n- b\n  c: 1", 4, "a colon where no key can be"),
        ("sweep = {}", 1, "A colon and a blank stand after a key: sweep: {}"),
        ("bit: {lobes:3}", 1, "A colon and a blank stand after a key: lobes: 3"),
        ("bit:\n  lobes 3", 2, "A colon and a blank stand after a key: lobes: 3"),
        ("sweep: \x00", 1, "#x0000"),
        ("sweep: 1\n---\nsweep: 2", 2, "second document"),
        ("sweep: !!python/object:os.system x", 1, "without tags"),
        ("sweep: !mine x", 1, "without tags"),
        ("a: *nowhere", 1, "earlier anchor"),
        ("a: &x [*x]", 1, "earlier anchor"),
        ("? [a, b]\n: 3", 1, "as a key"),
        ("[" * 5000, 1, "20 levels"),
        ("{a: " * 5000, 1, "20 levels"),
        ("- " * 5000, 1, "20 levels"),
        (BOMB, 5, "50000 values"),
        ("a: b: c", 1, "a colon where no key can be"),
        ("a: |\n  x\n b\n", 3, "allowed"),
    ],
)
def test_broken_documents(text, line, says):
    start = time.process_time()
    with pytest.raises(StudyError) as caught:
        parse_study(text, "s.yaml")
    assert time.process_time() - start < 5.0
    assert says in str(caught.value)
    assert f"s.yaml, line {line}" in str(caught.value)


@pytest.mark.parametrize("text", ["", "\n", "# nothing\n", "---\n", "null", "{}"])
def test_an_empty_file_is_no_study(text):
    with pytest.raises(StudyError, match="found an empty document; allowed: a study"):
        parse_study(text)


def test_byte_order_mark_is_accepted(tmp_path):
    path = tmp_path / "s.yaml"
    path.write_bytes(b"\xef\xbb\xbfsweep: {wob: [1 kN]}\r\ntitle: M\xc3\xbcll\r\n")
    assert load_study(path).title == "Müll"
    assert load_study(str(path)).axes["wob"].tolist() == [1000.0]


def test_files_that_are_no_text(tmp_path):
    path = tmp_path / "s.yaml"
    with pytest.raises(FileError, match=r"no such file. `nsdrill new"):
        load_study(path)
    with pytest.raises(FileError, match="is a folder"):
        load_study(tmp_path)
    with pytest.raises(FileError, match="not a file name"):
        load_study("a\0b")
    path.write_bytes(b"sweep: 1\ntitle: M\xfcll\n")
    with pytest.raises(FileError, match="line 2: found the byte 0xfc, which is not UTF-8"):
        load_study(path)
    path.write_text("sweep: 1\n", encoding="utf-16")
    with pytest.raises(FileError, match="not UTF-8"):
        load_study(path)
    path.write_bytes(b"#" * 1_000_001)
    with pytest.raises(FileError, match="larger than 1 MB"):
        load_study(path)
    path.write_bytes(b"\x89HDF\r\n\x1a\n" + bytes(100))
    with pytest.raises(FileError, match="HDF5 file"):
        load_study(path)


SWEEP = "sweep: {depth: {from: 500 m, to: 9000 m, points: 86}}\n"


def test_from_resolved_is_the_same_study():
    overrides = ["sweep.wob=[1 lbf, 3.3 kN]", "sweep.procedure=up", "sweep.along=wob"]
    study = parse_study(template_text(), overrides=overrides)
    again = study_from_resolved(json.loads(json.dumps(study.resolved)), study.text, study.source, study.overrides)
    assert again.resolved == study.resolved
    assert again.sha256 == study.sha256
    for name in vars(study).keys() - {"axes"}:
        assert getattr(again, name) == getattr(study, name), name
    for name, axis in study.axes.items():
        assert axis.tobytes() == again.axes[name].tobytes()
        assert axis.dtype == np.float64


@given(
    st.lists(st.floats(201.0, 1e4), min_size=1, max_size=5, unique=True),
    st.floats(0.0, 1e6),
    st.sampled_from(["m", "ft", "in"]),
)
@settings(max_examples=30)
def test_any_study_is_rebuilt_bit_for_bit(depths, wob, unit):
    listed = ", ".join(f"{from_si(depth, unit)!r} {unit}" for depth in depths)
    study = parse_study(f"sweep: {{depth: [{listed}]}}\noperation: {{wob: {wob!r} N}}")
    again = study_from_resolved(json.loads(json.dumps(study.resolved)))
    assert again.resolved == study.resolved
    assert again.axes["depth"].tobytes() == study.axes["depth"].tobytes()
    np.testing.assert_allclose(study.axes["depth"], sorted(depths), rtol=1e-12)


def test_a_long_axis_stays_short():
    study = parse_study("sweep: {wob: {from: 0 N, to: 1 MN, points: 1000000}}")
    assert study.resolved["sweep"]["wob"] == {"from": 0.0, "to": 1e6, "points": 1_000_000}
    assert len(study.axes["wob"]) == 1_000_000


def test_the_digest_knows_what_matters():
    base = parse_study(SWEEP + "mud: {density: 1500 kg/m^3, drag: 1}\noperation: {wob: 10 kN}")
    same = (
        "operation: {wob: 10000 N}\nmud: {drag: 1.0, density: 1.5 g/cm^3}\n" + SWEEP,
        "title: other\n" + SWEEP + "operation: {wob: 10 kN, depth: 4000 m}",  # the depth is swept
        "sweep: {depth: {points: 86, to: 500 m, from: 9 km}}\noperation: {wob: 10 kN}",
    )
    for text in same:
        assert parse_study(text).sha256 == base.sha256
    other = (SWEEP + "operation: {wob: 10.1 kN}", SWEEP + "operation: {wob: 10 kN}\nrecord: {peaks: 3}")
    for text in other:
        assert parse_study(text).sha256 != base.sha256


def test_studies_are_equal_that_have_the_same_numbers():
    text = "operation: {wob: 20 kN}\nsweep: {depth: [1 km, 2 km]}"
    same, other = parse_study(f"title: T\nunits: field\n{text}"), parse_study(text, "s.yaml", ["operation.wob=21 kN"])
    assert same == parse_study(text) != other
    assert len({same, parse_study(text), other}) == 2
    assert same != same.sha256


def test_differences_name_the_keys():
    a = parse_study(SWEEP).resolved
    b = parse_study("sweep: {depth: [1 km]}\nmud: {drag: 2}\n").resolved
    assert differences(a, a) == []
    assert differences(a, b) == [
        ("mud.drag", 1.0, 2.0),
        ("sweep.depth.from", 500.0, None),
        ("sweep.depth.to", 9000.0, None),
        ("sweep.depth.points", 86, None),
        ("sweep.depth", None, [1000.0]),
    ]


@pytest.mark.parametrize("path", [("mud",), ("mud", "drag"), ("sweep",), ("sweep", "along")])
def test_a_damaged_resolved_study_is_a_file_error(path):
    resolved = copy.deepcopy(parse_study(SWEEP).resolved)
    inside = resolved
    for part in path[:-1]:
        inside = inside[part]
    del inside[path[-1]]
    with pytest.raises(FileError, match=r"out\.h5"):
        study_from_resolved(resolved, source="out.h5")


CONFIGS = sorted((Path(__file__).parents[2] / "configs").glob("*.yaml"))
STUDIES = {
    "deep collars": "sweep: {depth: [7 km, 8000.1 m]}\ndrillstring: {collar: {length: 6 km}}",
    "ramp": "operation: {rotary_speed: {ramp: [[0 s, 3 rad/s], [10 s, 77 rpm]]}}",
    "ramp beside a sweep": "operation: {depth: {ramp: [[0 s, 3000 m], [10 s, 12000 ft]]}}\n"
    "sweep: {rotary_speed: {from: 60 rpm, to: 97 rpm, points: 7}, "
    "procedure: up-down}",
    "hertz": "well: {law: hertz, stiffness: 0.7 GN/m^1.5}\nsweep: {depth: 2 km, wob: 3.3 klbf}",
    "slice": "sweep: {depth: 2 km}\n"
    "initial: {slice: {x: {from: -1 in, to: 1 in, points: 3}, vx: {from: 0 ft/s, to: 7 "
    "m/s, points: 3}}}",
    "logarithmic": "sweep: {bit.rock_stiffness: {from: 10 MN/m, to: 90 MN/m, points: 3, spacing: log}}",
    "uncertain": """
sweep: {wob: [10 kN, 20 kN]}
uncertain:
  bit.rock_stiffness: {lognormal: {median: 25 MN/m, factor: 2}}
  bit.friction.static: {normal: {mean: 0.4, deviation: 0.05, low: 0.25}}
  drillstring.eccentricity: {triangular: [1 mm, 5 mm, 13 mm]}
  rotary_speed: {values: [60 rpm, 90 rpm]}
  correlations: [[bit.friction.static, bit.rock_stiffness, 0.5]]
  samples: 100
  seed: 7
""",
    "table": "uncertain: {table: {bit.friction.static: [0.3, 0.4], bit.rock_stiffness: [10 MN/m, 30 MN/m]}}",
    "ensemble": "sweep: {depth: 2 km}\ninitial: {ensemble: 5, seed: 3, spread: 0.1}",
    "refined": "sweep: {depth: {from: 1 km, to: 2 km, points: 4}, wob: [10 klbf, 30 kN], refine: 2}",
    "digits": "sweep: {depth: 2 km}\nbit: {cutting: {c1: 3.3333333333333333e-8, c2: -1e-300}}\n"
    "mud: {density: 1234.5678901234567 kg/m^3}\nclassify: {whirl: {direction: "
    "0.3333333333333333}}",
}


@pytest.mark.parametrize(
    "text",
    [*STUDIES.values(), *(path.read_text() for path in CONFIGS)],
    ids=[*STUDIES, *(path.stem for path in CONFIGS)],
)
def test_it_reads_back_the_same(text):
    study = parse_study(text)
    data = json.loads(json.dumps(study.resolved))
    for again in (parse_study(study_text(study.resolved)), study_from_resolved(data, study.text, study.source)):
        assert again.resolved == study.resolved
        assert again.sha256 == study.sha256
        assert (again.ramps, again.initial) == (study.ramps, study.initial)
        assert again.drawn.keys() == study.drawn.keys()
        assert all(np.array_equal(values, again.drawn[key]) for key, values in study.drawn.items())


@pytest.mark.parametrize("title", ["", "a: b # c", "- a", "null", '"q" \\ \'', "x\ny\t\u2028", "é 漢 \U0001f600"])
def test_any_title(title):
    resolved = {**parse_study("sweep: {depth: 2 km}").resolved, "title": title}
    assert parse_study(study_text(resolved)).title == title


def test_the_head_is_comments():
    study = parse_study("sweep: {depth: 2 km}")
    text = study_text(study.resolved, ["one", "sweep: {wob: 1 kN}\n- two \x00 three"])
    assert text.startswith("# one\n# sweep: {wob: 1 kN} - two three\ntitle: ")
    assert parse_study(text).sha256 == study.sha256


def test_changes_name_keys_and_units_as_a_study_has_them():
    a = load_study(CONFIGS[0]).resolved
    b = load_study(CONFIGS[0], ["operation.wob=5 klbf", "bit.lobes=1", "sweep.rotary_speed=[60 rpm, 6 rad/s]"]).resolved
    found = dict((key, new) for key, _, new in changes(a, b))
    assert found.pop("bit.surface_amplitude") == "0 m", "the default with one lobe"
    assert found == {"bit.lobes": "1", "operation.wob": "5 klbf", "sweep.rotary_speed": "[6 rad/s, 60 rpm]"}
    assert value_text(a, "well.stiffness") == "25 MN/m"
    assert value_text(a, "sweep.wob") is None


SWEEP_KEYS = {f"sweep.{name}" for name in ("depth", "wob", "rotary_speed", "procedure", "along", "refine")}


def test_the_template_is_the_defaults():
    study = parse_study(template_text())
    assert study.parameters == Parameters()
    assert study.operation == Operation()
    assert study.initial == Initial()
    assert study.simulation == Simulation()
    assert study.thresholds == Thresholds()
    assert study.record == Record()
    assert study.sha256 == parse_study("sweep: {depth: {from: 500 m, to: 9000 m, points: 86}}").sha256


def test_the_template_has_every_key_with_its_meaning():
    text = template_text()
    lines = {".".join(map(str, path)): place.line for path, place in parse(text, "t").keys.items()}
    assert set(keys_named().leaves) <= set(lines)
    for key, leaf in keys_named().leaves.items():
        line = text.splitlines()[(lines[key] or 0) - 1]
        assert leaf.meaning in line
        assert not leaf.units or f"[{leaf.units}]" in line
    # a line that lists choices is as long as there are words
    assert max(len(line) for line in text.splitlines() if " | " not in line) < 140


def test_every_key_has_a_meaning_and_every_meaning_a_key():
    groups = {key.rpartition(".")[0] for key in keys_named().leaves}
    groups = (groups | {group.rpartition(".")[0] for group in groups}) - {""}
    sections = set(keys_named().sections)
    unknowns = {"uncertain", *(f"uncertain.{name}" for name in HOW)}
    own = {key for key in MEANINGS if key.partition(".")[0] == "continue"}
    form = Continue(keys_named())
    assert own == {
        "continue",
        *(f"continue.{key}" for key in form.members),
        *(f"continue.curves.{key}" for key in form.members["curves"].form.mapping.members),
    }
    parts = {part.key for leaf in keys_named().leaves.values() for part in leaf.parts}
    every = (
        set(keys_named().leaves)
        | groups
        | parts
        | sections
        | SWEEP_KEYS
        | unknowns
        | {"title", "units", "sweep", SLICE}
    )
    assert (set(MEANINGS) | set(OF_MODELS)) - own <= every
    assert every == {key for key, words in keys_named().meanings.items() if words} - own


@pytest.mark.parametrize("model", NAMES)
def test_a_model_says_once_what_a_key_means(model):
    keys, general = keys_named(model), {**OF_MODELS, **MEANINGS}
    assert {key: one.meaning for key, one in keys.leaves.items()}.items() <= keys.meanings.items()
    own = dict(keys.model.meanings)
    for section, cls in keys.sections.items():
        for key, item, _ in entries(cls, section):
            if "meaning" in item.metadata:
                assert key not in own, f"{key}: {own[key]}; and beside the number {item.metadata['meaning']}"
                own[key] = item.metadata["meaning"]
    assert [key for key, words in own.items() if words == general.get(key)] == []


def test_defaults_as_text_read_back_exactly():
    for leaf in keys_named().leaves.values():
        raw = parse(leaf.default_text, "t").data
        assert leaf.read(raw) == leaf.default, leaf.key


def objects(schema: dict) -> list[dict]:
    return [schema, *schema["$defs"].values()]


def test_the_json_schema():
    schema = json.loads(json.dumps(json_schema(), allow_nan=False))
    assert schema["$schema"] == "https://json-schema.org/draft/2020-12/schema"
    assert "required" not in schema  # without a sweep a study is one operating point
    assert set(schema["properties"]) == {
        "title",
        "units",
        "model",
        "sweep",
        "uncertain",
        "continue",
        *keys_named().sections,
    }
    for part in objects(schema):
        assert part["additionalProperties"] is False
        assert all("description" in value for value in part["properties"].values())
    well = schema["$defs"]["Well"]["properties"]
    assert well["law"]["enum"] == ["linear", "hertz"]
    assert well["diameter"]["default"] == "15 in"
    assert re.search(well["diameter"]["pattern"], "15 in")
    assert "In m" in well["diameter"]["description"]
    assert schema["$defs"]["Bit"]["properties"]["lobes"]["maximum"] == 8
    assert set(schema["$defs"]["Range_depth"]["required"]) == {"from", "to", "points"}


def test_the_template_meets_the_json_schema():
    jsonschema = pytest.importorskip("jsonschema")
    jsonschema.Draft202012Validator.check_schema(json_schema())
    jsonschema.Draft202012Validator(json_schema()).validate(parse(template_text(), "t").data)


@pytest.mark.parametrize("model", ["torsion", "regenerative", "segments"])
def test_a_slice_may_vary_the_states_that_the_start_gives(model):
    keys = keys_named(model)
    states, fields = described(model).states(described(model).parameters()), described(model).initial.states()
    assert keys.slices == tuple(name for name in states if name in fields)
    assert {"twist", "bit_speed", "drive_angle"} <= {*keys.slices}
    assert not described(model).sliced

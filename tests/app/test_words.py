"""Axes over words and over what is fixed when the model is compiled: the numbers of single
studies, in one file."""

import json

import numpy as np
import pytest
import xarray

import nsdrill
from nsdrill.app.answering.summary import summarize
from nsdrill.app.running.combine import combine
from nsdrill.app.simulating.trajectory import replay
from nsdrill.data import Results
from nsdrill.errors import InputError, StudyError
from nsdrill.store import MemoryLog, read_results, write_results
from nsdrill.store.dataset import from_dataset, to_dataset

from .alike import alike

STUDY = """
operation: {depth: 2000 m, wob: 40 kN}
modes: {axial: frozen, lateral: frozen}
drive: {torque_limit: 60 kN*m, inertia: 2000 kg*m^2}
sweep:
  rotary_speed: [3 rad/s, 5 rad/s]
  drive.kind: [stiff, ideal]
  drive.inertia: [1500 kg*m^2, 2500 kg*m^2]
simulation: {transient: 3 s, observe: 6 s}
record: {peaks: 2}
"""


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    found = tmp_path_factory.mktemp("words") / "drives.h5"
    nsdrill.run(STUDY, found)
    return found


SPEEDS_ALONE = {"rotary_speed": ["3 rad/s", "5 rad/s"]}


def alone(kind: str, inertia: str) -> xarray.Dataset:
    """The study of one kind of drive and one inertia; without the numbers that the kind
    does not read."""
    drive = {"torque_limit": "60 kN*m", "inertia": inertia} if kind == "stiff" else {}
    return nsdrill.run(STUDY, set={"drive": {"kind": kind, **drive}, "sweep": SPEEDS_ALONE})


def test_each_word_has_the_bits_of_a_study_of_its_own(path):
    every = nsdrill.open_results(path)
    assert every.drive_kind.values.tolist() == ["ideal", "stiff"]
    assert every.drive_kind.attrs["key"] == "drive.kind"
    for kind in ("ideal", "stiff"):
        for inertia in (1500.0, 2500.0):
            one = every.sel(drive_kind=kind, drive_inertia=inertia)
            single = alone(kind, f"{inertia} kg*m^2")
            alike(one, single)
            more = [name for name in one.data_vars if name not in single]
            assert all(np.all(np.isnan(one[name])) for name in more), kind
    assert np.all(np.isnan(every.drive_speed_mean.sel(drive_kind="ideal")))
    assert np.all(np.isfinite(every.drive_speed_mean.sel(drive_kind="stiff")))
    assert np.all(np.isnan(every.final_state.sel(drive_kind="ideal", state="lag")))
    assert not np.any(np.isnan(every.final_state.sel(drive_kind="stiff")))


CARRIED = """
operation: {depth: 2000 m, wob: 40 kN}
modes: {axial: frozen, lateral: frozen}
sweep: {rotary_speed: [3 rad/s, 4 rad/s, 5 rad/s], %s, procedure: up-down}
simulation: {transient: 3 s, observe: 6 s, verify: true}
"""
WORDS = ("ideal", "stiff", "soft_torque")


def test_each_word_of_a_carried_sweep_is_a_chain_of_its_own(tmp_path):
    """The kinds differ in their states: a state that went from one kind to another
    would change the bits."""
    every = nsdrill.run(CARRIED % f"drive.kind: [{', '.join(WORDS)}]", tmp_path / "every.h5")
    assert every.procedure.values.tolist() == ["up", "down"]
    for kind in WORDS:
        alike(every.sel(drive_kind=kind), nsdrill.run(CARRIED % f"drive.kind: {kind}"))
    code = float(read_results(tmp_path / "every.h5", ()).coords["drive_kind"][1])
    run = replay(tmp_path / "every.h5", rotary_speed=4.0, at={"drive.kind": code}, procedure="down")
    assert run.same_bits


def test_chains_of_words_go_on_where_a_run_was_interrupted(tmp_path):
    study = CARRIED % f"drive.kind: [{', '.join(WORDS)}]"

    def interrupt(progress):
        if progress.done >= 4:
            raise KeyboardInterrupt

    whole = nsdrill.run(study)
    with pytest.raises(KeyboardInterrupt):
        nsdrill.run(study, tmp_path / "out.h5", workers=1, progress=interrupt)
    resumed = nsdrill.run(study, tmp_path / "out.h5", resume=True)
    alike(resumed, whole)


def test_carried_sweeps_that_differ_in_a_word_become_one(tmp_path):
    files = [tmp_path / f"{kind}.h5" for kind in ("ideal", "stiff")]
    for file in files:
        nsdrill.run(CARRIED % f"drive.kind: {file.stem}", file)
    whole, key = combine(files)
    assert key == "drive.kind"
    swept = to_dataset(whole)
    alike(nsdrill.run(CARRIED % "drive.kind: [ideal, stiff]"), swept)
    plain = CARRIED.replace(", %s", "") + "drive: {kind: %s}\n"
    for file in files:
        nsdrill.run(plain % file.stem, file, overwrite=True)
    whole, key = combine(files)
    assert to_dataset(whole).attrs["study_sha256"] == swept.attrs["study_sha256"]


def test_points_are_replayed_bit_for_bit(path):
    for place, kind in enumerate(("ideal", "stiff")):
        code = float(read_results(path, ()).coords["drive_kind"][place])
        run = replay(path, rotary_speed=5.0, at={"drive.kind": code, "drive.inertia": 2500.0})
        assert run.same_bits
        assert json.loads(run.trace.attrs["at"])["drive.kind"] == kind
        assert ("lag" in run.trace.variables) == (kind == "stiff")


def test_a_dataset_and_its_file_say_the_same(path):
    held = read_results(path)
    back = from_dataset(to_dataset(held))
    assert isinstance(back, Results)
    assert np.array_equal(back.coords["drive_kind"], held.coords["drive_kind"])
    part = from_dataset(nsdrill.open_results(path).sel(drive_kind=["stiff"]))
    assert part.coords["drive_kind"].tolist() == held.coords["drive_kind"][1:].tolist()


def test_files_that_differ_in_a_word_become_one(tmp_path, path):
    """Also where one drive has states and numbers that the other has not, and keys that
    it alone reads."""
    several = [tmp_path / "stiff.h5", tmp_path / "ideal.h5"]
    for file, numbers in zip(several, ({"torque_limit": "60 kN*m"}, {}), strict=True):
        nsdrill.run(STUDY, file, set={"drive": {"kind": file.stem, **numbers}, "sweep": SPEEDS_ALONE})
    whole, key = combine(several)
    assert key == "drive.kind"
    write_results(tmp_path / "both.h5", MemoryLog.of(whole))
    swept = nsdrill.run(
        STUDY.replace("  drive.inertia: [1500 kg*m^2, 2500 kg*m^2]\n", "").replace(", inertia: 2000 kg*m^2", "")
    )
    both = nsdrill.open_results(tmp_path / "both.h5")
    assert both.drive_kind.values.tolist() == ["ideal", "stiff"]
    assert set(both.data_vars) == set(swept.data_vars)
    alike(both, swept)
    assert replay(tmp_path / "both.h5", rotary_speed=3.0, at={"drive.kind": 1.0}).same_bits


def test_a_file_with_words_is_classified_shown_and_seen(path):
    note = summarize(read_results(path))
    assert note["axes"]["drive_kind"] == {"values": ["ideal", "stiff"], "points": 2}
    window = nsdrill.window(path)
    assert window["third"] == "drive_kind"
    assert [one["at"] for one in window["maps"]] == [{"drive_kind": "ideal"}, {"drive_kind": "stiff"}]
    before = nsdrill.open_results(path).load()
    again = nsdrill.classify(before)
    for name in ("response", "stick_slip_severity", "settled"):
        assert np.array_equal(again[name].values, before[name].values)


def test_switches_and_starts_are_words_too():
    study = """
model: segments
segments: {pipe: 2, collar: 2}
sweep: {initial.start: [steady, rest], bit.cutting.speed: [mean]}
simulation: {transient: 0.2 s, observe: 0.5 s}
"""
    found = nsdrill.run(study)
    speeds = found.initial_state.sel(state="bit_speed").squeeze()
    assert dict(zip(found.initial_start.values.tolist(), speeds.values.tolist(), strict=True)) == {
        "steady": pytest.approx(13.0),
        "rest": 0.0,
    }
    loaded = nsdrill.load_study("sweep: {drillstring.eccentric_weight: [true, false]}\nwell: {inclination: 30 deg}\n")
    assert loaded.resolved["sweep"]["drillstring.eccentric_weight"] == [False, True]


@pytest.mark.parametrize(
    ("key", "word", "stored"),
    [
        ("drillstring.eccentric_weight", "false", "false"),
        ("drillstring.eccentric_weight", False, "false"),
        ("drillstring.lateral_softening", "none", "none"),
        ("drive.kind", "stiff", "stiff"),
    ],
)
def test_a_word_or_a_switch_is_chosen_by_at(key, word, stored):
    """Of a study that is simulated, and of a file with both words of which one is replayed."""
    study = {"operation": {"wob": "40 kN"}, "simulation": {"transient": "1 s", "observe": "2 s"}}
    trace = nsdrill.simulate(study, at={key: word}, duration="1 s")
    assert json.loads(trace.attrs["study_overrides"]) == [f"{key}={stored}"]
    words = {"drillstring.eccentric_weight": [True, False], "drillstring.lateral_softening": ["live", "none"]}
    swept = nsdrill.run(study | {"sweep": {key: words.get(key, ["ideal", "stiff"])}})
    replayed = nsdrill.replay(swept, at={key: word})
    assert replayed.attrs["same_bits"] == 1
    with pytest.raises(InputError, match=rf"at\['{key}'\]: found 'neither'; allowed: .*{stored}"):
        nsdrill.replay(swept, at={key: "neither"})


def test_what_no_word_reads_is_refused_and_what_one_reads_is_not():
    cases = (
        ("drive: {matching: 3}\nsweep: {drive.kind: [ideal, stiff]}\n", "one of the words of sweep.drive.kind reads"),
        ("sweep: {drive.kind: [ideal, stiff], drive.matching: [1, 2]}\n", "one of the words of sweep.drive.kind reads"),
        ("modes: {axial: frozen, lateral: frozen}\nsweep: {modes.torsional: [free, frozen]}\n", "at least one free"),
        ("modes: {torsional: frozen}\nsweep: {drive.kind: [ideal, stiff]}\n", "stiff with modes.torsional: frozen"),
        ("sweep: {drive.kind: [ideal, ideal]}\n", "there a second time"),
        ("sweep: {drive.kind: [ideal, soft]}\n", "allowed: ideal, stiff, soft_torque"),
        ("sweep: {drive.kind: {from: ideal, to: stiff, points: 2}}\n", "found a mapping"),
        (
            "sweep: {drive.kind: [ideal, stiff], rotary_speed: [3 rad/s], procedure: up, along: drive.kind}\n",
            "allowed: an axis over a number: rotary_speed or another by its key",
        ),
        ("sweep: {well.law: [linear, hertz]}\n", "the units of well.stiffness depend"),
        ("sweep: {simulation.method: [explicit]}\n", "a key that is no number"),
        ("uncertain: {drive.kind: {values: [1, 2]}}\n", "which is a choice"),
        ("continue: {along: drive.kind, from: 1, to: 2}\n", "a choice"),
    )
    for text, words in cases:
        with pytest.raises(StudyError) as error:
            nsdrill.load_study(text)
        assert words in str(error.value), text
    for text in (
        "drive: {matching: 3, torque_limit: 60 kN*m}\nsweep: {drive.kind: [ideal, soft_torque]}\n",
        "bit: {friction: {b0: 30 mm, static: 0.6}}\nsweep: {bit.friction.law: [rational, linear]}\n",
        "mud: {swirl: 0.3}\nsweep: {modes.lateral: [free, frozen], drillstring.eccentricity: [1 mm, 5 mm]}\n",
    ):
        nsdrill.load_study(text)


def test_studies_with_words_have_digests_of_all_that_counts():
    def digest(kind, more=""):
        return nsdrill.load_study(
            f"drive: {{kind: {kind}{more}}}\nsweep: {{drive.kind: [ideal, soft_torque]}}\n"
        ).sha256

    assert digest("ideal") == digest("soft_torque")  # the axis replaces it
    assert digest("soft_torque") != digest("soft_torque", ", matching: 3")


def test_a_word_that_is_not_there_is_told(path, capsys):
    with pytest.raises(InputError, match="found soft_torque; allowed: ideal, stiff, as the sweep"):
        replay(path, rotary_speed=5.0, at={"drive.kind": 2.0, "drive.inertia": 2500.0})


def test_pictures_and_pages_have_the_words(path):
    """A curve for each word, a row of a map for each, a panel for each; text in place
    of numbers on a page."""
    from nsdrill.web.diagrams import choices, plane

    one = nsdrill.open_results(path).sel(drive_inertia=1500.0)
    curves = nsdrill.plot(one, kind="stick_slip_index")
    assert [text.get_text() for text in curves.legends[0].get_texts()] == ["ideal", "stiff"]
    drawn = {line.get_gid() for line in curves.axes[0].lines}
    assert {"stick_slip_index:ideal", "stick_slip_index:stiff"} <= drawn
    area = nsdrill.plot(one, kind="map").axes[0]
    assert [text.get_text() for text in area.get_yticklabels()] == ["ideal", "stiff"]
    assert area.get_ylim() == (2.5, 0.5), "the first word on top"
    titles = [axes.get_title() for axes in nsdrill.plot(path, kind="window").axes]
    assert "drive kind ideal" in titles
    held = read_results(path)
    (words,) = (axis for axis in choices(held, "si")["axes"] if axis["key"] == "drive.kind")
    assert words["texts"] == ["ideal", "stiff"]
    head, columns = plane(held, "si", "stick_slip_index", "rotary_speed", "drive_kind")
    assert head["y_edges"].tolist() == [0.5, 1.5, 2.5]
    assert columns["values"].shape == (1, 2, 2)


LOBES = """
operation: {depth: 2000 m}
bit: {surface_amplitude: 1 mm}
sweep:
  rotary_speed: [3 rad/s, 5 rad/s]
  bit.lobes: [1, 3]
simulation: {transient: 3 s, observe: 3 s}
record: {peaks: 2}
"""


@pytest.fixture(scope="module")
def of_lobes(tmp_path_factory):
    found = tmp_path_factory.mktemp("lobes") / "lobes.h5"
    nsdrill.run(LOBES, found)
    return found


BEAM = """
model: beam
beam: {modes: 2, stations: [{at: 0.1}, {at: 0.9}]}
operation: {depth: 2000 m}
bit: {surface_amplitude: 1 mm}
sweep: {bit.lobes: [1, 2]}
simulation: {transient: 1 s, observe: 1 s}
"""


@pytest.mark.parametrize(
    ("study", "changes"),
    [(LOBES, {}), (LOBES, {"sweep.procedure": "up", "sweep.along": "rotary_speed"}), (BEAM, {})],
    ids=["each by itself", "chains of their own", "elastic collar"],
)
def test_each_value_has_the_bits_of_a_study_of_its_own(study, changes):
    both = nsdrill.run(study, set=changes)
    assert both.sizes["bit_lobes"] == 2
    for lobes in both.bit_lobes.values:
        alike(both.sel(bit_lobes=lobes), nsdrill.run(study, set={**changes, "sweep.bit.lobes": int(lobes)}))


def test_its_points_are_replayed_bit_for_bit_and_checked(of_lobes):
    assert replay(of_lobes, rotary_speed=5.0, at={"bit.lobes": 1.0}).same_bits
    checked = nsdrill.run(LOBES, set={"simulation.verify": True})
    assert np.all(checked.tight_status == 1)


def test_a_default_that_depends_on_an_axis_is_asked_for():
    """One lobe is a PDC bit on a smooth surface by default, three are a roller cone on
    lobes of 1 mm: no one height is the default of both."""
    text = LOBES.replace("bit: {surface_amplitude: 1 mm}\n", "")
    with pytest.raises(
        StudyError, match=r"bit\.surface_amplitude depends \(0 m with 1, 1 mm with 3\); allowed: it with"
    ):
        nsdrill.load_study(text)
    assert nsdrill.load_study(text, {"sweep.bit.lobes": [2, 3]}).parameters.bit.surface_amplitude == 1e-3
    swept = nsdrill.load_study(text, {"sweep.bit.surface_amplitude": ["0 mm", "1 mm"]})
    assert len(swept.axes["bit.surface_amplitude"]) == 2


def test_what_no_axis_of_this_kind_may_be_is_told():
    spaced = {"from": 1, "to": 4, "points": 3}
    cases = (
        ({"sweep.bit.lobes": "1.5"}, "a whole number"),
        ({"sweep.bit.lobes": spaced}, "whole numbers, as [1, 3, 5]"),
        ({"sweep.procedure": "up", "sweep.along": "bit.lobes"}, "allowed: an axis over a number"),
    )
    for change, words in cases:
        with pytest.raises(StudyError) as error:
            nsdrill.load_study(LOBES, change)
        assert words in str(error.value)

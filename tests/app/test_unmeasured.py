"""A run whose features are no numbers: nothing is known of its response, whatever its
label says."""

import numpy as np
import pytest
from matplotlib.legend import Legend

import nsdrill
from nsdrill.models.registry import NAMES, described
from nsdrill.models.variant import Variant
from nsdrill.variables import OK, UNMEASURED

STUDY = """\
model: torsion
operation: {depth: 2000 m, wob: 10 kN}
sweep: {rotary_speed: [6 rad/s, 8 rad/s, 10 rad/s]}
simulation: {transient: 20 s, observe: 20 s}
"""


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    """Three safe points."""
    path = tmp_path_factory.mktemp("unmeasured") / "safe.h5"
    data = nsdrill.run(nsdrill.load_study(STUDY), path)
    assert nsdrill.window(path)["safe"] == 3
    return data.load()


@pytest.mark.parametrize("feature", ["stick_slip_index", "stuck_fraction"])
def test_a_point_without_a_number_is_not_safe_but_unknown(results, tmp_path, feature):
    edited, path = results.copy(deep=True), tmp_path / "edited.h5"
    edited[feature][1] = np.nan
    assert int(edited.response[1]) == 0
    nsdrill.save(edited, path)
    for given in (edited, path):
        window = nsdrill.window(given)
        assert (window["safe"], window["unknown"], window["of"] - window["known"]) == (2, 1, 1)
        assert window["maps"][0]["recommended"]["rotary_speed"] != 8.0
        assert "2 ok, 1 unmeasured" in str(nsdrill.show(given))
    assert edited.nsdrill.safe().values.ravel().tolist() == [True, False, True]
    assert edited.nsdrill.safe(4).values.ravel().tolist() == [True, False, True]


def test_a_run_whose_feature_is_no_number_has_failed(monkeypatch, tmp_path):
    """Also as it is run: the feature of a model may be a quotient of nothing."""
    measure = Variant.features

    def features(self, outcome, table, observe):
        found = measure(self, outcome, table, observe)
        speed = self.by_name(table)["set_speed"]
        return found | {"stuck_fraction": np.where(speed == 8.0, np.nan, found["stuck_fraction"])}

    monkeypatch.setattr(Variant, "features", features)
    with pytest.warns(UserWarning, match="1 of 3"):
        data = nsdrill.run(nsdrill.load_study(STUDY), tmp_path / "out.h5")
    assert data.status.values.ravel().tolist() == [OK, UNMEASURED, OK]
    assert data.status.attrs["flag_meanings"].split()[UNMEASURED] == "unmeasured"
    assert nsdrill.window(tmp_path / "out.h5")["unknown"] == 1


@pytest.mark.parametrize("name", NAMES)
def test_the_features_that_decide_are_those_of_responses_and_severities(name):
    model = described(name)
    assert {"stick_slip_index", "stuck_fraction"} <= set(model.labelled)
    assert ("lateral_acceleration_rms" in model.labelled) == ("whirl" in model.responses)
    status = np.array([OK, OK, 0, 2], np.int8)
    features = {"stick_slip_index": np.array([np.inf, np.nan, np.nan, np.nan]), "whirl_ratio": np.full(4, np.nan)}
    features["bit_speed_mean"] = np.zeros(4)
    assert model.status_of(status, features).tolist() == [OK, UNMEASURED, 0, 2], "infinite where the mean is zero"


@pytest.mark.parametrize(
    "faulty",
    [
        {"stick_slip_index": -5.0},
        {"stick_slip_index": np.inf},  # beside a mean that is not zero
        {"stuck_fraction": 2.0},
        {"stuck_fraction": -0.1},
        {"bit_speed_mean": 8.0, "bit_speed_min": 0.0, "bit_speed_max": 0.0},
    ],
)
def test_what_cannot_be_measured_is_not_known(faulty):
    """Of a model that computes a feature wrongly, or of a file that was edited."""
    sound = {"stick_slip_index": 10.0, "stuck_fraction": 0.0, "bit_speed_mean": 3.0}
    sound |= {"bit_speed_min": 2.7, "bit_speed_max": 3.3}
    features = {name: np.array([value, faulty.get(name, value)]) for name, value in sound.items()}
    assert described("torsion").status_of(np.array([OK, OK], np.int8), features).tolist() == [OK, UNMEASURED]


def test_exponents_that_are_not_known_are_counted():
    """In the text, the data of it and the picture of the motions."""
    data = nsdrill.run(
        "modes: {axial: frozen, lateral: frozen}\noperation: {depth: 3000 m, wob: 60 kN}\n"
        "sweep: {rotary_speed: [8 rad/s, 10 rad/s, 12 rad/s]}\nsimulation: {transient: 5 s, observe: 10 s}\n"
        "record: {exponent: true, poincare: 8}\n",
        progress=False,
    ).load()
    assert "exponents" not in str(nsdrill.show(data))
    data["lyapunov_exponent"][1] = np.nan
    data["lyapunov_error"][1] = np.nan
    assert "exponents      not known of 1 of 3 runs" in str(nsdrill.show(data))
    figure = nsdrill.plot(data, kind="motion")
    figure.canvas.draw()
    words = [text.get_text() for legend in figure.findobj(Legend) for text in legend.get_texts()]
    assert "exponent not known of 1 of 3 runs" in words

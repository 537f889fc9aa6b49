"""What a branch says of stability and of jumps, of systems whose answers are known on paper: at
a pitchfork its sides meet and nothing vanishes, and what stays on the unit circle decides nothing."""

import numpy as np
import pytest

import nsdrill
from nsdrill.analysis.bifurcations import BRANCH, END, FOLD, NOT_DECIDED, NOT_FOLLOWED
from nsdrill.figures.kinds.branch_diagram import OPEN
from nsdrill.models import registry
from nsdrill.store.branch_file import branches_of
from nsdrill.text.branch_text import NOT_TOLD, lines, summarize_branches


def pitchfork(x=0.1, *, mu=-0.5):
    """Two motions grow from zero, both stable"""
    return {"x": mu * x - x**3}


def beside(x=0.1, *, mu=0.05):
    """A parabola that crosses zero beside its fold"""
    return {"x": x * (mu - (x - 1e-4) ** 2)}


def subcritical(x=0.1, *, mu=-0.5):
    """Two unstable motions shrink to zero, and turn at folds at mu = -1/4"""
    return {"x": mu * x + x**3 - x**5}


def symmetric(t, x=0.1, v=0.0, *, force=0.3):
    """Duffing's oscillator without a linear spring: its motion loses its symmetry"""
    return v, force * np.cos(t) - 0.2 * v - x**3


def mirrored(x=1.0, v=0.0, y=0.05, *, mu=-0.9):
    """Van der Pol's cycle, beside which y grows, to either side, from a mean of 0.2 x^2 above -mu on"""
    return {"x": v, "v": (1 - x * x) * v - x + 0.3 * y, "y": (mu + 0.2 * x * x) * y - y**3}


def saddle_node(x=0.5, *, mu=0.5):
    return {"x": mu - x * x}


def transcritical(x=0.1, *, mu=-0.5):
    return {"x": mu * x - x * x}


def weak(x=0.1, v=0.0, *, a=0.1):
    """Leaves its equilibrium, for all a above 0, more slowly than exponentially"""
    return v, -x + a * v**3


def prey(x=1.0, y=1.2, *, a=1.0):
    """Lotka and Volterra: around its equilibrium all motions repeat"""
    return x * (a - y), y * (x - 1.0)


def undamped(t, x=0.1, v=0.0, *, force=0.1):
    """A pendulum without damping"""
    return v, force * np.cos(2 * t) - np.sin(x)


@pytest.fixture
def followed():
    made = []

    def followed(equations, along, **continued):
        made.append(equations.__name__)
        study = nsdrill.model(equations).study(continued={**along, **continued}, transient=200, observe=50)
        data = nsdrill.continue_branches(study, progress=False)
        found = summarize_branches(data)
        return data, found, " ".join("\n".join(lines("b.h5", found, "si", everything=True)).split())

    yield followed
    for name in made:
        registry.withdraw(name)


def special_of(found):
    return [one for branch in found["branches"] for one in branch["special"]]


def test_nothing_jumps_at_a_pitchfork(followed):
    data, found, text = followed(pitchfork, {"mu": (-0.5, 0.5), "seeds": [-0.4, 0.4]})
    labels = data["label"].values
    assert set(labels.tolist()) <= {0, BRANCH, END}
    assert data["parameters_mu"].values[labels == BRANCH] == pytest.approx(0.0, abs=1e-6)
    (arms,) = [one for one in special_of(found) if one["note"] == "pitchfork, where the branch turns back"]
    assert (arms["label"], arms["unstable_before"], arms["unstable_after"]) == ("branch_point", 0, 0)
    assert "nothing jumps" in arms["meaning"]
    assert "pitchfork" in text
    assert "stable one jumps" not in text


def test_a_forced_motion_loses_its_symmetry_without_a_jump(followed):
    """Its two motions that mirror each other meet in the symmetric one at force = 2.403."""
    data, found, _ = followed(symmetric, {"force": (2.3, 2.8), "seeds": [2.7]})
    assert set(data["label"].values.tolist()) <= {0, BRANCH, END}
    (arms,) = special_of(found)
    assert arms["value"] == pytest.approx(2.4030, abs=1e-3)
    assert (arms["unstable_before"], arms["unstable_after"]) == (0, 0)
    assert "pitchfork" in arms["note"]


def test_where_a_stable_motion_vanishes_it_jumps(followed):
    _, found, text = followed(saddle_node, {"mu": (-0.5, 0.5), "seeds": [0.4]})
    (fold,) = special_of(found)
    assert fold["label"] == "fold"
    assert {fold["unstable_before"], fold["unstable_after"]} == {0, 1}
    assert "what is on the stable one jumps; stable to one side" in text


def test_a_pitchfork_between_unstable_motions_keeps_the_folds_beside_it(followed):
    data, found, _ = followed(subcritical, {"mu": (-0.5, 0.5), "seeds": [0.4, -0.2]}, points=1000)
    labels, mu = data["label"].values, data["parameters_mu"].values
    assert mu[labels == FOLD] == pytest.approx(-0.25, abs=1e-6)
    assert mu[labels == BRANCH] == pytest.approx(0.0, abs=1e-6)
    (arms,) = [one for one in special_of(found) if "pitchfork" in one["note"]]
    assert (arms["unstable_before"], arms["unstable_after"]) == (1, 1)
    assert "jumps" not in arms["meaning"]


@pytest.mark.parametrize(
    ("equations", "along"),
    [
        (beside, {"mu": (-0.05, 0.1), "seeds": [0.05]}),  # its fold at mu = 0, the crossing at 1e-8
        (symmetric, {"force": (2.38, 2.45), "seeds": [2.43]}),  # a pitchfork that is not located
    ],
)
def test_a_fold_so_close_to_a_branch_point_may_not_be_told_from_a_pitchfork(followed, equations, along):
    _, found, text = followed(equations, along, points=120)
    notes = [one["note"] for one in special_of(found)]
    assert "pitchfork, or a fold beside a branch point: too close to tell" in notes
    assert "pitchfork, where the branch turns back" not in notes
    assert "too close to tell" in text


@pytest.mark.parametrize(
    ("equations", "along"),
    [
        (pitchfork, {"mu": (-0.1, 0.1), "seeds": [-0.05]}),
        (subcritical, {"mu": (-0.2, 0.5), "seeds": [-0.1]}),
        (transcritical, {"mu": (-0.1, 0.1), "seeds": [-0.05]}),
        (symmetric, {"force": (2.38, 2.45), "seeds": [2.39]}),  # from the symmetric motion
        (symmetric, {"force": (2.38, 2.45), "seeds": [2.43]}),  # from where the other family turns back
        (mirrored, {"mu": (-0.6, 0.0), "seeds": [-0.5]}),
    ],
)
def test_the_branch_that_crosses_at_a_branch_point_is_followed(followed, equations, along):
    cycles = {"motions": ["cycle"]} if equations is mirrored else {}
    data, found, text = followed(equations, along, points=120, **cycles)
    assert data["parent"].values.tolist()[-1] >= 0
    assert {one["springs"] for one in special_of(found) if one["label"] == "branch_point"} == {"followed"}
    assert found["not_followed"] == {}
    assert "NOT FOLLOWED" not in text


def test_show_counts_the_special_points_from_which_no_branch_is_followed(followed):
    data, found, text = followed(pitchfork, {"mu": (-0.5, 0.5), "seeds": [-0.4]}, switch=False)
    assert data["springs"].values[data["label"].values == BRANCH].tolist() == [NOT_FOLLOWED]
    assert found["not_followed"] == {"branch_point": 1}
    assert "NOT FOLLOWED 1 special point (1 branch point): what springs there is missing here" in text
    assert "not followed from here" in text
    without = branches_of(data.drop_vars("springs"))  # of a file that does not tell it
    assert summarize_branches(without)["not_known_whether_followed"] == {"branch_point": 1}


def test_a_transcritical_point_is_a_branch_point_of_both(followed):
    data, found, text = followed(transcritical, {"mu": (-0.5, 0.5), "seeds": [-0.4, 0.4]})
    assert set(data["label"].values.tolist()) <= {0, BRANCH, END}
    assert {(one["unstable_before"], one["unstable_after"]) for one in special_of(found)} == {(0, 1), (1, 0)}
    assert "jumps" not in text


def is_drawn(y):
    """Whether a line joins any of its points."""
    return bool(np.any(np.isfinite(y[1:] - y[:-1])))


@pytest.mark.parametrize(
    ("equations", "along"),
    [
        (weak, {"a": (0.05, 0.2), "seeds": [0.1]}),
        (prey, {"a": (0.5, 2.0), "seeds": [1.0]}),
        (undamped, {"force": (0.01, 3.0), "seeds": [0.1]}),
    ],
)
def test_what_stays_on_the_unit_circle_is_not_decided(followed, tmp_path, equations, along):
    data, found, text = followed(equations, along)
    assert np.all(data["unstable"].values == NOT_DECIDED)
    assert set(data["label"].values.tolist()) <= {0, END}  # no bifurcation by errors alone
    (branch,) = found["branches"]
    assert branch["stable"] == []
    assert branch["not_decided"] == [pytest.approx([branch["min"], branch["max"]])]
    assert f"stable nowhere not decided {branch['min']:.4g} to {branch['max']:.4g}: {NOT_TOLD}" in text
    figure = nsdrill.plot(data)
    seen = {
        str(line.get_gid()).split(":")[0]
        for axes in figure.axes
        for line in axes.lines
        if "branch 0" in str(line.get_gid()) and is_drawn(np.asarray(line.get_ydata(), float))
    }
    assert seen == {f"branch 0 {OPEN}"}
    words = {one.get_text() for legend in figure.legends for one in legend.get_texts()}
    assert OPEN in words
    path = tmp_path / "b.h5"
    nsdrill.save(data, path)
    from nsdrill.web.branch_curves import read_branches

    assert OPEN in read_branches(path).name_of(1)

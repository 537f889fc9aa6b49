"""Points where textbook labels do not apply: a system that conserves energy there, and
several eigenvalues that cross at once."""

import numpy as np
import pytest

import nsdrill
from nsdrill.analysis.bifurcations import BRANCH, END, HOPF, UNKNOWN
from nsdrill.models import registry
from nsdrill.text.branch_text import AT_ONE_VALUE, lines, summarize_branches


def van_der_pol(x=0.1, v=0.0, *, mu=0.5):
    """At mu = 0 all amplitudes repeat; from mu > 0 on that of 2 is there at once."""
    return v, mu * (1 - x**2) * v - x


def ring(x=0.01, y=0.0, *, mu=-0.5):
    """A pitchfork in all directions: two real eigenvalues cross at once."""
    r = x * x + y * y
    return mu * x - x * r, mu * y - y * r


def four(x=0.01, vx=0.0, y=0.0, vy=0.01, *, mu=-0.5):
    """Two pairs that cross at once, and grow."""
    r = x * x + y * y
    return vx, (mu - r) * vx - x, vy, (mu - r) * vy - y


@pytest.fixture
def branches_of():
    made = []

    def branches(equations, seeds):
        made.append(equations.__name__)
        study = nsdrill.model(equations).study(continued={"mu": (-0.5, 1.0), "seeds": seeds}, transient=100)
        return nsdrill.continue_branches(study, progress=False)

    yield branches
    for name in made:
        registry.withdraw(name)


def test_what_grows_where_energy_is_conserved_is_not_known(branches_of):
    data = branches_of(van_der_pol, [-0.3])
    labels = data["label"].values
    assert set(labels.tolist()) <= {0, HOPF, END}  # no folds of a line at one value of the number
    (hopf,) = np.flatnonzero(labels == HOPF)
    assert data["criticality"].values[hopf] == UNKNOWN
    found = summarize_branches(data)
    text = " ".join("\n".join(lines("vdp.h5", found, "si", everything=True)).split())
    assert "sub- or supercritical is not known" in text
    assert "grows from zero" not in text
    family = found["branches"][1]
    assert family["at_one_value"]
    assert family["stable"] == []
    assert AT_ONE_VALUE in text


@pytest.mark.parametrize(("equations", "label"), [(ring, BRANCH), (four, HOPF)])
def test_several_at_once_are_labelled(branches_of, equations, label):
    data = branches_of(equations, [-0.3])
    first = data["branch_of_point"].values == 0
    labels, at = data["label"].values[first], data["parameters_mu"].values[first]
    assert at[labels == label] == pytest.approx(0.0, abs=1e-6)
    assert summarize_branches(data)["branches"][0]["stable"] == [pytest.approx([-0.5, 0.0], abs=1e-6)]

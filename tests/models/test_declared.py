"""What a model declares once, and what follows from it."""

import pytest

from nsdrill.models.leaves import Values, lane_values, lanes_of, value_of
from nsdrill.models.registry import BY_NAME, NAMES, described
from nsdrill.models.responses import RESPONSES, Thresholds
from nsdrill.observe.channels import Mean, TimeAbove, measured_by
from nsdrill.study import parse_study
from nsdrill.study.study import digest, study_from_resolved
from nsdrill.variables import feature


@pytest.mark.parametrize("name", NAMES)
def test_numbers_are_lane_parameters_under_the_names_they_declare(name: str) -> None:
    model = described(name)
    parameters, operation = model.parameters(), model.operation()
    dynamics, names = model.dynamics, model.dynamics.names(model.dynamics.variant(parameters)).parameters
    points = Values(parameters, model.initial(), (operation.depth, operation.wob, operation.rotary_speed))
    (row,) = dynamics.pack(points, Thresholds())
    assert set(lanes_of(model.parameters)) <= set(names)
    assert lane_values(parameters) == {one: row[names.index(one)] for one in lanes_of(model.parameters)}


def test_every_response_has_its_threshold_bounds_and_variables() -> None:
    assert [response.bit for response in RESPONSES.values()] == [1, 2, 4]  # as in files of every version
    for response in RESPONSES.values():
        section = getattr(Thresholds(), response.name)
        assert getattr(section, response.feature) > 0.0
        bounds = response.bounds_in(Thresholds())
        assert list(bounds) == sorted(bounds)
        assert len(response.bands) == len(bounds) + 1 == len(response.severity.flag_values or ())
        assert {response.feature, response.graded, response.severity.name} <= set(BY_NAME)


def test_a_record_is_measured_unless_a_feature_of_that_name_is_declared() -> None:
    records = [
        feature("mean_a", "m", "mean of a", measure=Mean("a")),
        feature("mean_b", "m", "mean of b", measure=Mean("b")),
        feature("above_c", "1", "time above c", "option", measure=TimeAbove("c")),
        feature("derived", "1", "measured elsewhere"),
    ]
    own = [Mean("another", "mean_b")]
    assert measured_by(records, own) == [Mean("a", "mean_a")]
    assert measured_by(records, own, ("option",)) == [Mean("a", "mean_a"), TimeAbove("c", "above_c")]


def test_a_study_from_before_a_number_keeps_its_digest() -> None:
    """``mud.swirl`` was not there at first; 0, its default, changes nothing."""
    now = parse_study("title: now\n")
    assert value_of(now.parameters, "mud.swirl") == 0.0
    before = {**now.resolved, "mud": {key: value for key, value in now.resolved["mud"].items() if key != "swirl"}}
    assert study_from_resolved(before).parameters == now.parameters
    assert digest(before) == now.sha256
    swirling = {**now.resolved, "mud": {**now.resolved["mud"], "swirl": 0.5}}
    assert digest(swirling) != now.sha256
    with pytest.raises(Exception, match="density"):  # a number of the physics that has always been there
        study_from_resolved({**before, "mud": {"added_mass": 1.7}})

"""Where steady drilling of a string of segments is unstable, a run that starts in it may last longer
than it is observed: nothing is allowed there all the same."""

import nsdrill

STUDY = """
model: segments
operation: {wob: 100 kN}
segments: {pipe: 4, collar: 2, hydraulics: {pulsation: 0 l/min}}
bit: {surface_amplitude: %s}
drive: {kind: ideal}
sweep: {rotary_speed: [24 rad/s, 28 rad/s, 36 rad/s], procedure: same}
simulation: {transient: 30 s, observe: 30 s}
"""


def test_a_run_that_rests_where_steady_drilling_is_unstable_is_not_allowed():
    onset = nsdrill.check(STUDY % "0 mm").figures["stick_slip_onset"].value
    assert 28.0 < onset < 36.0
    data = nsdrill.run(STUDY % "0 mm", progress=False)
    assert not data.response.values.any()  # too short to see it grow
    found = nsdrill.window(data)
    assert found["grades"] == {"steady drilling unstable": 2, "safe from a quick start only": 1}
    assert any(one.startswith("STEADY DRILLING IS UNSTABLE") for one in found["answer"]["warnings"])


def test_lobes_kick_the_bit_out_of_it():
    """Started 0.1 rad/s slower than it is driven, it sticks below the onset of a flat rock."""
    text = STUDY.replace("transient: 30", "transient: 300") % "1 mm"
    data = nsdrill.run(text, set={"initial.bit_speed": "23.9 rad/s"}, progress=False)
    assert data.stick_slip_index.values[:2].min() > 100.0
    found = nsdrill.window(nsdrill.run(STUDY % "1 mm", progress=False))
    assert found["grades"] == {"critical": 1, "steady drilling unstable": 2}
    assert found["stick_slip"]["settings"][0]["unstable"]

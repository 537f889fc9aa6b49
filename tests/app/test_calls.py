"""What a run costs besides its steps: calls of the functions of the package."""

import sys
import threading
from collections import Counter
from pathlib import Path

import nsdrill

STUDY = "sweep: {rotary_speed: [13 rad/s]}\nsimulation: {transient: 0 s, observe: 1 s}\n"


def test_nothing_is_found_again_and_again():
    """From the text of a study of one point to its results, where all is compiled: 3,600
    calls. What follows from the plan, the model and the description is found once."""
    nsdrill.run(STUDY, workers=1)
    folder, calls = str(Path(nsdrill.__file__).parent), Counter()

    def count(frame, event, argument):
        if event == "call" and frame.f_code.co_filename.startswith(folder):
            calls[frame.f_code.co_qualname] += 1

    before = sys.getprofile()
    threading.setprofile(count)
    sys.setprofile(count)
    try:
        nsdrill.run(STUDY, workers=1)
    finally:
        sys.setprofile(before)
        threading.setprofile(None)
    assert calls["Work.program"] <= 2
    assert calls["Work.compiled_axes"] <= 4
    assert calls["of_all"] <= 10
    assert calls["described"] <= 20
    assert calls["names_of"] == 0
    assert calls.total() < 4000

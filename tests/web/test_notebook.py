"""The explorer from Python."""

import re
import urllib.request

import pytest

import nsdrill


def test_a_notebook_shows_the_explorer_in_a_frame(shared):
    with nsdrill.view(shared / "small.h5", height=700) as view:
        found = re.fullmatch(
            r'<iframe src="(http://127\.0\.0\.1:\d+/#[\w-]+)" .*height="700".*></iframe>', view._repr_html_()
        )
        assert found
        assert found[1] == view.url
        assert view.url in repr(view)
        with urllib.request.urlopen(view.url, timeout=10) as page:
            assert b"nsdrill" in page.read()
            assert "frame-ancestors" in page.headers["Content-Security-Policy"]
    assert repr(view) == "The explorer of small.h5, closed"
    assert "iframe" not in view._repr_html_()
    with pytest.raises(OSError, match="refused"):
        urllib.request.urlopen(view.url, timeout=10)


def test_wrong_arguments(shared):
    with pytest.raises(nsdrill.InputError, match="height"):
        nsdrill.view(shared / "small.h5", height=3)
    with pytest.raises(nsdrill.InputError, match="unit"):
        nsdrill.view(shared / "small.h5", units="rods")
    with pytest.raises(nsdrill.FileError):
        nsdrill.view(shared / "nothing.h5")
    with pytest.raises(nsdrill.InputError, match="Save them first"), nsdrill.open_results(shared / "small.h5") as found:
        nsdrill.view(found)
    with pytest.raises(nsdrill.InputError):
        nsdrill.view(shared / "small.yaml", set={"operation.wob": "3 mm"})

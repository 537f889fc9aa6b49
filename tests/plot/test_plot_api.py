"""What a caller of the room meets: kinds, errors, files."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from made_up import make_results

from nsdrill import plot
from nsdrill.data import Results, Trace
from nsdrill.errors import InputError
from nsdrill.plot.registry import choose_kind
from nsdrill.variables import DIVERGED, PENDING


def test_default_kinds(speeds: Results, plane: Results, trace: Trace) -> None:
    assert plot.kinds_for(speeds)[:2] == ("bifurcation", "value")
    assert plot.kinds_for(plane)[:2] == ("map", "value")
    values = ("stick_slip_index", "lift_off", "wall_contact", "whirl_ratio", "radius")
    for name in (*values, "bit_force_max"):  # by name, though not in the list
        assert choose_kind(plane, name)[0].part_of == "value"
    assert plot.kinds_for(trace) == ("trace", "histories", "hole")
    for name in ("orbit", "phase", "section"):
        assert choose_kind(trace, name)[0].part_of == "trace"
    assert plot.kinds_for(make_results())[0] == "bifurcation"  # one point: its peaks


def test_few_values_of_a_second_axis_stand_side_by_side() -> None:
    two = make_results(wob=(22240.0, 66720.0), rotary_speed=np.linspace(1, 8, 9))
    assert plot.kinds_for(two)[0] == "bifurcation"
    assert "map" in plot.kinds_for(two)
    titles = [axes.get_title() for axes in plot.draw(two).axes]
    assert {"Weight on bit: 22.24 kN", "Weight on bit: 66.72 kN"} <= set(titles)


def test_unknown_kind_lists_the_kinds_with_a_line_each(speeds: Results) -> None:
    with pytest.raises(InputError) as caught:
        plot.draw(speeds, "bifurcatoin")
    message = str(caught.value)
    assert "Did you mean 'bifurcation'?" in message
    for kind in plot.kinds_for(speeds):
        assert f"{kind} " in message
        assert plot.all_kinds()[kind].words in message


@pytest.mark.parametrize("kind", ["bifurcation", "summary", "orbit"])
def test_kind_that_does_not_fit_says_what_would(plane: Results, kind: str) -> None:
    with pytest.raises(InputError, match=r"does not fit a sweep over depth .* and rotary_speed") as caught:
        plot.draw(plane, kind)
    assert "panel='NAME'" in str(caught.value) or "panel NAME" in str(caught.value)


def test_a_cut_of_a_map_is_a_bifurcation_diagram(plane: Results) -> None:
    figure = plot.draw(plane, "bifurcation", at={"depth": 500.0})
    assert "500 m" in figure.get_suptitle()
    assert "500 m" in plot.draw(plane, "bifurcation", at={"depth": 510.0}).get_suptitle(), "the nearest one"
    with pytest.raises(InputError, match="as the sweep, of which the nearest value is drawn"):
        plot.draw(plane, "bifurcation", at={"depth": 20e3})
    with pytest.raises(InputError, match="allowed: depth, wob, rotary_speed"):
        plot.draw(plane, at={"mud": 1.0})


def test_unknown_unit_system(speeds: Results) -> None:
    with pytest.raises(InputError, match="allowed: si, field"):
        plot.draw(speeds, units="metric")


@pytest.mark.usefixtures("laid_out")
@pytest.mark.parametrize("status", [DIVERGED, PENDING])
def test_nothing_to_draw_is_still_a_picture(speeds: Results, plane: Results, status: int) -> None:
    for data in (speeds, plane):
        data["status"][:] = status
        for v in data.variables.values():
            if v.dtype.kind == "f":
                v[:] = np.nan
        for kind in ("bifurcation", "summary") if data is speeds else ("map", "stick_slip_index"):
            plot.draw(data, kind)


@pytest.mark.usefixtures("laid_out")
def test_bytes_as_procedure_names_and_a_title_with_dollars(speeds: Results) -> None:
    speeds.coords["procedure"] = np.array([b"up", b"down"])
    speeds.attrs["title"] = "A $50 rig_1^2 & more"
    assert plot.draw(speeds).get_suptitle().startswith("A $50 rig_1^2 & more\n5000 m, 22.24 kN")


@pytest.mark.parametrize("suffix", [".png", ".pdf", ".svg"])
def test_same_bytes_every_time(speeds: Results, plane: Results, tmp_path: Path, suffix: str) -> None:
    data = plane if suffix == ".svg" else speeds
    first, second, third = (tmp_path / f"{name}{suffix}" for name in "abc")
    figure = plot.draw(data)
    plot.save(figure, first)
    plot.save(figure, second)
    plot.save(plot.draw(data), third)
    assert first.read_bytes() == second.read_bytes() == third.read_bytes()
    assert {path.name for path in tmp_path.iterdir()} == {first.name, second.name, third.name}


def test_same_bytes_in_another_process(tmp_path: Path) -> None:
    script = (
        "import sys; sys.path[:0] = [sys.argv[1], sys.argv[1] + '/..']\n"
        "from made_up import make_trace; from nsdrill import plot;"
        "plot.save(plot.draw(make_trace(5.0), 'phase'), sys.argv[2]); print('matplotlib.pyplot' "
        "in sys.modules)"
    )
    for number in range(2):
        path = tmp_path / f"{number}.svg"
        out = subprocess.run(
            [sys.executable, "-c", script, str(Path(__file__).parent), str(path)],
            check=True,
            capture_output=True,
            text=True,
            env={"PYTHONHASHSEED": str(number), "PATH": "", "PYTHONPATH": os.environ.get("PYTHONPATH", "")},
        )
        assert out.stdout.strip() == "False", "pyplot was imported"
    assert (tmp_path / "0.svg").read_bytes() == (tmp_path / "1.svg").read_bytes()


def test_asking_for_kinds_imports_no_matplotlib() -> None:
    script = "import sys, nsdrill.plot; sys.exit('matplotlib' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", script], check=False).returncode == 0


def test_text_stays_text(speeds: Results, tmp_path: Path) -> None:
    figure = plot.draw(speeds)
    plot.save(figure, tmp_path / "a.svg")
    plot.save(figure, tmp_path / "a.pdf")
    assert "Rotary speed [rad/s]" in (tmp_path / "a.svg").read_text(encoding="utf-8")
    # TrueType, not the outlines of Type 3
    assert b"/CIDFontType2" in (tmp_path / "a.pdf").read_bytes()
    assert b"CreationDate" not in (tmp_path / "a.pdf").read_bytes()


def test_refused_files(trace: Trace, tmp_path: Path) -> None:
    figure = plot.draw(trace, "orbit")
    for name in ("a.jpg", "a", "a.h5"):
        with pytest.raises(InputError, match=r"allowed: \.png, \.pdf, \.svg"):
            plot.save(figure, tmp_path / name)
    with pytest.raises(InputError, match="no folder"):
        plot.save(figure, tmp_path / "nowhere" / "a.png")
    (tmp_path / "folder.png").mkdir()
    with pytest.raises(InputError, match="cannot be written"):
        plot.save(figure, tmp_path / "folder.png")
    assert [path.name for path in tmp_path.iterdir()] == ["folder.png"]


def test_upper_case_suffix_and_an_old_picture_replaced(trace: Trace, tmp_path: Path) -> None:
    path = tmp_path / "A.PNG"
    path.write_bytes(b"old")
    plot.save(plot.draw(trace, "orbit"), path)
    assert path.read_bytes().startswith(b"\x89PNG")

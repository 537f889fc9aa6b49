"""How a picture looks: the user has the last word on size, type, title and style; long
titles are broken; the palette is told apart by every reader."""

import itertools
import json
from itertools import combinations
from typing import Any

import matplotlib as mpl
import numpy as np
import pytest
from made_up import make_results, make_trace
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from seen import artists

from nsdrill import figures
from nsdrill.analysis.attractors import Attractor
from nsdrill.data import Results
from nsdrill.errors import InputError
from nsdrill.figures import look_of
from nsdrill.figures.kinds.basin import distinct_colours
from nsdrill.figures.look import value_of
from nsdrill.figures.page import panels_of
from nsdrill.figures.style import (
    ANY_HISTORY_COLOUR,
    BORDERLINE_COLOUR,
    GREY,
    MOTIONS,
    REFERENCE,
    RESPONSES,
    SAFE_COLOUR,
    contrast,
    lightness_and_hue,
)
from nsdrill.models.responses import STALLED
from nsdrill.variables import DIVERGED, OK, PENDING

SINGLE = RESPONSES[: STALLED + 1]  # of one run, which has no other response where it is stalled


def words_of(figure: Any) -> list[Any]:
    """All text with something in it that is seen, but for ticks, some of which lie
    beyond the limits."""
    ticks = {label for axes in panels_of(figure) for label in (*axes.get_xticklabels(), *axes.get_yticklabels())}
    texts = [text for text in figure.findobj(mpl.text.Text) if text not in ticks]
    found = [text for text in texts if text.get_text().strip() and text.get_visible()]
    return [text for text in found if text.get_window_extent().width > 0]


def both_ways() -> Results:
    return make_results(depth=np.linspace(500, 9000, 9), rotary_speed=np.linspace(1, 8, 15), procedures=("up", "down"))


@pytest.mark.usefixtures("laid_out")
@pytest.mark.parametrize(
    ("data", "kind", "width", "size"),
    [
        *(("speeds", kind, "3.3in", 7) for kind in ("bifurcation", "summary", "window", "lift_off")),
        *(("maps", kind, "84mm", None) for kind in ("map", "whirl_kind", "window", "stick_slip_index")),
        *(("trace", kind, "3.3in", None) for kind in ("trace", "histories", "orbit", "phase", "section")),
    ],
)
def test_a_picture_fits_one_column(speeds, trace, data, kind, width, size):
    """The figure is as wide as asked for, every panel has room, no two panels and no
    words leave the page."""
    drawn = {"speeds": speeds, "maps": both_ways(), "trace": trace}[data]
    figure = figures.draw(drawn, kind, look=look_of(width=width, font_size=size))
    assert figure.get_figwidth() == pytest.approx(84 / 25.4 if width == "84mm" else 3.3, rel=1e-6)
    for axes in panels_of(figure):
        box = axes.get_window_extent()
        assert box.width > 0.25 * figure.bbox.width or axes.get_label() == "<colorbar>"
        assert 0 <= box.x0 < box.x1 <= figure.bbox.width + 1
    for text in words_of(figure):
        box = text.get_window_extent()
        assert box.x0 > -2, text
        assert box.x1 < figure.bbox.width + 2, text


@pytest.mark.usefixtures("laid_out")
def test_height_and_size_of_type(speeds):
    figure = figures.draw(speeds, "summary", look=look_of(height=0.1, font_size="10pt"))
    assert figure.get_figheight() == pytest.approx(0.1 / 0.0254)
    plain = figures.draw(speeds, "summary")
    sizes = [{text.get_fontsize() for text in words_of(one)} for one in (figure, plain)]
    assert len(sizes[1]) > 2
    assert sorted(size * 10 / 8 for size in sizes[1]) == pytest.approx(sorted(sizes[0]))


def test_a_line_at_zero_is_like_no_curve(speeds):
    axes = next(axes for axes in figures.draw(speeds, "summary").axes if axes.get_label() == "whirl_ratio")
    styles = {str(line.get_gid()): line.get_linestyle() for line in axes.lines}
    assert styles == {"whirl_ratio:up": "-", "whirl_ratio:down": "--", "zero": ":"}


def test_titles(trace):
    assert figures.draw(trace, "orbit", look=look_of(title=False)).get_suptitle() == ""
    ways = make_results(depth=(1e3, 2e3), rotary_speed=(1.0, 2.0), procedures=("up", "down"))
    maps = figures.draw(ways, "map", look=look_of(title=False))
    assert maps.get_suptitle() == ""
    assert [axes.get_title() for axes in maps.axes] == ["carried up", "carried down", "up and down compared"]
    assert figures.draw(trace, "phase", look=look_of(title="Rolling $x_1$")).get_suptitle() == "Rolling $x_1$"


@pytest.mark.usefixtures("laid_out")
def test_settings_of_the_user_are_respected_and_left_alone(speeds, tmp_path):
    plain = figures.draw(speeds, "summary")
    with mpl.rc_context({"font.size": 12.0, "axes.labelsize": 5.0, "axes.facecolor": "#ffeecc", "savefig.dpi": 50}):
        figure = figures.draw(speeds, "summary")
        assert mpl.rcParams["font.size"] == 12.0
    (axes,) = figure.axes[-1:]
    assert axes.yaxis.label.get_fontsize() == 5.0
    assert axes.get_facecolor() == mpl.colors.to_rgba("#ffeecc")
    assert axes.get_xticklabels()[0].get_fontsize() == pytest.approx(12.0 * 7 / 8), "in the proportion of the house"
    figures.save(figure, tmp_path / "a.png")
    assert mpl.image.imread(tmp_path / "a.png").shape[1] == pytest.approx(7.0 * 50, abs=1)
    assert plain.axes[-1].yaxis.label.get_fontsize() == 8.0


def test_a_style_file(trace, tmp_path):
    path = tmp_path / "journal.mplstyle"
    path.write_text("figure.figsize: 3.5, 2.6\nfont.size: 9\naxes.linewidth: 2.0\n")
    figure = figures.draw(trace, "histories", look=look_of(style=path))
    assert figure.get_figwidth() == 3.5
    assert panels_of(figure)[0].spines["left"].get_linewidth() == 2.0
    assert panels_of(figure)[0].xaxis.label.get_fontsize() == 9.0
    smaller = figures.draw(trace, "histories", look=look_of(style=path, font_size=6, width="5in"))
    assert smaller.get_figwidth() == pytest.approx(5.0)
    assert panels_of(smaller)[0].yaxis.label.get_fontsize() == 6.0
    assert figures.draw(trace, "orbit", look=look_of(style={"axes.linewidth": 3.0})).axes[0].spines[
        "left"
    ].get_linewidth() == pytest.approx(3.0)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"width": "3.3"}, "width: found '3.3', a number without a unit"),
        ({"width": "3 kN"}, "width"),
        ({"width": "1 km"}, r"width: found 3\.937e\+04 in; allowed: 1 in to 40 in"),
        ({"height": 0.0}, "height: found 0 in"),
        ({"font_size": "large"}, "font_size: found 'large'; allowed: points"),
        ({"font_size": 1}, "font_size: found 1; allowed: points, 3 to 40"),
        ({"style": "no_such.mplstyle"}, "style: found 'no_such.mplstyle', which is no file; allowed: .*ggplot"),
        ({"style": {"font.sise": 3}}, "style: .*font.sise"),
        ({"style": {"font.size": "much"}}, "style: "),
        ({"xlim": (1.0,)}, "xlim: found .*; allowed: two values"),
        ({"title": 3}, "title: found 3"),
    ],
)
def test_wrong_looks_are_told(given, message):
    with pytest.raises(InputError, match=f"(?s){message}"):
        look_of(**given)


@pytest.mark.parametrize("text", ["font.sise: 3\n", "font.size: much\n", "nothing at all\n", "", "\x00\xff\n"])
def test_faults_of_a_style_file_are_told(tmp_path, text, capsys):
    path = tmp_path / "a.mplstyle"
    path.write_bytes(text.encode("latin-1"))
    with pytest.raises(InputError, match=r"style .*a\.mplstyle: "):
        look_of(style=path)
    assert capsys.readouterr().err == ""


def test_a_logarithmic_axis_begins_above_zero():
    """That of speeds of equal ratios."""
    geometric = make_results(rotary_speed=np.geomspace(1, 8, 12), procedures=("up", "down"))
    figure = figures.draw(geometric, "bifurcation", look=look_of(xlim=(0.5, 5.0)))
    assert {axes.get_xscale() for axes in figure.axes} == {"log"}
    with pytest.raises(InputError, match=r"xlim: found 0.* on a logarithmic axis; allowed: above zero"):
        figures.draw(geometric, "bifurcation", look=look_of(xlim=(0.0, 5.0)))


def test_limits_of_a_sweep(speeds):
    figure = figures.draw(speeds, "bifurcation", look=look_of(xlim=("30 rpm", "50 rpm")))
    low, high = 30 * np.pi / 30, 50 * np.pi / 30
    for axes in figure.axes:
        assert axes.get_xlim() == pytest.approx((low, high))
    inside = speeds["bit_speed_peaks"][:, 0, 0][:, (speeds["rotary_speed"] > low) & (speeds["rotary_speed"] < high)]
    shown = figure.axes[2].get_ylim()
    assert shown[1] < 1.3 * np.nanmax(inside), "the other axis fits what is seen"


def test_limits_of_a_map_and_of_the_window(plane):
    figure = figures.draw(plane, "stick_slip_index", look=look_of(xlim=(3.0, 5.0)))
    assert figure.axes[0].get_xlim() == pytest.approx((3.0, 5.0))
    whole, part = (figures.draw(plane, "window", look=look_of(xlim=ends)) for ends in (None, (3.0, 5.0)))
    texts = [[text.get_text() for text in one.legends[0].get_texts()] for one in (whole, part)]
    assert texts[0] == texts[1], "what the window says is of the whole sweep"
    assert part.axes[0].get_xlim() == pytest.approx((3.0, 5.0))


def test_a_part_of_a_trace(trace):
    for given in ({"time": ("20 s", "24 s")}, {"xlim": (20.0, 24.0)}):
        figure = figures.draw(trace, "histories", look=look_of(**given))
        line = panels_of(figure)[0].lines[0]
        assert line.get_xdata()[[0, -1]] == pytest.approx((20.0, 24.0))
    orbit = figures.draw(trace, "orbit", look=look_of(time=("20 s", None)))
    assert "20 to 60 s" in orbit.axes[0].get_title()


@pytest.mark.parametrize(
    ("kind", "given", "message"),
    [
        ("orbit", {"xlim": (0.0, 1.0)}, "xlim: found with kind='orbit', whose panels have no x axis in common"),
        ("phase", {"time": ("90 s", "95 s")}, "times with two samples or more between them, of 0 s to 59.995 s"),
        ("phase", {"time": ("9 s", "5 s")}, "time: found 9 s to 5 s; allowed: the lower end first"),
        ("phase", {"time": ("9 m", "5 s")}, "time: "),
        ("value", {"time": (0, 1)}, "time: found with results"),
        ("value", {"xlim": (20.0, 30.0)}, "xlim: found 20 rad/s to 30 rad/s; allowed: .* of 1 rad/s to 8 rad/s"),
        ("value", {"xlim": ("3 kN", "4 kN")}, "xlim: "),
    ],
)
def test_wrong_limits_are_told(speeds, trace, kind, given, message):
    with pytest.raises(InputError, match=message):
        figures.draw(speeds if kind == "value" else trace, kind, look=look_of(**given))


def test_a_look_is_of_one_picture(speeds):
    figures.draw(speeds, "summary", look=look_of(width="3.3in", title=False))
    assert figures.draw(speeds, "summary").get_figwidth() == 7.0
    assert figures.draw(make_trace(5.0), "orbit").get_suptitle()


def test_an_axis_without_a_unit_is_limited_by_numbers():
    assert value_of("xlim", "0.35", "") == 0.35
    with pytest.raises(InputError, match=r"xlim: found '3 m'; allowed: a number, as this axis has no unit"):
        value_of("xlim", "3 m", "")


@pytest.mark.usefixtures("laid_out")
@pytest.mark.parametrize("size", [8, 12, 16])
def test_labels_above_each_other_have_room_in_large_type(speeds, size):
    figure = figures.draw(speeds, look=look_of(width="3.3in", font_size=size))
    figure.draw_without_rendering()
    boxes = sorted(
        (axes.yaxis.label.get_window_extent() for axes in figure.axes if axes.get_ylabel()), key=lambda b: b.y0
    )
    assert len(boxes) == 3
    assert all(below.y1 < above.y0 for below, above in itertools.pairwise(boxes))


LONG: dict[str, Any] = {
    "title": "A STRING WITH MUCH TO SAY ABOUT ITSELF " * 6,
    "study_overrides": json.dumps(["drillstring.axial_damping=5 kN*s/m", "mud.density=1400 kg/m^3", "bit.lobes=1"] * 9),
    "study_resolved": json.dumps({"drive": {"kind": "soft_torque"}, "modes": {"axial": "frozen"}}),
    "at": json.dumps({"bit.rock_stiffness": 25e6, "mud.density": 1400.0, "well.friction.static": 0.3}),
}


@pytest.mark.usefixtures("laid_out")
@pytest.mark.parametrize(
    ("make", "kind"),
    [
        *((make_trace, kind) for kind in ("trace", "histories", "orbit", "phase", "section")),
        *((make_results, kind) for kind in ("bifurcation", "summary", "window")),
    ],
)
def test_no_line_is_wider_than_its_figure(make, kind):
    data = make(rotary_speed=(2.0, 3.0)) if make is make_results else make()
    data.attrs |= LONG
    figure = figures.draw(data, kind)
    extent = figure._suptitle.get_window_extent()
    assert 0.0 <= extent.x0 < extent.x1 <= figure.bbox.width
    words = " ".join(figure.get_suptitle().split())
    assert words.startswith(LONG["title"].strip())
    assert "soft torque drive; axial motion frozen" in words


def test_each_colour_of_a_legend_means_one_thing():
    """Pictures of the kind of motion have the responses in the same legend. Black is a
    dash at an equilibrium. Stalled has its colour whatever occurs beside it."""
    colours = [style.colour for style in (*SINGLE, *MOTIONS) if style.marker != "_"]
    assert len(set(colours)) == len(colours)
    assert {style.colour for style in RESPONSES[STALLED:]} == {RESPONSES[STALLED].colour}


def test_what_the_title_says_is_not_said_again():
    data = make_results(rotary_speed=(2.0, 3.0))
    data.attrs["title"] = "Speeds at 5000 m, state carried"
    assert figures.draw(data).get_suptitle().splitlines() == ["Speeds at 5000 m, state carried", "22.24 kN"]
    data.attrs["title"] = "Speeds at 15000 m and 22.24 kN/m"
    assert figures.draw(data).get_suptitle().splitlines()[1] == "5000 m, 22.24 kN", "other values are no repetition"


@pytest.mark.parametrize("units", ["si", "field"])
def test_the_words_of_the_user_are_never_changed(units):
    """Values of a title stay in its units, and are known to be those of the sweep."""
    data = make_results(rotary_speed=(2.0, 3.0))
    data.attrs["title"] = "My study at 5 klbf and 16404.2 ft, and 15 klbf"
    title, *more = figures.draw(data, units=units).get_suptitle().splitlines()
    assert title == data.attrs["title"]
    assert not more, "5 klbf is 22.24 kN, and 16404.2 ft are 5000 m"


def test_what_the_axes_show_is_no_line_of_the_title():
    data = make_results(rotary_speed=(2.0, 3.0))
    data.attrs["study_overrides"] = json.dumps(["sweep.wob.points=5", "bit.lobes=1"])
    assert figures.draw(data).get_suptitle().splitlines()[1] == "bit.lobes = 1"


def test_characters_that_no_font_has_are_known_and_warned_of_once(recwarn):
    trace = make_trace(5.0)
    assert figures.draw(trace, "orbit").missing == ""
    trace.attrs["title"] = "A title with \U0001f9e8\u5fd9 and words"
    figure = figures.draw(trace, "orbit")
    assert "\U0001f9e8" in figure.missing
    assert "A" not in figure.missing
    assert figure._repr_png_()
    assert not [one for one in recwarn if "Glyph" in str(one.message)]


@pytest.mark.parametrize(("status", "words"), [(DIVERGED, "9 of 9 failed)"), (PENDING, "0 of 9 failed, 9 not run yet")])
def test_a_picture_with_nothing_on_it_says_so(status, words):
    data = make_results(rotary_speed=np.linspace(1, 8, 9))
    data["status"][:] = status
    for kind in ("bifurcation", "summary", "lift_off", "window"):
        found = [text.get_text() for axes in figures.draw(data, kind).axes for text in axes.texts]
        assert any("no point ended well" in text and words in text for text in found), kind
    data["status"][..., 0] = OK
    assert not any("ended well" in t.get_text() for axes in figures.draw(data).axes for t in axes.texts)


# Machado, Oliveira & Fernandes (2009), full severity, on linear sRGB.
VISION = {
    "normal": np.eye(3),
    "protanopia": [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]],
    "deuteranopia": [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.01182, 0.04294, 0.968881]],
    "tritanopia": [[1.255528, -0.076749, -0.178779], [-0.078411, 0.930809, 0.147602], [0.004733, 0.691367, 0.3039]],
}
# sRGB, D65
TO_XYZ = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])
WHITE = np.array([0.9505, 1.0, 1.089])


def lab(colour: str, vision: str) -> np.ndarray:
    rgb = np.array([int(colour[i : i + 2], 16) for i in (1, 3, 5)]) / 255
    linear = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
    xyz = TO_XYZ @ np.clip(np.asarray(VISION[vision]) @ linear, 0, 1) / WHITE
    x, y, z = np.where(xyz > 0.008856, np.cbrt(xyz), 7.787 * xyz + 16 / 116)
    return np.array([116 * y - 16, 500 * (x - y), 200 * (y - z)])


@pytest.mark.parametrize("vision", VISION)
def test_responses_differ_in_colour(vision):
    """At least 13 CIELAB units; 2.3 is the least difference that people notice (Mahy et
    al. 1994)."""
    for one, other in combinations(SINGLE, 2):
        distance = np.linalg.norm(lab(one.colour, vision) - lab(other.colour, vision))
        assert distance > 13, f"{one.name} and {other.name} look alike under {vision}"


@pytest.mark.parametrize("vision", VISION)
def test_the_classes_of_a_window_differ_in_colour(vision):
    """What is allowed, after any history or not, and what is borderline, from each other
    and from every response; at least 13 CIELAB units as above."""
    own = (SAFE_COLOUR, ANY_HISTORY_COLOUR, BORDERLINE_COLOUR)
    for one in own:
        for other in {*own, *(style.colour for style in SINGLE), GREY} - {one}:
            assert np.linalg.norm(lab(one, vision) - lab(other, vision)) > 13, (one, other)


def test_responses_differ_in_shape_and_name():
    assert len({style.marker for style in SINGLE}) == len(SINGLE) == 9
    assert len({style.name for style in RESPONSES}) == 16
    assert len({style.letters for style in RESPONSES}) == len(RESPONSES) == 16


def test_a_dark_page_is_refused(speeds):
    with pytest.raises(InputError, match=r"^style: found a dark page; allowed: a light one"):
        figures.draw(speeds, look=look_of(style="dark_background"))
    with mpl.rc_context({"axes.facecolor": "black"}), pytest.raises(InputError, match=r"^style: found a dark page"):
        figures.draw(speeds)
    axes = Figure().subplots()
    axes.set_facecolor("#303030")
    with pytest.raises(InputError, match=r"^ax: found a dark page"):
        figures.draw(speeds, panel="radius", ax=axes)


def test_a_light_page_keeps_its_colours(speeds):
    for style in ("ggplot", "bmh", "tableau-colorblind10"):
        figure = figures.draw(speeds, look=look_of(style=style))
        colours = {line.get_color() for axes in figure.axes for line in axes.lines}
        assert colours <= {*(one.colour for one in RESPONSES), "k", REFERENCE}


def test_basins_have_colours_that_can_be_told_apart():
    """Eight attractors of one response, which were eight tints of one colour, by their
    distances in CIE L*a*b*, in which 2.3 can just be told apart side by side."""
    attractors = [Attractor(number, 5, {}, None, None, 10, 0, 0.1, 0.05, 0.2, {}) for number in range(1, 9)]
    colours = distinct_colours(attractors, RESPONSES)
    places = [lightness_and_hue(colour) for colour in colours]
    distances = [np.linalg.norm(a - b) for a, b in combinations(places, 2)]
    assert colours[0] == RESPONSES[5].colour
    assert min(distances) > 25
    assert lightness_and_hue("#FFFFFF") == pytest.approx([100, 0, 0], abs=0.1)


@pytest.mark.usefixtures("laid_out")
def test_a_picture_without_room_for_its_panels_is_refused(speeds):
    """In place of words that cover each other; one panel alone has room."""
    words = "^height: found a picture of 3 by 2.6 in, in which title, labels and legend leave no room"
    small = look_of(width="3 in", height="2.6 in")
    with pytest.raises(InputError, match=words):
        figures.draw(speeds, look=small)
    axes = figures.draw(speeds, panel="radius_peaks", look=small).axes[0]
    assert axes.get_window_extent().height > 0.2 * axes.figure.dpi


def test_what_is_pale_is_seen_behind_the_others(branches, speeds):
    """The peaks of a sweep lie below the lines of branches."""
    figure = figures.draw(branches, over=speeds)
    axes = figure.axes[-1]
    page = np.array(to_rgb(axes.get_facecolor()))
    colours = {name: artists(axes, name)[0].get_color() for name in ("sweep:up:0", "branch 0 stable:periodic")}
    assert min(colours, key=lambda name: contrast(np.array(to_rgb(colours[name])), page)) == "sweep:up:0"
    (handle,) = (one for one in figure.legends[0].legend_handles if one.get_label() == "all peaks of the sweep, up")
    assert to_rgb(handle.get_color()) == to_rgb(colours["sweep:up:0"])


def test_a_page_without_colour_is_white(speeds):
    figure = figures.draw(speeds, look=look_of(style={"figure.facecolor": "none", "axes.facecolor": "none"}))
    assert {text.get_color() for text in figure.legends[0].get_texts()} == {"black"}

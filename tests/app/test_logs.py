"""Logs of rigs: every form in which they come gives the same operating point; what ends a
stretch is counted and told."""

import csv
import io
import re
import shlex
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

import nsdrill
from nsdrill.app.fitting.measured import Reading, read_measured
from nsdrill.app.fitting.tables import read_table
from nsdrill.app.fitting.times import kind_of_time, seconds
from nsdrill.errors import FileError, InputError, naming_options

STUDY = nsdrill.load_study({"title": "a"})
LOGS = Path(__file__).parent / "logs"
RIG = "time [s], -, -, -, rotary_speed [rpm], -, -, -, surface_torque [ft.lbf], -, -, -"
ROWS = 200
HEAD = "time [s],wob [kN],rotary_speed [rpm],surface_torque [kN*m]"
RPM = np.pi / 30


def torque(row):
    """In kN m; a mean of 10, from 9 to 11."""
    return 10.0 + np.sin(0.7 * row)


@pytest.fixture
def read(tmp_path):
    def write(text, encoding="utf-8", study=STUDY, **how):
        path = tmp_path / "log.csv"
        path.write_bytes(text if isinstance(text, bytes) else text.encode(encoding))
        return read_measured(path, study, Reading(**how))

    return write


def log(head, row, below=()):
    return "\n".join([*([head] if head else []), *below, *(row(i) for i in range(ROWS))]) + "\n"


def usual(i):
    return f"{i},176.4,70,{torque(i):.4f}"


def quoted(i):
    return ",".join(f'"{cell}"'.replace(".", ",") for cell in usual(i).split(","))


def clock(i, begin=86300):
    at = (begin + i) % 86400
    return f"{at // 3600:02d}:{at // 60 % 60:02d}:{at % 60:02d}"


def day(i):
    return "2024/02/29" if 86300 + i < 86400 else "2024/03/01"


NAMES = {"RPM": "rotary_speed", "TQ": "surface_torque"}
FORMS = {
    "brackets": (log("time [s],wob [kN],rotary_speed [rpm],surface_torque [kN*m]", usual), {}),
    "parentheses": (log("Time (s),WOB (kN),rotary speed (rpm),surface-torque (kN.m)", usual), {}),
    "without brackets": (log("Time s,WOB kN,Rotary Speed rpm,Surface Torque kN.m", usual), {}),
    "behind a comma": (log('"Time, s","WOB, kN","Rotary speed, rpm","Surface torque, kN.m"', usual), {}),
    "behind a slash": (log("Time / s,WOB/kN,rotary_speed / rpm,surface_torque / kNm", usual), {}),
    "behind an underscore": (
        log("time_s,wob_kN,rotary_speed_rpm,surface_torque_kN_m".replace("kN_m", "kNm"), usual),
        {},
    ),
    "behind in": (
        log(
            "Time in s,WOB in kN,rotary_speed in 1/min,surface_torque in Nm",
            lambda i: f"{i},176.4,70,{1e3 * torque(i):.1f}",
        ),
        {},
    ),
    "second line": (log("TIME,WOB,RPM,TQ", usual, ["s,kN,rpm,kN.m"]), {"rename": NAMES}),
    "second line in brackets": (log("TIME,WOB,RPM,TQ", usual, ["(s),(kN),(rpm),(kN.m)"]), {"rename": NAMES}),
    "options": (
        log("t,WOB,RPM,TQ", usual),
        {"rename": {**NAMES, "t": "time"}, "unit": {"t": "s", "WOB": "kN", "rotary_speed": "c/min", "TQ": "KNM"}},
    ),
    "a unit in the new name": (
        log("t,WOB,RPM,TQ", usual),
        {"rename": {"t": "time [s]", "WOB": "wob [kN]", "RPM": "rotary_speed [rpm]", "TQ": "surface_torque [kN*m]"}},
    ),
    "a wrong head": (
        log("time [s],wob [klbf],rotary_speed [rpm],surface_torque [kN*m]", usual),
        {"unit": {"wob": "kN"}},
    ),
    "units of the rig floor": (
        log(
            "time [s],wob (kdaN),rotary_speed (c/min),surface_torque (KFT-LBS)",
            lambda i: f"{i},17.64,70,{torque(i) / 1.3558179483314:.5f}",
        ),
        {},
    ),
    "pounds": (
        log(
            "time [s],wob (klbs),rotary_speed (RPM),surface_torque (ft.lb)",
            lambda i: f"{i},{176.4 / 4.4482216152605:.5f},70,{torque(i) * 1e3 / 1.3558179483314:.3f}",
        ),
        {},
    ),
    "no head": (log("", usual), {"columns": "time [s], wob [kN], rotary_speed [rpm], surface_torque [kN*m]"}),
    "no head, a list": (
        log("", lambda i: f"{usual(i)},7"),
        {"columns": ["time [s]", "wob [kN]", "rotary_speed [rpm]", "surface_torque [kN*m]", "-"]},
    ),
    "no head, semicolons and decimal commas": (
        log("", lambda i: usual(i).replace(",", ";").replace(".", ",")),
        {"columns": "time [s], wob [kN], rotary_speed [rpm], surface_torque [kN*m]"},
    ),
    "in place of the head": (
        log("a,b,c,d", usual),
        {"columns": "time [s], wob [kN], rotary_speed [rpm], surface_torque [kN*m]"},
    ),
    "Excel in Germany": (
        "sep=;\n" + log("Zeit;Bohrandruck;Drehzahl;Drehmoment", lambda i: usual(i).replace(",", ";").replace(".", ",")),
        {
            "rename": {"Bohrandruck": "wob", "Drehzahl": "rotary_speed", "Drehmoment": "surface_torque"},
            "unit": {"Zeit": "s", "Bohrandruck": "kN", "Drehzahl": "U/min", "Drehmoment": "kNm"},
        },
    ),
    "decimal commas in quotes": (log('"time [s]","wob [kN]","rotary_speed [rpm]","surface_torque [kN*m]"', quoted), {}),
    "points between thousands": (
        log(
            "time [s];wob [N];rotary_speed [rpm];surface_torque [kN*m]",
            lambda i: f"{i};176.400,0;70;{torque(i):.4f}".replace(
                f"{torque(i):.4f}", f"{torque(i):.4f}".replace(".", ",")
            ),
        ),
        {},
    ),
    "tabs": (
        log("time [s]\twob [kN]\trotary_speed [rpm]\tsurface_torque [kN*m]", lambda i: usual(i).replace(",", "\t")),
        {},
    ),
    "bars": (
        log("time [s]|wob [kN]|rotary_speed [rpm]|surface_torque [kN*m]", lambda i: usual(i).replace(",", "|")),
        {},
    ),
    "blanks": (
        log("time[s] wob[kN] rotary_speed[rpm] surface_torque[kN*m]", lambda i: usual(i).replace(",", "  ")),
        {},
    ),
    "a title above": ("Rig 7\n\n" + log("time [s],wob [kN],rotary_speed [rpm],surface_torque [kN*m]", usual), {}),
    "minutes": (
        log(
            "time [min],wob [kN],rotary_speed [rpm],surface_torque [kN*m]",
            lambda i: f"{i / 60:.6f},{usual(i).partition(',')[2]}",
        ),
        {},
    ),
    "time of day": (
        log(
            "clock,wob [kN],rotary_speed [rpm],surface_torque [kN*m]",
            lambda i: f"{clock(i)},{usual(i).partition(',')[2]}",
        ),
        {},
    ),
    "date and time in two columns": (
        log(
            "YYYY/MM/DD,HH:MM:SS,wob [kN],rotary_speed [rpm],surface_torque [kN*m]",
            lambda i: f"{day(i)},{clock(i)},{usual(i).partition(',')[2]}",
        ),
        {},
    ),
    "named by hand": (
        log(
            "a,b,wob [kN],rotary_speed [rpm],surface_torque [kN*m],c",
            lambda i: f"{day(i)},{clock(i)},{usual(i).partition(',')[2]},12:00:00",
        ),
        {"times": ["b", "a"], "ignore": ["c"]},
    ),
    "ISO 8601": (
        log(
            "timestamp,wob [kN],rotary_speed [rpm],surface_torque [kN*m]",
            lambda i: (
                f"{'2024-02-29' if 86300 + i < 86400 else '2024-03-01'}T{clock(i)}.000Z,{usual(i).partition(',')[2]}"
            ),
        ),
        {},
    ),
    "zones": (
        log(
            "timestamp,wob [kN],rotary_speed [rpm],surface_torque [kN*m]",
            lambda i: (
                (f"2024-03-01T{clock(i, 3600)}+01:00" if i < 100 else f"2024-03-01T{clock(i, 7200)}+02:00")
                + f",{usual(i).partition(',')[2]}"
            ),
        ),
        {},
    ),
    "German dates": (
        log(
            "Datum,wob [kN],rotary_speed [rpm],surface_torque [kN*m]",
            lambda i: f"{'29.02.2024' if 86300 + i < 86400 else '01.03.2024'} {clock(i)},{usual(i).partition(',')[2]}",
        ),
        {},
    ),
    "half days": (
        log(
            "Time,wob [kN],rotary_speed [rpm],surface_torque [kN*m]",
            lambda i: (
                f"{['11:58', '11:59', '12:00', '12:01'][i // 60]}:{i % 60:02d} {'PM' if i < 120 else 'AM'},"
                f"{usual(i).partition(',')[2]}"
            ),
        ),
        {},
    ),
    "latest row first": (
        "\n".join(
            [
                (lines := log("time [s],wob [kN],rotary_speed [rpm],surface_torque [kN*m]", usual).splitlines())[0],
                *lines[:0:-1],
            ]
        ),
        {},
    ),
}


@pytest.mark.parametrize("form", FORMS)
def test_every_form_of_a_log_gives_the_same_point(read, form):
    text, how = FORMS[form]
    found = read(text, **how)
    assert found.points == 1
    np.testing.assert_allclose(found.at["wob"], 176.4e3, rtol=1e-5)
    np.testing.assert_allclose(found.at["rotary_speed"], 70 * RPM)
    np.testing.assert_allclose(found.values["surface_torque_max"], 11e3, rtol=1e-3)
    np.testing.assert_allclose(
        found.values["surface_torque_mean"], 1e3 * np.mean(torque(np.arange(60, ROWS))), rtol=1e-5
    )
    assert found.where[0].endswith("(60 to 199 s)") or form in ("minutes", "latest row first")


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16", "utf-16-le", "utf-16-be", "cp1252"])
def test_text_of_other_encodings_is_read(read, encoding):
    found = read(
        log("Zeit [s],wob [kN],rotary_speed [rpm],surface_torque [kN*m],Öl °C", lambda i: f"{usual(i)},1"),
        encoding,
        ignore=["Öl °C"],
    )
    assert found.points == 1
    assert any("Latin-1" in note for note in found.notes) == (encoding == "cp1252")


@pytest.mark.parametrize(
    ("data", "said"),
    [
        (b"PK\x03\x04rest", "this is an Excel workbook or another archive; save the sheet as CSV"),
        (b"\x89HDF\r\n\x1a\n", "this is an HDF5 file"),
        (b"a,b\n\x00\x01\x02\x03", "this is no text"),
        (b"\x1f\x8b\x08", "this is compressed; unpack it"),
    ],
)
def test_files_that_are_no_text_are_named(read, data, said):
    with pytest.raises(FileError, match=said):
        read(data)


@pytest.mark.parametrize("null", ["", "-999.25", "-999", "-9999", "NaN", "N/A", "null", "-", "-999.2500"])
def test_a_null_ends_a_stretch_and_is_counted(read, null):
    head = "time [s],wob [kN],rotary_speed [rpm],surface_torque [kN*m]"
    text = log(head, lambda i: usual(i) if i != 150 else f"150,176.4,70,{null}")
    found = read(text)
    assert found.where[0].endswith("(60 to 149 s)")
    assert any(
        "1 interruption, 1 row of 200 not drilling or not usable: 1 with a gap in surface_torque (line 152)" in n
        for n in found.notes
    )
    skipped = read(text, gaps=True)
    assert skipped.where[0].endswith("(60 to 199 s)")
    assert "1 of 200 rows left out: with gaps" in skipped.notes


@pytest.mark.parametrize(
    ("row", "said"),
    [
        ("150,176.4,0,3", "1 with rotary_speed of 0 or less (line 152: rotary_speed: found 0 rad/s)"),
        ("150,-2,70,3", "1 with wob below 0 (line 152: wob: found -2 kN)"),
        ("150,1e9,70,3", "1 with an impossible wob (line 152: wob: found"),
        ("149,176.4,70,3", "1 with the time of the row before (line 152: 149 s)"),
        (
            "150,176.4,70,ERR",
            "1 with no number in surface_torque (line 152: surface_torque: found 'ERR'; allowed: a number.)",
        ),
        ("150,176.4,70,1e300", "1 with an impossible surface_torque (line 152: found 1e+303 N m; allowed: at least"),
        ("150,176.4,70,3,5", "1 with too many cells (line 152: found 5 cells under 4 columns"),
        (",176.4,70,3", "1 without a time (line 152: '')"),
    ],
)
def test_a_row_that_no_run_can_have_ends_a_stretch(read, row, said):
    found = read(
        log("time [s],wob [kN],rotary_speed [rpm],surface_torque [kN*m]", lambda i: usual(i) if i != 150 else row)
    )
    assert found.points == 1
    assert found.where[0].startswith("lines 62 to 151")
    note = next(note for note in found.notes if "interruption" in note)
    assert note.startswith("1 interruption, 1 row of 200 not drilling")
    assert said in note


def test_a_time_that_goes_back_is_told_with_its_row(read):
    text = log(
        "time [s],wob [kN],rotary_speed [rpm],surface_torque [kN*m]",
        lambda i: usual(i) if i < 140 else f"{i - 20}{usual(i)[3:]}",
    )
    found = read(text)
    assert found.where[0].endswith("(60 to 139 s)")
    assert any(
        "the time goes back in 1 row (line 142: 120 s after 139 s), where a stretch ends" in note
        for note in found.notes
    )


def test_an_error_names_all_that_interrupts(read):
    """Also a time that goes back, which is no unusable row, and rows with gaps that are
    skipped."""
    text = log(HEAD, lambda i: f"{i if i < 140 else i - 20},{176.4 if i % 40 else -1},70,{torque(i) if i != 9 else ''}")
    with pytest.raises(FileError) as caught:
        read(text, gaps=True)
    said = str(caught.value)
    assert "the time goes back in 1 row (line 142: 120 s after 139 s), where a stretch ends" in said
    assert "1 of 200 rows left out: with gaps" in said
    assert "5 with wob below 0 (line 2: wob: found -1 kN)" in said


@pytest.mark.parametrize("backwards", [False, True])
def test_rows_that_cannot_be_used_are_no_hole_in_the_time(read, backwards):
    """Forty of them, 1 s apart; and a hole of 500 s before one of them."""
    rows = [
        f"{i if i < 170 else i + 500},{176.4 if not 140 <= i < 180 else -1},70,{torque(i):.4f}" for i in range(ROWS)
    ]
    found = read("\n".join([HEAD, *(rows[::-1] if backwards else rows)]) + "\n")
    assert found.where[0].endswith("(60 to 139 s)")
    line = 31 if backwards else 172
    assert f"1 hole in the time (before line {line}, 501 s long), where a stretch ends" in found.notes
    assert any("1 interruption, 40 rows of 200" in note for note in found.notes)


def test_rows_of_two_wells_are_told_apart(read):
    rows = [f"{'B' if i < 5 else 'C'},{60 + i},{9 + i % 5}" for i in range(10)]
    text = "\n".join(["well,rotary_speed [rpm],surface_torque_mean [kN*m]", *rows]) + "\n"
    said = "DIFFERENT ROWS: well, which is ignored, is B, C, and all rows are taken as of one string"
    for passed in ("*", "well"):
        found = read(text, ignore=[passed])
        assert found.points == 10
        assert f"{said}; only={{'well': 'B'}} takes those of one" in found.notes
    found = read(text, only={"well": "C"})
    assert found.points == 5
    assert found.where[0] == "line 7"
    assert "only the rows with well C: 5 of 10" in found.notes
    assert not any("DIFFERENT ROWS" in note for note in found.notes)
    np.testing.assert_allclose(read(text, ignore=["*"], only={"rotary_speed": "63.0"}).at["rotary_speed"] / RPM, 63.0)
    with pytest.raises(FileError, match="only: found no row with well 'D'; allowed: those of the file, B, C"):
        read(text, only={"well": "D"})
    remarks = text.replace("well", "remark").replace("\nB,60", "\nconnection,60")
    unlike = "\n".join([remarks.splitlines()[0], *(f"{i}{row}" for i, row in enumerate(remarks.splitlines()[1:]))])
    assert not any("DIFFERENT ROWS" in note for note in read(unlike, ignore=["*"]).notes)


def test_a_rig_log_with_a_connection(read):
    """A part of a real log: 324 rows at 0 rpm, of a connection and while the string is set
    down."""
    found = read_measured(LOGS / "rig_log_connection.csv", STUDY, Reading(columns=RIG))
    assert found.points == 3
    assert any("15 interruptions, 324 rows of 2000" in note for note in found.notes)
    np.testing.assert_allclose(found.at["rotary_speed"] / RPM, [52.2, 24.9, 49.7], atol=0.1)
    rows = np.genfromtxt(LOGS / "rig_log_connection.csv", delimiter=",")[61:691]
    np.testing.assert_allclose(found.values["surface_torque_mean"][0] / 1.3558179483314, rows[:, 8].mean(), rtol=1e-9)
    np.testing.assert_allclose(found.at["rotary_speed"][0] / RPM, rows[:, 4].mean(), rtol=1e-9)
    assert "not measured, and so as in the study: depth 5000 m, wob 22.24 kN" in found.notes


def test_a_rig_log_without_a_usable_stretch_says_why():
    with naming_options(), pytest.raises(FileError) as caught:
        read_measured(LOGS / "rig_log_faults.csv", STUDY, Reading(columns=RIG))
    said = str(caught.value)
    assert "The longest lasts" in said
    assert "129 with a gap in rotary_speed (line 90)" in said
    assert "31 with rotary_speed of 0 or less (line 1: rotary_speed: found 0 rad/s)" in said
    assert "2 with the time of the row before (line 29: 23008.5 s)" in said
    assert "2 holes in the time (before line 41, 300.94 s long; before line 71, 14630.4 s long)" in said
    assert "--skip-gaps" in said


def test_a_log_without_a_head_says_how_it_gets_one():
    with naming_options(), pytest.raises(FileError) as caught:
        read_measured(LOGS / "rig_log_connection.csv", STUDY)
    assert f"--columns 'time [s]{', -' * 11}' names the 12 columns" in str(caught.value)


def test_suggestions_can_be_pasted_and_are_near(read):
    text = log(
        "timestamp,Weight on Bit (kN),Rotary RPM (RPM),Gas (ppm),TQ",
        lambda i: f"2024-03-01T{clock(i, 0)},176.4,70,3,{torque(i):.3f}",
    )
    with naming_options(), pytest.raises(FileError) as caught:
        read(text)
    said = str(caught.value)
    assert (
        "--rename 'Weight on Bit=wob' --rename 'Rotary RPM=rotary_speed' --rename 'TQ=surface_torque'. --ignore '*'"
        in said
    )
    assert "shaft_damping" not in said
    with pytest.raises(FileError) as caught:
        read(text)
    assert "rename={'Weight on Bit': 'wob', 'Rotary RPM': 'rotary_speed', 'TQ': 'surface_torque'}" in str(caught.value)
    names = {"Weight on Bit": "wob", "Rotary RPM": "rotary_speed", "TQ": "surface_torque"}
    assert read(text, rename=names, unit={"TQ": "kNm"}, ignore=["*"]).points == 1


OPTIONS = {"rename": "rename", "unit": "unit", "ignore": "ignore", "only": "only", "time": "times"}
UNNAMED = st.text(
    st.sampled_from(list("ab =%'\"[](){}<>!$`\\#*?&|~;\t\n\u00a0\u200b,/_-.é日Ω")), min_size=1, max_size=12
).map(lambda head: f"Q{head}z")


def pasted(said, **placeholders):
    """The options that a message names with a value, as a shell and the command read them."""
    for found in re.finditer(rf"--({'|'.join(OPTIONS)}) (?=['\"])", said):
        lexer = shlex.shlex(said[found.end() :], posix=True)
        lexer.whitespace_split, lexer.commenters = True, ""
        word = lexer.get_token().rstrip(".,;")
        head, equals, value = (part.strip() for part in word.partition("="))
        if not equals or found[1] in ("ignore", "time"):
            yield OPTIONS[found[1]], word
        else:
            for placeholder, meant in placeholders.items():
                value = re.sub(rf"\b{placeholder}$", meant, value)
            yield OPTIONS[found[1]], (head, value)


@given(head=UNNAMED)
@example(head="Qa=bz")
@example(head='Qit\'s "a" [b] 50 % (of) $x z')
@example(head="Q= z")
@settings(
    max_examples=25, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow]
)
def test_every_suggestion_works_when_it_is_pasted(read, head):
    """A torque under any head: it is named as said, gets its unit as said, or is ignored as
    said. The same head for the names of two wells tells them apart."""
    table = [["time [s]", "wob [kN]", "rotary_speed [rpm]", head], *(usual(i).split(",") for i in range(ROWS))]
    chosen = {"rename": {}, "unit": {}}
    with naming_options():
        for name in ("rename", "unit"):
            with pytest.raises(FileError) as caught:
                read(written(table), **chosen)
            found = dict(reversed([*pasted(str(caught.value), NAME="surface_torque", UNIT="kN*m")]))
            if name == "rename":
                with pytest.raises(FileError, match="found no signal"):
                    read(written(table), ignore=[found["ignore"]])
            chosen[name] |= [found[name]]
        np.testing.assert_allclose(read(written(table), **chosen).values["surface_torque_max"], 11e3, rtol=1e-3)
        clocks = [["clock", *table[0][1:]], *([clock(i), *row[1:3], clock(i)] for i, row in enumerate(table[1:]))]
        with pytest.raises(FileError, match="found 2 columns of time") as caught:
            read(written(clocks))
        (_, (_, chosen_time)) = pasted(str(caught.value))
        with pytest.raises(FileError, match="found no signal"):
            read(written(clocks), times=[chosen_time], ignore=["*"])
        wells = [[*row, head if i == 0 else "AB"[i < 100]] for i, row in enumerate(table)]
        wells[0][3] = "surface_torque [kN*m]"
        note = next(note for note in read(written(wells), ignore=["*"]).notes if note.startswith("DIFFERENT ROWS"))
        ((_, only),) = pasted(note)
        assert read(written(wells), ignore=["*"], only=dict([only]), settle=0.0, shortest=50.0).points == 1


def written(table):
    """The table as CSV."""
    file = io.StringIO()
    csv.writer(file).writerows(table)
    return file.getvalue()


def test_two_columns_of_one_name_are_told_apart_by_their_units(read):
    text = log("time [s],WOB [kN],rotary_speed [rpm],surface_torque [kN*m],WOB [klbf]", lambda i: f"{usual(i)},40")
    with naming_options(), pytest.raises(FileError) as caught:
        read(text)
    assert "found two columns of wob, 'WOB [kN]' and 'WOB [klbf]'" in str(caught.value)
    assert [*pasted(str(caught.value))] == [("ignore", "WOB [klbf]")]
    assert read(text, ignore=["WOB [klbf]"]).points == 1


def test_commas_that_may_stand_between_thousands_are_refused(read):
    """1,234 alone may be either; beside 0,5 it is a decimal comma, but not in a table with a
    decimal point."""
    for tonnes, more in (("7", "1"), ("0,5", "2.5")):
        with pytest.raises(FileError, match=r"found '1,234'.*no thousands separators"):
            read(log(f"{HEAD},a", lambda i, row=(tonnes, more): f'{i},"1,234",70,"{row[0]}",{row[1]}'), ignore=["a"])


def test_a_swing_with_too_few_samples_for_a_period_is_told(read):
    """A period of 3.3 s at 1 Hz has 3.3 samples."""
    text = log(
        "time [s],wob [kN],rotary_speed [rpm],surface_torque [kN*m]",
        lambda i: f"{i},176.4,70,{10 + 5 * np.sin(2 * np.pi * i / 3.3):.3f}",
    )
    found = read(text)
    assert "stick_slip_period" not in found.values
    said = "no stick_slip_period of 1 stretch of 1: surface_torque swings once in 3.3 samples, and a period needs 6"
    assert any(note.startswith(said) for note in found.notes)
    slow = log(
        "time [s],wob [kN],rotary_speed [rpm],surface_torque [kN*m]",
        lambda i: f"{i},176.4,70,{10 + 5 * np.sin(2 * np.pi * i / 9.0):.3f}",
    )
    found = read(slow)
    np.testing.assert_allclose(found.values["stick_slip_period"], 9.0, rtol=1e-2)
    assert not any("no stick_slip_period" in note for note in found.notes)


SHORT_STRING = "model: torsion\noperation: {depth: 480 m, wob: 60 kN, rotary_speed: 6 rad/s}\n"


@pytest.mark.parametrize(("step", "shows"), [(2.0, None), (0.25, 2.2425)])
def test_samples_too_far_apart_for_the_torsional_period_give_none(read, step, shows):
    """The string swings once in 2.227 s (`free_period` of its check). Stick-slip of 2.2425 s with
    a sample every 2 s shows 1/(1/2 - 1/2.2425) = 18.5 s."""
    study = nsdrill.load_study(SHORT_STRING)
    assert shows is None or nsdrill.check(study).figures["free_period"].value < 2.2425
    text = log(HEAD, lambda i: f"{i * step},60,57.3,{10 + 5 * np.sin(2 * np.pi * i * step / 2.2425):.3f}")
    found = read(text, study=study, shortest=20.0, settle=5.0)
    said = "no stick_slip_period: surface_torque has a sample every 2 s, and the torsional period of the study is 2.227"
    assert any(note.startswith(said) for note in found.notes) == (shows is None)
    if shows is None:
        assert "stick_slip_period" not in found.values
    else:
        np.testing.assert_allclose(found.values["stick_slip_period"], shows, rtol=1e-2)


def test_a_column_that_was_named_is_not_ignored(read):
    text = log("time [s],wob [kN],rotary_speed [rpm],X [kN*m]", usual)
    with pytest.raises(
        FileError, match=r"rename: found the name 'surfce_torque' for 'X', which is not known. Did you mean surface"
    ):
        read(text, rename={"X": "surfce_torque"}, ignore=["*"])
    with pytest.raises(FileError, match="ignore: found 'X', which rename names too; allowed: one of both"):
        read(text, rename={"X": "surface_torque"}, ignore=["X"])


def test_an_ignored_column_that_could_be_needed_is_told(read):
    text = log("time [s],WOBA [kN],rotary_speed [rpm],TQ [kN*m],surface_torque [kN*m]", lambda i: f"{usual(i)},5")
    found = read(text, ignore=["*"])
    assert "ignored: WOBA, TQ; to use it: rename={'WOBA': 'wob'}" in found.notes
    with pytest.raises(
        FileError, match=r"found no signal .* Ignored: WOBA, TQ; to use them: rename={'WOBA': 'wob', 'TQ': 'surf"
    ):
        read(log("time [s],WOBA [kN],rotary_speed [rpm],TQ [kN*m]", usual), ignore=["*"])


@pytest.mark.parametrize(
    ("text", "how", "said"),
    [
        (
            log("time,wob,rpm,torque", usual, ["s,kN,rpm,m"]),
            {"rename": {"rpm": "rotary_speed", "torque": "surface_torque"}},
            "torque: found 'm', in units of length; allowed: a unit",
        ),
        (
            log("time [s],wob [klbf],x,y", usual, ["s,kN,rpm,kNm"]),
            {"ignore": ["*"], "rename": {"y": "surface_torque"}},
            "wob: found two units, klbf in the head and kN in the line below",
        ),
        (
            log("time [s],wob [t],rotary_speed [rpm],surface_torque [kN*m]", usual),
            {},
            "unit={'wob': 'tonne_force'} says that a force is meant",
        ),
        (
            log("time [s],SWOB [kN],wob [kN],surface_torque [kN*m]", usual),
            {"rename": {"SWOB": "wob"}},
            "found two columns of wob, 'SWOB' and 'wob'; allowed: one of each. ignore=['wob']",
        ),
        (
            log("time [s],wob [kN],wob [kN],surface_torque [kN*m]", usual),
            {"rename": {"wob": "depth"}},
            "found 2 columns 'wob'; allowed: one. columns names the columns",
        ),
        (
            log("wob [kN],rotary_speed [rpm],surface_torque [kN*m],Time", lambda i: f"176,70,5,{i}"),
            {},
            "found no unit; allowed: Time [s]",
        ),
        (
            log("a,b,wob [kN],surface_torque [kN*m]", lambda i: f"{clock(i)},{clock(i)},176,5"),
            {},
            "found 2 columns of time; allowed: one: times=['a'] or times=['b']",
        ),
        (
            log("Date,wob [kN],surface_torque [kN*m]", lambda i: "2024-03-01,176,5"),
            {},
            "surface_torque by itself is a signal over time, which needs a column time",
        ),
        (
            log("time [s],wob [kN],rotary_speed [rpm],surface_torque [kN*m]", lambda i: f"{i},176.4,0,3"),
            {},
            "found no two rows that can be used, of 200; allowed: more. 200 with rotary_speed of 0 or less (line 2",
        ),
        ("time [s],wob [kN],surface_torque [kN*m]\n0,1,2\n", {}, "found no two rows that can be used, of 1"),
        (
            "time [s],wob [kN],surface_torque [kN*m]\n0,1,2\n1,1,2\n",
            {},
            "The longest lasts 1 s (lines 2 to 3), ended by the end of the log",
        ),
        (
            log("time [s],wob [kN],rotary_speed [rpm],surface_torque [kN*m]", lambda i: f"{i},{100 + i},70,3"),
            {},
            "ended by a change of wob",
        ),
        (
            log("time [s],wob [kN],rotary_speed [rpm],surface_torque [kN*m]", lambda i: usual(i).replace(".", ",")),
            {},
            "200 with too many cells (line 2: found 6 cells under 4 columns; allowed: a cell for each column. Write a",
        ),
        ("sep=ab\na,b\n", {}, "found sep=ab; allowed: one character"),
    ],
)
def test_what_a_log_lacks_is_told(read, text, how, said):
    with pytest.raises(InputError) as caught:
        read(text, **how)
    assert said in str(caught.value)


def test_a_table_over_points_may_have_dates(read):
    found = read("Date,wob [kN],bit_force_max [kN]\n2024-03-01,10,20\n2024-03-02,20,30\n", ignore=["*"])
    assert found.points == 2


def test_a_log_without_settings_takes_those_of_the_study(read):
    found = read(log("time [s],surface_torque [kN*m]", lambda i: f"{i},{torque(i):.3f}"))
    assert found.points == 1
    assert found.at == {}
    assert "not measured, and so as in the study: depth 5000 m, wob 22.24 kN, rotary_speed 3 rad/s" in found.notes


@pytest.mark.parametrize("kind", ["stiff", "soft_torque"])
def test_the_torque_of_the_motor_accelerates_the_drive_too(read, kind):
    """T = T_string + J dOmega/dt, with a speed that swings by 3 % at 1 rad/s."""
    study = nsdrill.load_study({"drive": {"kind": kind, "inertia": "2000 kg*m^2"}})

    def row(i):
        time = 0.1 * i
        speed = 7.0 + 0.2 * np.sin(time)
        return f"{time:.1f},60,{speed:.9f},{8e3 + 2000 * 0.2 * np.cos(time):.6f}"

    text = "\n".join(["time [s],wob [kN],rotary_speed [rad/s],surface_torque [N*m]", *map(row, range(2000))])
    of_string = read(text, study=study, surface_torque="motor")
    np.testing.assert_allclose(of_string.values["surface_torque_max"], 8e3, atol=2.0)
    np.testing.assert_allclose(of_string.values["surface_torque_min"], 8e3, atol=2.0)
    assert any("surface_torque is that of the motor: less" in note for note in of_string.notes)
    as_logged = read(text, study=study)
    np.testing.assert_allclose(as_logged.values["surface_torque_max"], 8.4e3, rtol=1e-3)
    assert any(
        "surface_torque is taken as that of the string; surface_torque='motor'" in note for note in as_logged.notes
    )
    with pytest.raises(InputError, match=r"surface_torque: found motor with drive.kind: ideal"):
        read(text, surface_torque="motor")


def test_the_extremes_of_a_well_have_an_error_of_their_own_range(read):
    """A swing of 20 kN m is known to 1 kN m at both of its ends, also where the least torque
    is near zero, whatever other rows of the table have."""
    text = "rotary_speed [rpm],surface_torque_min [kN*m],surface_torque_max [kN*m]\n57,0.1,20.1\n60,12,12.2\n"
    errors = read(text).errors
    np.testing.assert_allclose(errors["surface_torque_min"][0], np.hypot(0.05 * 0.1e3, 1e3))
    np.testing.assert_allclose(errors["surface_torque_max"][0], np.hypot(0.05 * 20.1e3, 1e3))
    np.testing.assert_allclose(errors["surface_torque_min"][1], 0.6e3, rtol=0.01)


@pytest.mark.parametrize(
    ("cells", "wanted"),
    [
        (["23:59:59", "00:00:01"], [0, 2]),
        (["12:00", "12:01"], [0, 60]),
        (["2024-12-31 23:59:59.5", "2025-01-01 00:00:00.25"], [0, 0.75]),
        (["01-Mar-2024 10:00:00", "02-Mar-2024 10:00:00"], [0, 86400]),
        (["03/01/2024 23:59:59", "03/02/2024 00:00:00", "03/13/2024 00:00:00"], [0, 1, 950401]),
        (["1.3.24 23:59:59", "2.3.24 00:00:00"], [0, 1]),
        (["2024-03-01T01:00:00+01:00", "2024-03-01T00:00:01Z", "2024-02-29T19:00:02-0500"], [0, 1, 2]),
        (["10:00:00", "10:99:00", "10:00:02"], [0, np.nan, 2]),
        (["2024-02-30 10:00:00", "2024-03-01 10:00:00"], [np.nan, 0]),
    ],
)
def test_times_are_seconds_since_the_first(cells, wanted):
    np.testing.assert_allclose(seconds(cells)[0], wanted, atol=1e-9)


def test_no_number_is_a_time():
    assert not [
        cell
        for cell in ("12.5", "1-2", "-999.25", "", "176,5", "1e5", "12", "abc", "1.5.2", "1.5")
        if kind_of_time(cell)
    ]


@pytest.mark.parametrize(
    ("text", "value"), [("1.2 sg", 1200.0), ("10 lbm/gal", 1198.2642731689664), ("75 pcf", 1201.3847530470105)]
)
def test_weights_of_mud_of_the_rig_floor(text, value):
    study = nsdrill.load_study({"mud": {"density": text}})
    assert study.parameters.mud.density == pytest.approx(value, rel=1e-12)


def test_speeds_and_forces_of_the_rig_floor():
    study = nsdrill.load_study(
        {
            "operation": {"rotary_speed": "60 c/min", "wob": "2 kdaN"},
            "drive": {"kind": "stiff", "torque_limit": "30 kNm"},
        }
    )
    assert study.operation.rotary_speed == pytest.approx(2 * np.pi)
    assert study.operation.wob == 20e3
    with pytest.raises(InputError, match=r"is a unit of mass, not of force.*Did you mean klbf"):
        nsdrill.load_study({"operation": {"wob": "10 klb"}})


def test_fifty_thousand_rows_are_read_at_once(tmp_path):
    """With a margin for a busy machine: 0.5 s here."""
    from time import process_time

    path = tmp_path / "log.csv"
    rows = "\n".join(f"2024-03-01T{clock(i, 0)}.0Z,176.4,{70 + i % 3},{torque(i):.4f},1,2,3,4" for i in range(50_000))
    path.write_text(f"timestamp,wob [kN],rotary_speed [rpm],surface_torque [kN*m],a,b,c,d\n{rows}\n")
    began = process_time()
    found = read_measured(path, STUDY, Reading(ignore=["*"]))
    assert process_time() - began < 3.0
    assert found.points >= 1
    assert len(read_table(str(path)).lines) == 50_000


def test_text_is_no_gap_that_is_skipped(read):
    """It ends a stretch, with its line."""
    wrong = {150: "abc", 160: '"18,000.00"', 170: "", 180: "-999.25"}
    text = log(HEAD, lambda i: f"{i},176.4,70,{wrong.get(i, torque(i))}")
    found = read(text, gaps=True)
    assert found.where[0].endswith("(60 to 149 s)")
    assert "2 of 200 rows left out: with gaps" in found.notes
    assert any(
        "2 interruptions, 2 rows of 198" in note and "(line 152: surface_torque: found 'abc'" in note
        for note in found.notes
    )


def test_a_row_of_nulls_with_its_time_can_be_skipped(read):
    null = ",".join(["-999.25"] * 4)
    text = log(HEAD, lambda i: usual(i) if i % 50 else null)
    with naming_options(), pytest.raises(FileError, match="--skip-gaps passes over rows with gaps"):
        read(text)
    assert "4 of 200 rows left out: with gaps" in read(text, gaps=True).notes
    with naming_options(), pytest.raises(FileError) as caught:
        read(text.replace("-999.25", "ERR"))
    assert "--skip-gaps" not in str(caught.value)


def test_a_value_far_outside_the_others_is_told_with_its_line(read):
    found = read(log(HEAD, lambda i: usual(i) if i != 130 else "130,176.4,70,9999"))
    (said,) = [note for note in found.notes if note.startswith("FAR OUTSIDE")]
    assert "surface_torque has 1 value far from all others (line 132: 9.999e+06 N m; most are 9" in said
    assert not any("FAR OUTSIDE" in note for note in read(log(HEAD, usual)).notes)


def swing(i):
    return 8.0 + 2.0 * np.sin(2 * np.pi * i / 7.3)


FAULTS = {
    "BELOW ZERO: surface_torque, stretch 1": lambda i: -swing(i),
    "HELD: surface_torque, stretch 1 changes only every 4 s": lambda i: swing(i // 4 * 4),
    "STANDS STILL: surface_torque, stretch 1 is 7000 N m for 69 s": lambda i: swing(i) if i < 130 else 7.0,
    "CUT OFF: surface_torque, stretch 1 is 9000 N m in": lambda i: min(swing(i), 9.0),
}
GOOD = {
    "as it is": swing,
    "rounded": lambda i: round(swing(i), 1),
    "slow and rounded": lambda i: round(8.0 + 0.3 * np.sin(i / 20), 1),
    "one value": lambda i: 8.0,
}


@pytest.mark.parametrize("said", FAULTS)
def test_what_a_signal_shows_of_its_sensor_is_told(read, said):
    found = read(log(HEAD, lambda i: f"{i},176.4,70,{FAULTS[said](i):.4f}"))
    assert any(note.startswith(said) for note in found.notes), found.notes


@pytest.mark.parametrize("how", GOOD)
def test_a_good_signal_shows_no_fault_of_its_sensor(read, how):
    found = read(log(HEAD, lambda i: f"{i},176.4,70,{GOOD[how](i):.4f}"))
    words = ("BELOW ZERO", "HELD", "STANDS STILL", "CUT OFF")
    assert not [note for note in found.notes if note.startswith(words)]


POINTS = "rotary_speed [rpm],wob [kN],surface_torque_max [kN m],bit_speed_max [rpm]\n"
AGAINST = {
    "60,60,7,120\n60,60,2,120\n": "ONE SETTING, OTHER VALUES: surface_torque_max of line 3 and line 2",
    "60,60,7,40\n": "NOT THE SPEED: bit_speed_max is below the set speed at line 2",
    "60,60,-3,120\n": "BELOW ZERO: the greatest surface torque at line 2",
    "60,60,7,120\n60,60,7.1,121\n80,60,3,81\n": "",
}


@pytest.mark.parametrize("rows", AGAINST)
def test_what_measurements_say_against_each_other_is_told(read, rows):
    told = [note for note in read(POINTS + rows).notes if note.startswith(("ONE SETTING", "NOT THE", "BELOW"))]
    assert len(told) == bool(AGAINST[rows])
    assert all(note.startswith(AGAINST[rows]) for note in told)


def test_a_spike_of_a_setting_is_told_with_its_line(read):
    found = read(log(HEAD, lambda i: usual(i) if i != 130 else f"130,176.4,7000,{torque(i):.4f}"))
    assert found.where[0].endswith("(60 to 129 s)")
    said = "SPIKE: rotary_speed leaves its value for a row or two and comes back 1 time, where a stretch ends"
    assert f"{said} (line 132: 100 times the value before)" in found.notes
    changed = read(log(HEAD, lambda i: usual(i) if i < 130 else f"{i},176.4,90,{torque(i):.4f}"))
    assert not any("SPIKE" in note for note in changed.notes)


def test_random_bytes_are_no_text(read):
    """Without a byte of zero at their beginning, which other files have."""
    data = np.random.default_rng(5).integers(1, 256, 20_000, dtype=np.uint8).tobytes()
    with pytest.raises(FileError, match="this is no text; a table in CSV is needed here"):
        read(data)

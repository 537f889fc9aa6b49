"""JSON of every command in field units: each number converts back to that in SI by the
unit that stands beside it or under its name."""

import json
import shutil
from pathlib import Path
from typing import Any

import pytest

from nsdrill.quantity import find, in_system, quantity
from nsdrill.units import QuantityError, to_si

from .helpers import call_here

GIVEN = Path(__file__).parents[1] / "transcripts" / "given"
MADE = (
    "run small.yaml -o small.h5 -q",
    "run small.yaml -o failing.h5 -q --set simulation.max_steps=1000",
    "run map.yaml -o map.h5 -q",
    "run starts.yaml -o starts.h5 -q",
    "run uncertain.yaml -o uncertain.h5 -q",
    "run torsion.yaml -o torsion.h5 -q",
    "branches branches.yaml -o branches.h5 -q --set continue.points=60",
    "branches branches.yaml -o short.h5 -q --set continue.points=20",
    "simulate small.yaml -o trace.h5 --duration 1s --depth 10000ft",
    "simulate small.yaml -o other.h5 --duration 1s --depth 11000ft",
    "simulate ramp.yaml -o ramp.h5",
)
COMMANDS = (
    "check small.yaml",
    "check small.yaml --set drillstring.eccentricity=10cm",
    "check ramp.yaml",
    "check branches.yaml",
    "check uncertain.yaml",
    "show small.h5",
    "show failing.h5",
    "show map.h5",
    "show starts.h5",
    "show uncertain.h5",
    "show branches.h5",
    "show trace.h5",
    "show ramp.h5",
    "window small.h5",
    "window failing.h5",
    "window map.h5 --severity 4",
    "window map.h5 map.h5 --severity 4",
    "window uncertain.h5",
    "sensitivity uncertain.h5",
    "spectrum torsion.h5 --rotary-speed 6rad/s -q",
    "fit prior.yaml --data rig.csv --batch 16 --rounds 2 --samples 4 -q",
    "diff small.h5 failing.h5",
    "diff trace.h5 other.h5",
    "diff branches.h5 short.h5",
    "diff small.h5 map.h5",
)
PLAIN = {"share", "relative", "confidence", "deviation", "below", "above", "time", "at", "first"}  # shares, and times
Units = tuple[str, str]  # in SI and in the field
NAMING = ("axis", "name", "along", "key", "over")  # whose value is the name of a quantity


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """A folder with the files that the commands read."""
    from nsdrill.cli.main import main

    folder = tmp_path_factory.mktemp("json")
    shutil.copytree(GIVEN, folder, dirs_exist_ok=True)
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        for words in MADE:
            patch.setattr("sys.argv", ["nsdrill", *words.split()])
            with pytest.raises(SystemExit) as end:
                main()
            assert end.value.code in (0, 3)
    return folder


def test_every_command_with_json_is_here():
    import click

    from nsdrill.cli.main import group
    from nsdrill.cli.overview import COMMANDS as ALL

    context = click.Context(group)
    with_json = {name for name in ALL for one in group.get_command(context, name).params if "--json" in one.opts}
    assert with_json == {words.split()[0] for words in COMMANDS}


@pytest.mark.parametrize("words", COMMANDS)
def test_what_is_in_field_units_converts_back(capfd, monkeypatch, files, words):
    monkeypatch.chdir(files)
    si, field = (
        json.loads(call_here(capfd, monkeypatch, f"{words} --json --units {units}").out) for units in ("si", "field")
    )
    units = {name: (quantity(name).units, unit) for name, unit in field.pop("units", {}).items()}
    converted: set[Units] = set()
    compare(si, field, units, [], converted)
    assert converted >= {units[name] for name in units if has_numbers(si, name)}


def compare(si: Any, field: Any, named: dict[str, Units], beside: list[str | Units], converted: set[Units]) -> None:
    """Compare a value with that in field units. ``named`` has units by names, ``beside`` the
    names and the units that stand around the value, from the outermost on; the units of
    what was converted go into ``converted``."""
    assert type(si) is type(field), (si, field)
    if isinstance(si, dict):
        assert si.keys() == field.keys()
        # the axis of the whole answer is not that of each number in it
        around: list[str | Units] = [value for key in NAMING if beside and isinstance(value := si.get(key), str)]
        if isinstance(si.get("units"), str):
            around.append((si["units"], field["units"]))
        for key, value in si.items():
            compare(value, field[key], named, [*beside, *around, key], converted)
    elif isinstance(si, list):
        assert len(si) == len(field)
        for one, two in zip(si, field, strict=True):
            compare(one, two, named, beside, converted)
    elif isinstance(si, float):
        units = {one if isinstance(one, tuple) else named.get(one) for one in beside} - {None}
        known = find(beside[-1]) if isinstance(beside[-1], str) else None
        if si and si != field:
            of_it = {one for one in units if converts(si, field, *one)}
            assert of_it, f"{si} became {field} in {beside}, with the units {named}"
            converted |= of_it
        elif si and not PLAIN & {*beside}:
            assert all(to == unit or in_system(1.0, to, "field")[0] == 1.0 for to, unit in units), f"{beside} is in SI"
            assert known is None or in_system(1.0, known.units, "field")[0] == 1.0, f"{beside} is in SI"
    elif not isinstance(si, str):  # a text may have units in it
        assert si == field


def converts(si: float, field: float, to: str, unit: str) -> bool:
    try:
        return to_si(f"{field!r} {unit}", to) == pytest.approx(si, rel=1e-9)
    except QuantityError:  # the unit of something else
        return False


def has_numbers(data: Any, name: str) -> bool:
    """Whether a number other than zero stands under this name."""
    if isinstance(data, dict):
        return any(nonzero(value) if key == name else has_numbers(value, name) for key, value in data.items())
    return isinstance(data, list) and any(has_numbers(one, name) for one in data)


def nonzero(value: Any) -> bool:
    parts = value.values() if isinstance(value, dict) else value if isinstance(value, list) else None
    return any(map(nonzero, parts)) if parts is not None else isinstance(value, float) and value != 0

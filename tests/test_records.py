"""Frozen classes are those of the standard library, made in less time."""

import dataclasses
import inspect
import re
from dataclasses import field
from pathlib import Path

import pytest

from nsdrill import records


def classes(dataclass):
    @dataclass(frozen=True)
    class Plain:
        a: int
        b: str = "two"
        c: tuple = field(default=(), compare=False)
        d: float = field(default=0.5, repr=False)
        e: list = field(default_factory=list, hash=False)

    @dataclass(frozen=True)
    class Below(Plain):
        f: int = 6

    @dataclass(frozen=True, eq=False)
    class ByIdentity:
        a: int

    @dataclass(frozen=True, kw_only=True)
    class One:
        a: int

    @dataclass(frozen=True)
    class Own:
        a: int

        def __eq__(self, other):
            return True

        def __repr__(self):
            return "own"

    @dataclass(frozen=True)
    class Nothing:
        pass

    @dataclass(frozen=True)
    class Derived:
        a: int
        b: int = field(init=False)
        c: list = field(init=False, default_factory=list, hash=False)
        d: int = field(init=False, default=4)
        e: int = field(kw_only=True, default=5)
        f: tuple = field(kw_only=True, default_factory=tuple)

        def __post_init__(self):
            object.__setattr__(self, "b", 2 * self.a)

    return Plain, Below, ByIdentity, One, Own, Nothing, Derived


@pytest.mark.parametrize("which", range(7))
def test_they_do_the_same(which):
    made = [classes(dataclass)[which] for dataclass in (dataclasses.dataclass, records.dataclass)]
    given = {} if which == 5 else {"a": 1}
    theirs, ours = ([cls(**given), cls(**given), *([cls(a=2)] if given else [])] for cls in made)
    assert [repr(one).rpartition(".")[2] for one in ours] == [repr(one).rpartition(".")[2] for one in theirs]
    assert [a == b for a in ours for b in ours] == [a == b for a in theirs for b in theirs]
    assert ours[0] != theirs[0] or which == 4
    if which != 2:
        assert [hash(one) for one in ours] == [hash(one) for one in theirs]
    assert [one.name for one in dataclasses.fields(made[1])] == [one.name for one in dataclasses.fields(made[0])]
    assert inspect.signature(made[1]).parameters.keys() == inspect.signature(made[0]).parameters.keys()
    assert [one.kind for one in inspect.signature(made[1]).parameters.values()] == [
        one.kind for one in inspect.signature(made[0]).parameters.values()
    ]
    with pytest.raises(dataclasses.FrozenInstanceError):
        ours[0].a = 3
    if given:
        assert dataclasses.replace(ours[0], a=2).a == 2
        with pytest.raises(dataclasses.FrozenInstanceError):
            del ours[0].a


def test_what_is_compared_and_what_is_shown():
    plain = classes(records.dataclass)[0]
    assert plain(1, c=(1,)) == plain(1, c=(2,))
    assert plain(1, d=1.0) != plain(1)
    assert repr(plain(1)).endswith("Plain(a=1, b='two', c=(), e=[])")
    assert hash(plain(1, e=[1])) == hash(plain(1))


def test_what_is_below_a_frozen_class_has_further_attributes_only():
    class Further(classes(records.dataclass)[1]):
        pass

    one = Further(1)
    one.g = 7
    assert one.g == 7
    del one.g
    for act in (lambda: setattr(one, "f", 3), lambda: setattr(one, "a", 3), lambda: delattr(one, "a")):
        with pytest.raises(dataclasses.FrozenInstanceError):
            act()


def test_frozen_classes_of_either_kind_stand_above_each_other():
    theirs, ours = (classes(dataclass)[0] for dataclass in (dataclasses.dataclass, records.dataclass))
    for above, dataclass in ((theirs, records.dataclass), (ours, dataclasses.dataclass)):

        @dataclass(frozen=True)
        class Below(above):
            f: int = 6

        one = Below(1, f=7)
        assert (one.a, one.b, one.f) == (1, "two", 7)
        assert one == Below(1, f=7) != Below(2, f=7)
        for name in ("a", "f"):
            with pytest.raises(dataclasses.FrozenInstanceError):
                setattr(one, name, 3)

    @dataclasses.dataclass
    class Loose:
        a: int

    with pytest.raises(TypeError, match="non-frozen"):

        @records.dataclass(frozen=True)
        class Wrong(Loose):
            b: int = 1

    with pytest.raises(TypeError, match="frozen"):

        @dataclasses.dataclass
        class AlsoWrong(ours):
            b: int = 1


def test_five_functions_of_a_frozen_class_are_not_compiled_for_it():
    plain = classes(records.dataclass)[0]
    others = (plain.__eq__, plain.__hash__, plain.__setattr__, plain.__delattr__)
    assert {one.__code__.co_filename for one in others} == {records.__file__}
    assert plain.__init__.__code__.co_filename == "<string>"


def test_all_frozen_classes_are_these():
    root = Path(records.__file__).parent
    theirs = re.compile(r"^from dataclasses import .*\bdataclass\b", re.M)
    files = {file.name: file.read_text(encoding="utf-8") for file in root.rglob("*.py") if file.name != "records.py"}
    assert [name for name, text in files.items() if theirs.search(text) and "@dataclass(frozen=True" in text] == []

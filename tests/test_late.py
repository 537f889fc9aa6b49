"""Rooms whose names arrive when they are first used."""

import pkgutil
from importlib import import_module
from types import ModuleType

import pytest

from nsdrill.late import late


@pytest.mark.parametrize("room", ["nsdrill.store", "nsdrill.study"])
def test_every_name_is_there_and_none_is_that_of_a_module(room):
    found = import_module(room)
    assert not {one.name for one in pkgutil.iter_modules(found.__path__)} & set(found.__all__)
    assert not [name for name in found.__all__ if isinstance(getattr(found, name), ModuleType)]


def test_another_name_is_an_error_that_tells_the_room():
    with pytest.raises(AttributeError, match=r"'nsdrill\.store' has no attribute 'stored'"):
        late("nsdrill.store", {"rewrite_log": "nsdrill.store.log"})("stored")

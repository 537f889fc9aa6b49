"""The tables of the pages are those of the code, and every name of the code has its
place in the pages."""

import struct

from model_tables import FEATURES, TRACE_VARIABLES

from nsdrill.app.experiment import provenance
from nsdrill.models.registry import BY_NAME, NAMES
from nsdrill.store import hdf5
from nsdrill.store.layout import root_attributes
from nsdrill.study import parse_study
from nsdrill.study.keys import keys_named


def test_tables_are_up_to_date(page, tables):
    """Else: python docs/make_tables.py."""
    text = page.read_text(encoding="utf-8")
    assert tables.filled(text) == text


def test_every_table_is_in_a_page(docs, tables):
    pages = [page.read_text(encoding="utf-8") for page in docs.rglob("*.md")]
    found = {name for text in pages for _, name, _ in tables.BLOCK.findall(text)}
    assert found == set(tables.TABLES)


def test_every_key_of_the_study_is_documented(docs):
    text = (docs / "study.md").read_text(encoding="utf-8")
    sweep = ("depth", "wob", "rotary_speed", "procedure", "along")
    every = {key for model in NAMES for key in keys_named(model).leaves}
    for key in (*every, *(f"sweep.{name}" for name in sweep)):
        assert f"`{key}`" in text, key


def test_every_feature_and_threshold_is_defined(docs):
    variables = (docs / "file_format.md").read_text(encoding="utf-8")
    for name in FEATURES:
        assert f"`{name}`" in variables, name
    keys = (docs / "study.md").read_text(encoding="utf-8")
    for leaf in keys_named().of("classify"):
        assert f"`{leaf.key}`" in keys, leaf.key
    text = (docs / "responses.md").read_text(encoding="utf-8")
    for name in ("response", "whirl_kind", "stick_slip_severity"):
        for word in (BY_NAME[name].flag_meanings or "").split():
            assert f"`{word}`" in text, word


def test_every_variable_and_attribute_of_the_files_is_documented(docs):
    text = (docs / "file_format.md").read_text(encoding="utf-8")
    for name in (*BY_NAME, *(v.name for v in TRACE_VARIABLES)):
        assert f"`{name}`" in text, name
    for name in root_attributes("results", provenance(parse_study("sweep: {depth: 2 km}"), "run")):
        assert f"`{name}`" in text, name


def test_every_status_is_explained(docs):
    text = (docs / "file_format.md").read_text(encoding="utf-8")
    for value, word in enumerate((BY_NAME["status"].flag_meanings or "").split()):
        assert f"| {value} | `{word}` |" in text


def test_the_seal_is_as_the_page_says(docs):
    text = " ".join((docs / "file_format.md").read_text(encoding="utf-8").split())
    assert f"a seal of {hdf5._SEAL.size} bytes: the magic `nsdrill\\x1a`" in text
    assert hdf5._SEAL_MAGIC == b"nsdrill\x1a"
    assert struct.calcsize("<8sQ32s") == hdf5._SEAL.size

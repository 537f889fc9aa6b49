"""Links lead somewhere, pictures are small, studies and Python in the pages are valid and
run, and the known answers are measured anew."""

import inspect
import re
import subprocess
import sys
from pathlib import Path

import pytest

import nsdrill
from nsdrill.errors import StudyError
from nsdrill.study import parse_study

LINK = re.compile(r"\]\(([^)\s]+)\)")
HEADING = re.compile(r"^#+ (.+)$", re.MULTILINE)


def plain(text: str) -> str:
    """A page without its fenced blocks."""
    return re.sub(r"^```.*?^```", "", text, flags=re.MULTILINE | re.DOTALL)


def anchors(page: Path) -> set[str]:
    """The anchors that headings get on GitHub and in MkDocs."""
    titles = HEADING.findall(plain(page.read_text(encoding="utf-8")))
    return {re.sub(r"[^\w\- ]", "", title.lower()).strip().replace(" ", "-") for title in titles}


def test_links_lead_somewhere(page):
    for target in LINK.findall(plain(page.read_text(encoding="utf-8"))):
        if target.startswith(("http:", "https:")):
            continue
        name, _, anchor = target.partition("#")
        file = page.parent / name if name else page
        assert file.exists(), target
        if anchor:
            assert anchor in anchors(file), target


def test_a_page_for_users_links_no_page_for_developers(docs):
    """Who has the pages without `dev` finds no dead link."""
    links = [
        (page.name, target) for page in docs.glob("*.md") for target in LINK.findall(plain(page.read_text("utf-8")))
    ]
    assert [one for one in links if one[1].startswith(("dev/", "../"))] == []


def test_pages_name_no_file_of_this_machine(page):
    assert not re.search(r"(?<![\w.])/(?:home|work|tmp|root|opt)/", page.read_text(encoding="utf-8"))


def test_pictures_are_small_and_used(docs):
    text = "".join(page.read_text(encoding="utf-8") for page in docs.rglob("*.md"))
    pictures = list((docs / "pictures").iterdir())
    assert pictures
    for picture in pictures:
        assert picture.stat().st_size < 300_000, picture.name
        assert f"pictures/{picture.name}" in text, picture.name


def test_every_shipped_study_has_its_section(root, docs):
    text = (docs / "studies.md").read_text(encoding="utf-8")
    for config in (root / "configs").glob("*.yaml"):
        assert f"`{config.name}`" in text


def yaml_blocks(page: Path) -> list[str]:
    return re.findall(r"^```yaml\n(.*?)^```", page.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL)


def test_studies_in_the_pages_are_valid(root, docs):
    *good, _ = yaml_blocks(docs / "study.md")
    assert [parse_study(text).procedure for text in good] == ["up-down", "same", "same", "up-down", "same"]
    for text in yaml_blocks(root / "README.md"):
        parse_study(text)


def test_the_faulty_example_fails_as_shown(docs):
    *_, faulty = yaml_blocks(docs / "study.md")
    with pytest.raises(StudyError) as caught:
        parse_study(faulty, "bad.yaml")
    text = (docs / "study.md").read_text(encoding="utf-8")
    assert f"```text\nError: {caught.value}\n```" in text


def test_the_first_five_minutes(root, tmp_path, run_commands, run_python):
    """The commands and the Python of the README, in order, in an empty folder; the study
    that the first of them writes is made shorter for the others."""
    text = (root / "README.md").read_text(encoding="utf-8").partition("## The first five minutes")[2]
    shell, python, *_ = re.findall(r"^```(?:sh|python)\n(.*?)^```", text, re.MULTILINE | re.DOTALL)
    new, *others = [line for line in shell.splitlines() if line.startswith("nsdrill ")]
    run_commands([new], tmp_path)
    study = tmp_path / "study.yaml"
    shorter = re.sub(r"(transient|observe): \d+ s", r"\1: 20 s", study.read_text())
    assert shorter.count(": 20 s") == 2
    study.write_text(shorter)
    assert len(run_commands(others, tmp_path)) == 9
    run_python(python)
    assert (tmp_path / "study.csv").stat().st_size > 10_000


def test_the_ways_to_open_a_results_file(docs, tmp_path, monkeypatch):
    """The Python of the page on its own example; MATLAB's indices are those of h5py
    from last to first."""
    sweep = "sweep: {depth: [3 km, 5000 m], procedure: up-down}"
    study = parse_study(f"{sweep}\nsimulation: {{transient: 0.1 s, observe: 0.1 s}}")
    nsdrill.run(study, tmp_path / "out.h5", workers=1)
    monkeypatch.chdir(tmp_path)
    text = (docs / "file_format.md").read_text(encoding="utf-8")
    with_xarray, with_h5py = re.findall(r"^```python\n(.*?)^```", text, re.MULTILINE | re.DOTALL)
    found = {}
    exec(with_xarray, found)
    with found["data"] as data:
        assert data.axial_peaks.sel(procedure="up").dims == ("depth", "peak")
        assert data.stick_slip_index.sel(depth=5000, method="nearest").dims == ("procedure",)
        assert (float(data.wob), data.wob.attrs["units"]) == (22240.0, "N")
        exec(with_h5py, found)
        assert found["names"] == ["procedure", "depth"]
        assert found["depth"].tolist() == [3000.0, 5000.0]
        assert found["wob"] == 22240.0
        assert found["peaks"].tobytes() == data.axial_peaks.sel(procedure="up").values.tobytes()
    assert "MATLAB reverses: peak, depth, procedure" in text


def test_version_and_licence_agree(root):
    from nsdrill import __version__

    assert f"\nversion: {__version__}\n" in (root / "CITATION.cff").read_text(encoding="utf-8")
    assert f"## [{__version__}]" in (root / "CHANGELOG.md").read_text(encoding="utf-8")
    assert "\nlicense: MIT\n" in (root / "CITATION.cff").read_text(encoding="utf-8")


FUNCTIONS = [name for name in nsdrill.__all__ if name.islower()]
CLASSES = [name for name in nsdrill.__all__ if not name.islower()]


def test_the_examples_run_one_after_the_other(docs, run_python, tmp_path):
    page = (docs / "from_python.md").read_text(encoding="utf-8")
    blocks = re.findall(r"^```python\n(.*?)^```", page, re.M | re.S)
    assert len(blocks) >= 8
    said = run_python("\n".join(blocks))
    assert "operation.wob: found the number 30 without a unit" in said
    assert "Dataset: results of a sweep" in said
    assert {path.name for path in tmp_path.iterdir()} == {"out.h5", "peaks.png", "page.png", "trace.h5", "table.csv"}


def test_every_public_name_is_on_the_page(docs):
    page = (docs / "python.md").read_text(encoding="utf-8")
    for name in FUNCTIONS:
        assert f"\n### {name}\n" in page, name
    for name in CLASSES:
        assert f"| `nsdrill.{name}` | " in page, name


def test_every_argument_is_in_its_docstring():
    for name in FUNCTIONS:
        function = getattr(nsdrill, name)
        for argument in inspect.signature(function).parameters:
            if argument not in ("results", "data", "study"):
                words = rf"(?m)^ *(\w+, )*{argument}(, \w+)* : "
                assert re.search(words, function.__doc__), (name, argument)
    for name in CLASSES:
        assert getattr(nsdrill, name).__doc__, name


def test_the_names_of_arguments_are_explained(docs):
    page = (docs / "python.md").read_text(encoding="utf-8").partition("<!-- table: python classes")[0]
    signatures = "".join(str(inspect.signature(getattr(nsdrill, name))) for name in FUNCTIONS)
    for alias in set(re.findall(r"\b(?:\w+Like|Quantity|Settings)\b", signatures)):
        assert f"`{alias}`" in page, alias


ROOMS = {"from", "import", "nsdrill", "api", "errors", "script"}
ROOMS |= {"declared_drive", "declared_model", "declared_picture", "physics", "quantities", "signature", "tableaus"}


def test_annotations_say_what_the_checker_knows():
    """The names that the package gives are those that it is typed with."""
    text = Path(nsdrill.__file__).read_text(encoding="utf-8")
    typed = text.partition("if TYPE_CHECKING:")[2].partition("__all__")[0]
    assert set(re.findall(r"\w+", typed)) - ROOMS == set(nsdrill.__all__)


def test_the_script_of_the_page_runs(docs, tmp_path):
    """As a file, whose text can be read."""
    page = (docs / "own_equations.md").read_text(encoding="utf-8")
    text = "\n".join(re.findall(r"^```python\n(.*?)^```", page, re.M | re.S))
    (tmp_path / "page.py").write_text(text, encoding="utf-8")
    done = subprocess.run([sys.executable, "page.py"], cwd=tmp_path, capture_output=True, text=True, timeout=600)
    assert done.returncode == 0, done.stderr
    assert "the model duffing: nothing failed" in done.stdout


def test_studies_of_two_more_pages_are_valid(docs):
    ramps = yaml_blocks(docs / "ramps.md")
    assert len(ramps) == 3
    assert all(parse_study(text).ramped for text in ramps)
    assert [parse_study(text).samples for text in yaml_blocks(docs / "uncertain.md")] == [256, 3]


def test_python_of_the_page_runs(docs, run_python):
    text = (docs / "uncertain.md").read_text(encoding="utf-8")
    (block,) = re.findall(r"^```python\n(.*?)^```", text, re.MULTILINE | re.DOTALL)
    run_python(block)


def test_known_answers(case, verify):
    rows = list(verify.CASES[case]())
    assert rows
    for row in rows:
        assert row.good, f"{row.quantity}: expected {row.expected}, measured {row.measured}, allowed {row.allowed}"


def test_the_page_has_every_row(verify, docs):
    """Else: python docs/verify.py --markdown, into the page."""
    text = (docs / "verification.md").read_text(encoding="utf-8")
    for row in verify.CASES["string"]():
        assert f"| {row.quantity} | {row.expected:.10g} | {row.measured:.10g} |" in text

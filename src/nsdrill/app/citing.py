"""What to cite: nsdrill, the results of a file, and the works behind their model, as far
as these are known. They are those of docs/bibliography.md."""

from __future__ import annotations

from typing import TYPE_CHECKING

from nsdrill.errors import printable
from nsdrill.models.registry import scripted
from nsdrill.origin import origin_in_words
from nsdrill.records import dataclass
from nsdrill.version import __version__

if TYPE_CHECKING:
    from nsdrill.data import Attributes

TITLE = "nsdrill: a bifurcation explorer for coupled drill-string vibration"
AUTHORS = "The nsdrill developers"


@dataclass(frozen=True)
class Work:
    """A publication by its BibTeX ``key`` and ``kind``; what is not known is empty."""

    key: str
    kind: str
    authors: str
    title: str
    journal: str = ""
    volume: str = ""
    pages: str = ""
    year: str = ""
    note: str = ""

    def text(self) -> str:
        """The work in one line."""
        volume = f" {self.volume}" if self.volume else ""
        parts = (self.authors.replace(" and ", ", "), f'"{self.title}"', f"{self.journal}{volume}", self.pages)
        year = f" ({self.year})" if self.year else ""
        return ", ".join(filter(None, parts)) + year + (f" [{self.note}]" if self.note else "") + "."

    def bibtex(self) -> str:
        """The entry of the work."""
        fields = {
            "author": self.authors,
            "title": f"{{{self.title}}}",
            "booktitle" if self.kind == "inproceedings" else "journal": self.journal,
            "volume": self.volume,
            "pages": self.pages.replace("-", "--"),
            "year": self.year,
            "note": self.note,
        }
        lines = [f"  {name} = {{{value}}}," for name, value in fields.items() if value]
        return "\n".join([f"@{self.kind}{{{self.key},", *lines, "}"])


_FIGURES = Work(
    "coupled_nonsmooth",
    "misc",
    "",
    "Analysis of coupled drill-string vibrations using a nonsmooth system",
    note="conference paper; its authors and year are not known to nsdrill",
)
_CHRISTOFOROU_YIGIT = Work(
    "christoforou_yigit_2003",
    "article",
    "A. P. Christoforou and A. S. Yigit",
    "Fully coupled vibrations of actively controlled drillstrings",
    "Journal of Sound and Vibration",
    "267",
    "1029-1045",
    "2003",
)
_COLLAR = Work(
    "ghasemloonia_rideout_butt",
    "misc",
    "A. Ghasemloonia and G. Rideout and S. Butt",
    "The effect of weight on bit on the contact behavior of drillstring and wellbore",
)
_SEGMENTS = Work(
    "sarker_rideout_butt_2012",
    "inproceedings",
    "Sarker and Rideout and Butt",
    "Dynamic model of an oilwell drillstring with stick-slip and bit-bounce interaction",
    "International Conference on Bond Graph Modeling",
    year="2012",
)
_FRICTION = Work(
    "leine_van_campen_de_kraker_van_den_steen_1998",
    "article",
    "R. I. Leine and D. H. van Campen and A. de Kraker and L. van den Steen",
    "Stick-slip vibrations induced by alternate friction models",
    "Nonlinear Dynamics",
    "16",
    "41-54",
    "1998",
)
_DRAG_BIT = Work(
    "richard_germay_detournay_2007",
    "article",
    "T. Richard and C. Germay and E. Detournay",
    "A simplified model to explore the root cause of stick-slip vibrations in drilling systems with drag bits",
    "Journal of Sound and Vibration",
    "305",
    "432-456",
    "2007",
)
WORKS = {
    "christoforou_yigit": (_CHRISTOFOROU_YIGIT, _FIGURES),
    "torsion": (_FRICTION, _CHRISTOFOROU_YIGIT),
    "beam": (_COLLAR, _CHRISTOFOROU_YIGIT),
    "segments": (_SEGMENTS,),
    "regenerative": (_DRAG_BIT,),
}


def citation(attrs: Attributes | None = None, name: str = "", *, bibtex: bool = False) -> str:
    """What to cite, as text or as BibTeX: nsdrill; of results with the root attributes
    ``attrs``, called ``name``, also the version and the study that made them; and the
    works behind the model, or behind all models."""
    attrs = attrs or {}
    version, model = str(attrs.get("nsdrill_version") or __version__), str(attrs.get("model") or "")
    made = ""
    if attrs:
        created, sha = str(attrs.get("created", ""))[:10], str(attrs.get("study_sha256", ""))
        made = f"{name or 'results'}: made{f' on {created}' if created else ''} by nsdrill {version}"
        made += f", model {model}" if model else ""
        made = printable(made + (f", study with the SHA-256 {sha}" if sha else ""))
    works = dict.fromkeys(work for key, of_model in WORKS.items() if model in ("", key) for work in of_model)
    software = f"{AUTHORS}, {TITLE}, version {version}."
    if bibtex:
        note = "".join(f"\\{one}" if one in "_%&#$" else one for one in made if one not in "\\{}~^")
        fields = {"author": f"{{{AUTHORS}}}", "title": f"{{{TITLE}}}", "version": version, "note": note}
        lines = [f"  {key} = {{{value}}}," for key, value in fields.items() if value]
        entry = "\n".join(["@software{nsdrill,", *lines, "}"])
        return "\n\n".join([entry, *(work.bibtex() for work in works)])
    parts = [software, *([f"{made}."] if made else [])]
    heading = f"The model {model} is that of:" if model else "The models are those of:"
    if works:
        parts += ["", heading, *(f"  {work.text()}" for work in works)]
    else:
        origin = "another package" if scripted(model) is None else origin_in_words(attrs.get("model_script"))
        parts += ["", f"The model {model} comes from {origin}: cite it as its authors ask."]
    return "\n".join(parts)

"""What was compared, by how much it differs, and by how much it may."""

from __future__ import annotations

from dataclasses import field

from nsdrill.records import dataclass


@dataclass(frozen=True)
class Line:
    """A comparison: the difference that was ``found``, at most the ``allowed`` one, and in
    words where."""

    check: str
    found: float
    allowed: float
    words: str = ""

    @property
    def is_passed(self) -> bool:
        return self.found <= self.allowed  # false for NaN

    def __str__(self) -> str:
        mark = "ok  " if self.is_passed else "FAIL"
        return f"  {mark}  {self.check:40} {self.found:9.1e}  allowed {self.allowed:.0e}  {self.words}".rstrip()


@dataclass
class Report:
    """The comparisons of ``what`` is checked."""

    what: str
    lines: list[Line] = field(default_factory=list)

    def add(self, check: str, found: float, allowed: float, words: str = "") -> None:
        self.lines.append(Line(check, float(found), allowed, words))

    @property
    def failed(self) -> list[str]:
        """The checks that failed."""
        return [line.check for line in self.lines if not line.is_passed]

    def passed(self) -> Report:
        """The report itself; AssertionError, with it, where a check failed."""
        if self.failed:
            raise AssertionError(f"\n{self}")
        return self

    def __str__(self) -> str:
        failed = len(self.failed)
        head = f"{self.what}: {failed or 'nothing'} failed"
        return "\n".join([head, *map(str, self.lines)])

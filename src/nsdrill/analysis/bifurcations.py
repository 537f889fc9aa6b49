"""What labels, motions and ends of branches are called, and what they mean for
drilling. Imports nothing that compiles."""

from __future__ import annotations

from dataclasses import dataclass

from nsdrill.models.description import Description

EQUILIBRIUM, PERIODIC, CYCLE, CIRCLE = "equilibrium", "periodic", "limit_cycle", "invariant_circle"
REGULAR, HOPF, FOLD, BRANCH, DOUBLING, TORUS, END, FAILED = 0, 3, 5, 6, 7, 8, 9, -9
OWN = 100  # codes above it are of the models: grazing and thresholds


@dataclass(frozen=True)
class Meaning:
    """A label: its ``code`` (those of AUTO-07p up to 9), its ``name`` in files, AUTO's
    ``letters``, and in ``words`` what it means for drilling."""

    code: int
    name: str
    letters: str
    words: str

    @property
    def title(self) -> str:
        """The name as text has it."""
        return "Hopf bifurcation" if self.code == HOPF else self.name.replace("_", " ")


GENERAL = (
    Meaning(FAILED, "no_convergence", "MX", "the branch is lost here; the motion may go on"),
    Meaning(REGULAR, "regular", "", ""),
    Meaning(
        HOPF,
        "hopf",
        "HB",
        "steady drilling meets an oscillation: beyond it small disturbances grow",
    ),
    Meaning(
        FOLD,
        "fold",
        "LP",
        "two motions, at most one of them stable, meet and vanish: beyond it the string jumps away",
    ),
    Meaning(BRANCH, "branch_point", "BP", "another family of motions of the same period crosses"),
    Meaning(
        DOUBLING,
        "doubling",
        "PD",
        "the motion comes to repeat only every second time: peaks of two heights in turn",
    ),
    Meaning(
        TORUS, "torus", "TR", "a second frequency comes in: the motion no longer repeats exactly"
    ),
    Meaning(END, "end", "EP", "the branch ends"),
)


def meanings_of(model: Description) -> dict[int, Meaning]:
    """The labels of the branches of a model, by code."""
    own = (Meaning(one.code, one.name, "", one.words) for one in model.grazing)
    return {one.code: one for one in sorted((*GENERAL, *own), key=lambda one: one.code)}


MOTION_WORDS = {
    EQUILIBRIUM: "steady drilling",
    PERIODIC: "a motion that repeats",
    CYCLE: "a limit cycle",
    CIRCLE: "whirl on an invariant circle",
}


def motion_text(motion: str, lobes: int) -> str:
    """A motion in words."""
    if motion == PERIODIC:
        return f"periodic over {lobes} lobe{'s' if lobes != 1 else ''}"
    if motion == CIRCLE and lobes > 1:
        return f"{MOTION_WORDS[CIRCLE]} over {lobes} lobes"
    return MOTION_WORDS.get(motion, motion)

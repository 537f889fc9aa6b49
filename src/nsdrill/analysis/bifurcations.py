"""Names and meanings of the labels and motions of branches. Imports nothing that
compiles."""

from __future__ import annotations

from dataclasses import replace

from nsdrill.errors import count
from nsdrill.models.model_description import Description
from nsdrill.records import dataclass

EQUILIBRIUM, PERIODIC, CYCLE, CIRCLE = "equilibrium", "periodic", "limit_cycle", "invariant_circle"
REGULAR, HOPF, FOLD, BRANCH, DOUBLING, TORUS, END, FAILED = 0, 3, 5, 6, 7, 8, 9, -9
BIFURCATIONS = (HOPF, FOLD, BRANCH, DOUBLING, TORUS)
NOT_DECIDED = -1  # in place of the number of unstable directions: a multiplier lies on the unit circle within its error
# of what emanates at a Hopf bifurcation or a doubling: none does, stable beside it, unstable, not known
NONE, SUPERCRITICAL, SUBCRITICAL, UNKNOWN = 0, -1, 1, 2
# Whether the branch that springs from a special point was followed: of unfinished and other files it is not known.
SPRING_NOT_KNOWN, NOTHING_SPRINGS, FOLLOWED, NOT_FOLLOWED = -1, 0, 1, 2
SPRING_NAMES = {
    SPRING_NOT_KNOWN: "not_known",
    NOTHING_SPRINGS: "none",
    FOLLOWED: "followed",
    NOT_FOLLOWED: "not_followed",
}
SPRINGS = (HOPF, BRANCH, DOUBLING, TORUS)  # the labels of points from which another branch springs
CRITICALITY_NAMES = {SUPERCRITICAL: "supercritical", NONE: "none", SUBCRITICAL: "subcritical", UNKNOWN: "not_known"}
CRITICALITY = {
    "supercritical": "supercritical: grows from zero",
    "none": "",
    "subcritical": "subcritical: jumps",
    "not_known": "sub- or supercritical is not known",
}
TOUCHES = "touches a period"  # how the note ends of a point where their number changes
OWN = 100  # codes above it are those of the models: grazing and thresholds


@dataclass(frozen=True)
class Meaning:
    """A label: its ``code`` (that of AUTO-07p up to 9), its ``name`` in files, the
    ``letters`` of AUTO-07p, and its meaning for drilling in ``words``."""

    code: int
    name: str
    letters: str
    words: str

    @property
    def title(self) -> str:
        """The name in running text."""
        return "Hopf bifurcation" if self.code == HOPF else self.name.replace("_", " ")


GENERAL = (
    Meaning(FAILED, "no_convergence", "MX", "the branch is lost here; the motion may go on"),
    Meaning(REGULAR, "regular", "", ""),
    Meaning(HOPF, "hopf", "HB", "steady drilling meets an oscillation: beyond it small disturbances grow"),
    Meaning(
        FOLD, "fold", "LP", "two motions, at most one of them stable, meet and vanish: a string on the stable one jumps"
    ),
    Meaning(BRANCH, "branch_point", "BP", "another family of motions of the same period crosses"),
    Meaning(
        DOUBLING, "doubling", "PD", "the motion comes to repeat only every second time: peaks of two heights in turn"
    ),
    Meaning(TORUS, "torus", "TR", "a second frequency comes in: the motion no longer repeats exactly"),
    Meaning(END, "end", "EP", "the branch ends"),
)


OF_ANY = {  # their words for a model that is no drill string
    HOPF: "an equilibrium meets an oscillation: beyond it small disturbances grow",
    FOLD: "two motions, at most one of them stable, meet and vanish: what is on the stable one jumps",
}


def meanings_of(model: Description) -> dict[int, Meaning]:
    """The labels of the branches of a model, by code."""
    general = [one if model.drills else replace(one, words=OF_ANY.get(one.code, one.words)) for one in GENERAL]
    model_labels = (Meaning(grazing.code, grazing.name, "", grazing.words) for grazing in model.grazing)
    return {grazing.code: grazing for grazing in sorted((*general, *model_labels), key=lambda grazing: grazing.code)}


BOTH_UNSTABLE = "two unstable motions meet and vanish"
EITHER = "two motions meet and vanish; whether one of them is stable is not decided"
BOTH_STABLE = "; stable to both sides: nothing jumps"


def meaning_beside(meaning: Meaning, before: int | None, after: int | None) -> str:
    """What a label means between motions with these numbers of unstable directions, None of
    one that is not known: only what is on a stable motion jumps where it vanishes."""
    if meaning.code == BRANCH and before == after == 0:
        return meaning.words + BOTH_STABLE
    if meaning.code != FOLD or before is None or after is None or 0 in (before, after):
        return meaning.words
    return EITHER if NOT_DECIDED in (before, after) else BOTH_UNSTABLE


def stability_text(unstable: int) -> str:
    """The stability of a motion with this number of unstable directions, in words."""
    if unstable == NOT_DECIDED:
        return "stability not decided"
    return f"unstable in {count(unstable, 'direction')}" if unstable else "stable"


MOTION_WORDS = {
    EQUILIBRIUM: "steady drilling",
    PERIODIC: "a motion that repeats",
    CYCLE: "a limit cycle",
    CIRCLE: "whirl on an invariant circle",
}


MOTION_WORDS_OF_ANY = {**MOTION_WORDS, EQUILIBRIUM: "an equilibrium", CIRCLE: "a motion on an invariant circle"}


def motion_text(motion: str, lobes: int, model: Description | None = None) -> str:
    """A motion of the model in words, by default of a drill string."""
    words, period = (MOTION_WORDS, "lobe") if model is None or model.drills else (MOTION_WORDS_OF_ANY, "period")
    if motion == PERIODIC:
        return f"periodic over {count(lobes, period)}"
    if motion == CIRCLE and lobes > 1:
        return f"{words[CIRCLE]} over {count(lobes, period)}"
    return words.get(motion, motion)


def seed_text(outcome: str, model: Description) -> str:
    """What became of a seed, in words."""
    if model.drills:
        return outcome
    return outcome.replace("stick-slip (a torus over lobes)", "quasi-periodic").replace(" lobe", " period")

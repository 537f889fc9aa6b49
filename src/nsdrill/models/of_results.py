"""The variables that results of every model have beside those that it declares."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from nsdrill.models.responses import Response, label_type
from nsdrill.variables import POINT, Variable, feature, flag

_CHECKED = {"tight": "with a smaller tolerance", "long": "when continued for longer"}
STATUS = Variable(
    "status",
    "i1",
    "1",
    "how the run ended",
    "run",
    flag_values=(0, 1, 2, 3, 4, 5, 6),
    flag_meanings="pending ok diverged step_limit step_underflow inferred unmeasured",
)
LABELS = (
    flag("settled", "both halves of the observation agree, and no peaks keep rising", "unsettled settled"),
    flag("motion", "kind of motion", "undetermined equilibrium periodic quasi_periodic chaotic unsettled", "returns"),
    Variable(
        "period",
        "i2",
        "1",
        "period in returns to the Poincare section, 0 where there is none",
        "label",
        only="returns",
        label="Period",
    ),
    Variable(
        "attractor",
        "i2",
        "1",
        "attractor of the start, numbered alike along the axes: 1 has most starts, 0 none",
        "label",
        only="starts",
    ),
)
MEASURED = (
    feature(
        "half_difference",
        "1",
        "largest disagreement between the halves of the observation",
        label="Disagreement of halves",
    ),
    feature(
        "zero_one",
        "1",
        "0-1 test for chaos on the returns: near 0 regular, near 1 chaotic",
        "returns",
        label="0-1 test $K$",
    ),
    feature("lyapunov_exponent", "s-1", "largest Lyapunov exponent", "exponent", label="Lyapunov exponent"),
    feature("lyapunov_error", "s-1", "standard error of the largest Lyapunov exponent", "exponent"),
    flag("trusted", "both checks find the same response and nearly the same features", "untrusted trusted", "verify"),
)
RUN = (
    Variable(
        "method",
        "i1",
        "1",
        "how friction was integrated",
        "run",
        flag_values=(0, 1),
        flag_meanings="explicit implicit",
        only="method",
    ),
    Variable("steps", "i8", "1", "accepted steps", "run"),
    Variable("rejected", "i8", "1", "rejected steps", "run"),
)
STATES = (
    Variable("initial_state", "f8", "", "state at the start of the run", "states", (*POINT, "state")),
    Variable("final_state", "f8", "", "state at the end of the run", "states", (*POINT, "state")),
)


def responses_label(
    critical: Mapping[str, Response],
    name: str = "response",
    long_name: str = "critical responses present",
    only: str | None = None,
) -> Variable:
    """A label of ``critical`` responses, with a bit for each of them."""
    found = critical.values()
    bits, words = tuple(one.bit for one in found), " ".join(critical)
    return Variable(name, label_type(found), "1", long_name, "label", flag_masks=bits, flag_meanings=words, only=only)


def variables_of_check(
    name: str, critical: Mapping[str, Response], features: Iterable[Variable], check_features: Iterable[str]
) -> tuple[Variable, ...]:
    """The variables of one of the checks of a point."""
    words = _CHECKED[name]
    units = {variable.name: variable.units for variable in features}
    return (
        responses_label(critical, f"{name}_response", f"critical responses {words}", "verify"),
        Variable(
            f"{name}_difference",
            "f8",
            "1",
            f"largest difference of the features {words}, in natural scales",
            "trust",
            only="verify",
        ),
        Variable(
            f"{name}_status",
            "i1",
            "1",
            f"how the run ended {words}",
            "trust",
            flag_values=(0, 1, 2, 3, 4, 6),
            flag_meanings="unchecked ok diverged step_limit step_underflow unmeasured",
            only="verify",
        ),
        *(
            Variable(f"{name}_{one}", "f8", units[one], f"{one} {words}", "trust", only="verify")
            for one in check_features
        ),
    )

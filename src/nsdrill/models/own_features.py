"""Features that a script makes of a model of nsdrill or of a package, of quantities
(:mod:`nsdrill.models.own_quantities`) that are in its traces, too."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from nsdrill.equations import plain
from nsdrill.equations.graph import Node, text_of
from nsdrill.equations.trace import refuse_to_change
from nsdrill.models.model_description import Description
from nsdrill.models.operation import Values
from nsdrill.models.own_quantities import Measured, graph_of, power_of_two
from nsdrill.models.registry import (
    described,
    extend_models,
    import_modules,
    is_added_always,
    model_named,
    model_names,
    own_features,
    register_feature,
    scripted,
)
from nsdrill.models.responses import Thresholds
from nsdrill.models.variant import Variant, variant_at, variant_of
from nsdrill.origin import check_new_name
from nsdrill.units import cf_units
from nsdrill.variables import MEASURED_BY_SCRIPT, OUTRUN, in_trace

PROBES = 64  # states at which the size of a quantity is looked at
SPREAD = 10.0  # in natural scales: as far as a motion goes


def measure(model: str, made: Measured, check: Callable[[str, Measured], None]) -> None:
    """Measure a quantity of the model of this name, in place of an earlier one of the same
    script, which ``check`` may refuse. InputError where there is no such model, or the name
    is taken."""
    if model not in model_names():
        import_modules()
    if model not in model_names() or scripted(model) is not None:
        how = f"@{model}.feature above its function" if scripted(model) is not None else ", ".join(model_names())
        made.refuse(f"the model {model}", how)
    if not is_added_always(model, made.function.__module__):
        made.refuse(
            f"the model {model} in a module that only some studies of it import",
            f"an entry point of the group nsdrill.{model} for a module with its features, which all of them import",
        )
    before = next((one for one in own_features(model) if one.name == made.name), None)
    if before is not None:
        check_new_name("a feature", made.name, before.origin, made.origin)
    description = described(model)
    own = set() if before is None else {before.name, *before.features, OUTRUN.format(before.name)}
    taken = {variable.name for variable in (*description.variables, *description.trace_and_states)} - own
    for name in (made.name, *made.features, OUTRUN.format(made.name)):
        if name in taken:
            made.refuse(f"the name {name}, which {model} has", "another name")
    # refused where no string of the model has its arguments
    scale, digest = _scale_of(model, made), _digest_of(model, made)
    if digest != _digest_of(model, made):
        refuse_to_change(made.function)
    check(model, made)
    register_feature(model, replace(made, scale=scale, digest=digest))
    extend_models((model,), described_with)


def read_again(model: str) -> None:
    """Read the functions of what scripts measure of a model again, where what they read has
    another value."""
    for one in own_features(model):
        if (digest := _digest_of(model, one)) != one.digest:
            register_feature(model, replace(one, scale=_scale_of(model, one), digest=digest))
            extend_models((model,), described_with)


def _first(name: str, made: Measured) -> tuple[Variant, Node]:
    """(the first of the usual and the widest variant that has the arguments of a quantity,
    its value there)."""
    model = model_named(name)
    variants = variant_at(model, described(name).parameters()), variant_of(model, model.widest)
    for variant in variants:
        if not made.unknown(*(found := graph_of(variant.motion))):
            return variant, made.node(*found)
    made.node(*graph_of(variants[0].motion))
    raise AssertionError


def _scale_of(name: str, made: Measured) -> float:
    """The natural scale of a quantity: its own, or a tenth of its greatest value as far as
    motions go at the model's defaults."""
    variant, node = _first(name, made)
    if made.about.scale is not None:
        return float(made.about.scale)
    description = described(name)
    operation = tuple(vars(description.operation()).values())
    points = Values(description.parameters(), description.initial(), operation)
    columns, parameters, states = variant.model.columns(points, Thresholds()), variant.names.parameters, variant.states
    table = np.array([[float(np.ravel(columns.get(one, 0.0))[0]) for one in parameters]])
    reach = SPREAD * variant.state_scales(table)[0]
    moved = np.random.default_rng(1).uniform(-1.0, 1.0, (PROBES, len(states))) * reach
    given: dict[str, Any] = {"time": 0.0, "phase": 0.0}
    given |= {f"p.{one}": value for one, value in zip(parameters, table[0], strict=True)}
    given |= {f"s.{one}": moved[:, k] for k, one in enumerate(states)}
    value = np.nan_to_num(np.abs(plain.values({"": node}, given)[""]), posinf=0.0)
    return power_of_two(0.1 * float(np.max(value)))


def described_with(description: Description) -> Description:
    """The description of a model with the quantities that scripts measure of it."""
    features = own_features(description.name)
    units = {one.name: cf_units(one.about.units) for one in features}
    words = {one.name: one.about.meaning or one.name.replace("_", " ") for one in features}
    made = [each for one in features for each in one.variables(units[one.name], words[one.name])]
    return replace(
        description,
        features=(*description.features, *made),
        own_trace=(
            *description.own_trace,
            *(in_trace(name, units[name], words[name], MEASURED_BY_SCRIPT) for name in units),
        ),
        shown=(*description.shown, *(name for one in features for name in one.features)),
    )


def digest_of(model: str) -> str:
    """Digest of what scripts measure of a model, "" of nothing."""
    features: Sequence[Measured] = own_features(model)
    text = repr([(one.told, one.digest) for one in features])
    return hashlib.sha256(text.encode()).hexdigest()[:16] if features else ""


def _digest_of(model: str, one: Measured) -> str:
    """Digest of the value of a quantity in the graph of the equations."""
    return hashlib.sha256(text_of({"": _first(model, one)[1]}).encode()).hexdigest()[:16]

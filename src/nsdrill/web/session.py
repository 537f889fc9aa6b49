"""The explorer of one file, without HTTP: the replies to the requests of a page, which are
mappings of plain data from outside (:mod:`nsdrill.web.asked`)."""

from __future__ import annotations

import os
import shlex

from nsdrill.analysis.doubts import notes_before
from nsdrill.data import Answer, edited_words, frozen_modes, overrides
from nsdrill.models.registry import drawn_in
from nsdrill.web import asked, diagrams, explorer_maps, moving
from nsdrill.web.asked import Request
from nsdrill.web.branch_curves import branch_choices, branch_diagram, with_branches
from nsdrill.web.diagrams import Reply
from nsdrill.web.opened import Opened
from nsdrill.web.shown import UNKNOWN_WORDS, first_sliders, response_styles, sliders


class Session(Opened):
    """What a page asks of the file that was opened."""

    replay, live, orbit, section = moving.replay, moving.live, moving.orbit, moving.section
    saved = moving.saved

    def meta(self) -> Answer:
        """What a page needs at the beginning: names, words, units, colours, sliders."""
        head: Answer = {
            "kind": self.kind,
            "file": os.path.basename(self.path),
            "title": self.title,
            "edited": " ".join(filter(None, [edited_words(self.attrs), *notes_before(self.attrs)])),
            "model": self.study.model.title,
            "overrides": [f"{key} = {value}" for key, value in overrides(self.attrs, thresholds=True).items()],
            "units": self.units,
            "seconds": asked.DEFAULT_SECONDS,
            "longest": self.study.simulation.transient + self.study.simulation.observe,
            "drawn": self._motion_drawing(),
            "responses": response_styles(self.attrs),
            "unknown": {str(code): words for code, words in UNKNOWN_WORDS.items()},
            "sliders": sliders(self.study, self.units, self.adjustable),
            "usual": list(dict.fromkeys([*first_sliders(self.study), *self.study.swept])),
            "command": f"nsdrill view {shlex.quote(self.path)}",
        }
        if self.results is not None:
            head["choices"] = diagrams.choices(self.results, self.units) | {
                "areas": explorer_maps.area_choices(self.results)
            }
            head["points"] = int(self.results["status"].size)
        elif self.branches is not None:
            head["choices"] = branch_choices(self.branches, self.units)
            head["points"] = len(self.branches.label)
        return head

    def _motion_drawing(self) -> Answer:
        """What is drawn of a motion of this model."""
        model, drawn = self.study.model, drawn_in(self.attrs)
        orbit = {"x", "y", "wall_force"} <= {v.name for v in model.trace}
        return {
            "histories": list(drawn.histories),
            "planes": [list(pair) for pair in drawn.planes],
            "section": [list(pair) for pair in drawn.section_planes],
            "orbit": orbit and "lateral" not in frozen_modes(self.attrs) and model.hole is not None,
        }

    def diagram(self, request: Request) -> Reply:
        """Peaks or a feature ``y`` along an axis; optional ``x``, ``held`` and
        ``member``."""
        y = asked.name(request, "y")
        if self.results is None and self.branches is not None:
            return branch_diagram(self.branches, y, self.units)
        results = self.sweep()
        reply = diagrams.diagram(
            results,
            self.units,
            y,
            asked.name(request, "x") if request.get("x") is not None else None,
            asked.held(request),
            asked.integer(request, "member", 0),
        )
        if self.branches is None:
            return reply
        return with_branches(reply, self.branches, results, y, self.units)

    def plane(self, request: Request) -> Reply:
        """A label or feature ``colour`` over two axes ``x`` and ``y``; optional
        ``held`` and ``member``."""
        return diagrams.plane(
            self.sweep(),
            self.units,
            asked.name(request, "colour"),
            asked.name(request, "x"),
            asked.name(request, "y"),
            asked.held(request),
            asked.integer(request, "member", 0),
        )

    def area(self, request: Request) -> Reply:
        """One of the areas of ``choices`` by its ``name``; optional ``held``."""
        name, held = asked.name(request, "name"), asked.held(request)
        return explorer_maps.area(self.sweep(), self.units, name, held)

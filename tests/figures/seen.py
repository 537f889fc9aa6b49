"""What is seen of a picture: the words of its legend, and what is drawn, by the names
that the artists have."""

from typing import Any


def legend_words(figure: Any) -> list[str]:
    """Those of the legend; none where there is none."""
    return words_in(figure.legends[0]) if figure.legends else []


def words_in(legend: Any) -> list[str]:
    return [" ".join(text.get_text().split()) for text in legend.get_texts()]


def artists(where: Any, name: str) -> list[Any]:
    """All artists of this name on a figure or on axes; of all names that begin so where
    it ends with a colon."""
    return where.findobj(lambda one: (gid := str(one.get_gid())) == name or (name[-1] == ":" and gid.startswith(name)))


def maps(figure: Any) -> list[Any]:
    """The panels of a figure that are maps."""
    return [mesh.axes for mesh in artists(figure, "cells")]

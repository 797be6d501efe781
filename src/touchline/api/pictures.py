"""Pictures: axes to draw into, and figures in a notebook."""

from __future__ import annotations

import html
from collections.abc import Callable
from io import StringIO
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.axes import Axes

WIDTH_IN, HEIGHT_IN = 8.0, 5.0


def own_axes(ax: Axes | None) -> Axes:
    """The axes given, or those of a new figure, which no global state of matplotlib knows."""
    if ax is not None:
        return ax
    from matplotlib.figure import Figure

    return Figure(figsize=(WIDTH_IN, HEIGHT_IN), layout="constrained").add_subplot()


def figure_html(title: str, draw: Callable[[], Axes]) -> str:
    """HTML of a picture below its title."""
    axes, text = draw(), StringIO()
    figure = axes.get_figure(root=True)
    assert figure is not None, "axes have a figure"
    for many in axes.collections:
        many.set_rasterized(True)  # ten thousand marks of paint would make megabytes
    figure.savefig(text, format="svg", dpi=150, metadata={"Date": None}, bbox_inches="tight")
    _, _, picture = text.getvalue().partition("<svg ")
    fitting = 'style="max-width: 100%; height: auto"'
    return f"<p><code>{html.escape(title)}</code></p><svg {fitting} {picture}"

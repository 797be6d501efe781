"""Fixtures of the tests of the console."""

from typing import Any

import pytest
from textual._compositor import Compositor

from tests.tui import scenes
from touchline.schemas.template import Template


@pytest.fixture(scope="session")
def template() -> Template:
    return scenes.pitch()


@pytest.fixture(autouse=True)
def undrawn(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nothing is drawn for a terminal that is none, which is half of a console's work; pictures are drawn in full."""
    draw = Compositor.render_update

    def render_update(compositor: Compositor, full: bool = False, **options: Any) -> object:
        if full:
            return draw(compositor, full, **options)
        compositor._dirty_regions.clear()
        return None

    monkeypatch.setattr(Compositor, "render_update", render_update)

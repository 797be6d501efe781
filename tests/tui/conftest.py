"""What every test of the console may need."""

import pytest

from tests.tui import scenes
from touchline.schemas.template import Template


@pytest.fixture(scope="session")
def template() -> Template:
    return scenes.pitch()

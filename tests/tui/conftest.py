"""What every test of the console may need."""

import pytest

from schemas.template import Template
from tests.tui import scenes


@pytest.fixture(scope="session")
def template() -> Template:
    return scenes.pitch()

"""Fixtures of the tests of imports."""

from collections.abc import Iterator

import pytest

from touchline.checking.importing import import_logs, mapping_proposal
from touchline.recordings.logs.formats import read_logs


@pytest.fixture(scope="module", autouse=True)
def read_here(request: pytest.FixtureRequest) -> Iterator[None]:
    """Read logs in this process, but those of real robots: to start another takes half a second of processor time."""
    with pytest.MonkeyPatch.context() as patch:
        if request.path.name != "test_real_logs.py":
            for module in (import_logs, mapping_proposal):
                patch.setattr(module, "read_limited", read_logs)
        yield

"""pytest plugin: a test that a recorded session comes out the same with the code under test.

@pytest.mark.touchline_session("sessions/square.mcap")
def test_square(touchline_session):
touchline_session.require_same()
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from touchline.checking.check_files import SessionVerdict

_MARK = "touchline_session"


@dataclass(frozen=True)
class CheckedSession:
    """A recording after its check.

    Attributes:
        verdicts: One for each of its robots.
    """

    verdicts: tuple[SessionVerdict, ...]

    @property
    def same(self) -> bool:
        """True if all robots do the same as recorded."""
        return all(each.passed for each in self.verdicts)

    @property
    def part(self) -> str:
        """Component that differs first; empty if nothing differs."""
        return next((each.part for each in self.verdicts if each.part), "")

    def require_same(self) -> None:
        """Fail if anything differs.

        Raises:
            AssertionError: Something differs; the message names what and where first.
        """
        __tracebackhide__ = True
        if not self.same:
            raise AssertionError(str(self))

    def __str__(self) -> str:
        """Return the differences, a line each."""
        return "\n".join(line for each in self.verdicts for line in each.lines())


def pytest_configure(config: pytest.Config) -> None:
    """Register the mark `touchline_session`."""
    config.addinivalue_line("markers", f"{_MARK}(file): the recording that the fixture {_MARK} runs again and compares")


@pytest.fixture
def touchline_session(request: pytest.FixtureRequest) -> CheckedSession:
    """Check the recording of the test's mark; a relative path starts at the test's folder, or the root."""
    mark = request.node.get_closest_marker(_MARK)
    if mark is None or len(mark.args) != 1:
        raise pytest.UsageError(f'name the recording: @pytest.mark.{_MARK}("session.mcap")')
    named = Path(mark.args[0])
    places = [Path(request.path).parent / named, Path(request.config.rootpath) / named]
    found = next((place for place in places if place.exists()), None)
    if found is None:
        raise pytest.UsageError(f"{named} is neither in the test's folder nor in {request.config.rootpath}")
    from touchline.checking.check_files import check_file

    return CheckedSession(tuple(check_file("", found)))

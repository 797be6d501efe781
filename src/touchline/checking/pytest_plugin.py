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
    """A recording after it was done again.

    Attributes:
        verdicts: One for each of its robots.
    """

    verdicts: tuple[SessionVerdict, ...]

    @property
    def same(self) -> bool:
        """Whether all of it is as it was recorded."""
        return all(each.passed for each in self.verdicts)

    @property
    def part(self) -> str:
        """The part of a robot that differs first; empty if nothing does."""
        return next((each.part for each in self.verdicts if each.part), "")

    def require_same(self) -> None:
        """Fail unless all of it is as it was recorded.

        Raises:
            AssertionError: It is not; the text says what differs, and where first.
        """
        __tracebackhide__ = True
        if not self.same:
            raise AssertionError(str(self))

    def __str__(self) -> str:
        """What differs, a line each."""
        return "\n".join(line for each in self.verdicts for line in each.lines())


def pytest_configure(config: pytest.Config) -> None:
    """Make the mark known."""
    config.addinivalue_line("markers", f"{_MARK}(file): the recording that the fixture {_MARK} does again and compares")


@pytest.fixture
def touchline_session(request: pytest.FixtureRequest) -> CheckedSession:
    """The recording of the test's mark, done again; a relative path is taken from the test's folder, or the root."""
    mark = request.node.get_closest_marker(_MARK)
    if mark is None or len(mark.args) != 1:
        raise pytest.UsageError(f'say which recording: @pytest.mark.{_MARK}("session.mcap")')
    named = Path(mark.args[0])
    places = [Path(request.path).parent / named, Path(request.config.rootpath) / named]
    found = next((place for place in places if place.exists()), None)
    if found is None:
        raise pytest.UsageError(f"{named} is neither in the test's folder nor in {request.config.rootpath}")
    from touchline.checking.check_files import check_file

    return CheckedSession(tuple(check_file("", found)))

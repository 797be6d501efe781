"""A stranger in a service's place may say what it likes: it is shown as it is, or as nothing."""

import pytest

from touchline.schemas import topics
from touchline.schemas.messages import DiagnosticArray, DiagnosticStatus, KeyValue
from touchline.supervision.diagnostics import Health, read_health

HUGE = "9" * 5000


def said(name: str = topics.ROBOT_SIM, message: str = "ok", **values: str) -> DiagnosticArray:
    entries = tuple(KeyValue(key=key, value=value) for key, value in values.items())
    return DiagnosticArray(status=(DiagnosticStatus(name=name, message=message, values=entries),))


@pytest.mark.parametrize(
    ("diagnostics", "health"),
    [
        (DiagnosticArray(), Health("does not report its health")),
        (said("somebody", pid="1"), Health("does not report its health")),
        (said(), Health("ok")),
        (said(pid="12", published="3", lost="0"), Health("ok", pid=12, published=3, lost=0)),
        (said(pid="-1", published="many", received=HUGE, lost="1e9", rejected="\u0663"), Health("ok")),
        (said(message="\x1b]52;c;eA==\x07fine\x9b2J\n"), Health("fine ")),
    ],
    ids=["no status", "wrong name", "no values", "some", "no counts", "escape sequences"],
)
def test_whatever_is_said_is_read(diagnostics: DiagnosticArray, health: Health) -> None:
    assert read_health(topics.ROBOT_SIM, diagnostics) == health


def test_a_message_of_megabytes_is_cut() -> None:
    assert len(read_health(topics.ROBOT_SIM, said(message="x" * 10_000_000)).message) == 200

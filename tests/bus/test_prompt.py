"""Prompt copies, which overtake messages that are held up."""

from types import SimpleNamespace

from touchline.bus import prompt
from touchline.bus.prompt import Overtaken

PUBLISHER = b"robot"


def test_a_copy_keeps_older_messages_back_only_for_a_while(monkeypatch):
    """A stranger may have forged it, far ahead of the publisher."""
    now_s = 100.0
    monkeypatch.setattr(prompt, "time", SimpleNamespace(monotonic=lambda: now_s))
    overtaken = Overtaken()
    overtaken.note(PUBLISHER, 7)
    assert [overtaken.holds(PUBLISHER, number) for number in (6, 7, 8)] == [True, True, False]
    assert not overtaken.holds(b"another", 6)
    now_s += 1.01 * prompt._FORGOTTEN_S
    assert not overtaken.holds(PUBLISHER, 6)

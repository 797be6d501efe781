"""Last message of each topic that a process has sent, as a text in its diagnostics, for receivers that were cut off.

Gaps in the sequence show only when something comes after them; these numbers show missing last messages, too.
"""

import re
from collections.abc import Iterable
from typing import Final, NamedTuple

from touchline.schemas.messages import DiagnosticArray

#: Name of the value in the diagnostics.
KEY: Final = "sent"
#: Most entries that are read; no process has so many publishers.
_MOST: Final = 1024
_ENTRY: Final = re.compile(r"([A-Za-z0-9_/]{1,128}):([0-9a-f]{32}):([0-9]{1,18})")


class LastSent(NamedTuple):
    """Number of the last message that a publisher has sent; 0 before the first.

    Attributes:
        topic: Name in the topic table.
        publisher: Its id.
    """

    topic: str
    publisher: bytes
    sequence: int


def as_text(sent: Iterable[LastSent]) -> str:
    """Return them as one value of the diagnostics."""
    return " ".join(sorted(f"{each.topic}:{each.publisher.hex()}:{each.sequence}" for each in sent))


def sent_by(node: str, diagnostics: DiagnosticArray) -> list[LastSent]:
    """Parse what ``node`` reports as sent; malformed entries are left out."""
    texts = (
        pair.value for status in diagnostics.status if status.name == node for pair in status.values if pair.key == KEY
    )
    entries = [entry for text in texts for entry in text.split()[:_MOST]]
    found = (_ENTRY.fullmatch(entry) for entry in entries)
    return [LastSent(match[1], bytes.fromhex(match[2]), int(match[3])) for match in found if match]

"""Removes escape sequences and control characters from text of others before it is shown."""

import re
import unicodedata
from typing import Final

_SEQUENCE: Final = re.compile(
    r"""
    (?:\x1b\]|\x9d) [^\x07\x1b\x9c]* (?:\x07|\x1b\\|\x9c|$)      # OSC: a title, the clipboard, a link
    | (?:\x1b[PX^_]|[\x90\x98\x9e\x9f]) [^\x1b\x9c]* (?:\x1b\\|\x9c|$)  # DCS, SOS, PM, APC
    | (?:\x1b\[|\x9b) [0-?]* [ -/]* [@-~]?                       # CSI: colours, the cursor
    | \x1b [ -/]* [0-~]?                                         # what is left of escape sequences
    """,
    re.VERBOSE,
)
_UNSAFE: Final = frozenset(("Cc", "Cf", "Cs", "Co", "Cn", "Zl", "Zp"))
"""Unicode categories that a terminal may act on, or that turn text round: controls, formats, surrogates, separators."""

_COMMANDING: Final = frozenset(("Cc", "Cs", "Zl", "Zp"))
_TURNING: Final = frozenset("\u061c\u200e\u200f\u202a\u202b\u202c\u202d\u202e\u2066\u2067\u2068\u2069")


def plain(text: str, most: int = 1000) -> str:
    """One line of `text` without escape sequences and control characters, at most `most` characters long.

    White space of any kind is a space. What is cut off is replaced by an ellipsis.
    """
    if len(text) <= most and text.isascii() and text.isprintable():  # as nearly every text is
        return text
    text = _SEQUENCE.sub("", text[: 4 * most])
    text = "".join(" " if char in "\t\n\r\v\f" else char for char in text)
    text = "".join(char for char in text if unicodedata.category(char) not in _UNSAFE)
    return text if len(text) <= most else text[: most - 1] + "…"


def plain_lines(text: str, most: int = 1000) -> str:
    """As :func:`plain`, line by line: for texts that have several, such as the end of a log."""
    return "\n".join(plain(line, most) for line in text.split("\n"))


def printable(text: str) -> str:
    """`text`, if it has no character that commands a terminal or turns text round.

    Raises:
        ValueError: It has one.
    """
    for char in text:
        if unicodedata.category(char) in _COMMANDING or char in _TURNING:
            raise ValueError(f"has the control character U+{ord(char):04X}: remove it")
    return text

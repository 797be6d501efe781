"""Names of the files of one recording."""

import os
from collections.abc import Sequence
from pathlib import Path


def next_part(parts: Sequence[Path]) -> Path:
    """Return the next file of a recording: ``session.mcap``, ``session.part2.mcap``, ``session.part3.mcap``."""
    return _part(parts[0], len(parts) + 1)


def with_followers(first: Path) -> list[Path]:
    """Return the file itself, whether it exists or not, and its existing next parts, up to the first gap."""
    parts = [first]
    while os.path.lexists(follower := next_part(parts)):
        parts.append(follower)
    return parts


def renamed_parts(parts: Sequence[Path], first: Path) -> list[Path]:
    """Return the names of ``parts`` after the first one is renamed to ``first``."""
    return [first, *(_part(first, number + 1) for number in range(1, len(parts)))]


def _part(first: Path, number: int) -> Path:
    return first.with_name(f"{first.stem}.part{number}{first.suffix}")

"""Names of the files that one recording is made of."""

import os
from collections.abc import Sequence
from pathlib import Path


def next_part(parts: Sequence[Path]) -> Path:
    """Name of the next file of a recording: ``session.mcap``, ``session.part2.mcap``, ``session.part3.mcap``."""
    return _part(parts[0], len(parts) + 1)


def with_followers(first: Path) -> list[Path]:
    """The file of that name, whether it is there or not, and its next parts that are there, up to the first gap."""
    parts = [first]
    while os.path.lexists(follower := next_part(parts)):
        parts.append(follower)
    return parts


def renamed_parts(parts: Sequence[Path], first: Path) -> list[Path]:
    """What ``parts`` are called when the first one is renamed to ``first``."""
    return [first, *(_part(first, number + 1) for number in range(1, len(parts)))]


def _part(first: Path, number: int) -> Path:
    return first.with_name(f"{first.stem}.part{number}{first.suffix}")

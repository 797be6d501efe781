"""Plug-ins of other installed packages, as they declare them: entry points of Python's packaging.

The format is that of the entry points specification in the Python Packaging User Guide.
"""

import sys
from collections.abc import Callable
from importlib.metadata import EntryPoint, entry_points
from typing import NamedTuple

from touchline.schemas.plain_text import plain


class Offer(NamedTuple):
    """What a package offers under a name.

    Attributes:
        name: By which it is asked for.
        package: Of which it is a part, with its version.
        load: Imports it; may raise anything.
    """

    name: str
    package: str
    load: Callable[[], object]


def offers(group: str) -> list[Offer]:
    """What installed packages offer in a group of entry points, by package and name; nothing is imported yet."""
    found = [Offer(point.name, _package(point), point.load) for point in entry_points(group=group)]
    return sorted(found, key=lambda offer: (offer.package, offer.name))


def leave_out(kind: str, offer: Offer, problem: str) -> None:
    """Say in one line that an offer is not used, and why."""
    text = f'the {kind} "{offer.name}" of the package {offer.package} is left out: {problem}'
    sys.stderr.write(f"warning: {plain(text, 400)}\n")


def _package(point: EntryPoint) -> str:
    return f"{point.dist.name} {point.dist.version}" if point.dist else "that names none"

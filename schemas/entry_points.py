"""Discovers plug-ins of other installed packages through Python entry points.

The format is that of the entry points specification in the Python Packaging User Guide.
"""

import logging
from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

from touchline.schemas.plain_text import plain

_LOG = logging.getLogger(__name__)

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint


class Offer(NamedTuple):
    """A plug-in that a package declares.

    Attributes:
        name: By which it is asked for.
        package: Of which it is a part, with its version.
        load: Imports it; may raise anything.
    """

    name: str
    package: str
    load: Callable[[], object]


def offers(group: str) -> list[Offer]:
    """Entry points of a group in all installed packages, sorted by package and name; imports nothing."""
    from importlib.metadata import entry_points  # a third of the time of `import touchline`

    found = [Offer(point.name, _package(point), point.load) for point in entry_points(group=group)]
    return sorted(found, key=lambda offer: (offer.package, offer.name))


def leave_out(kind: str, offer: Offer, problem: str) -> None:
    """Log that an entry point is ignored, and why."""
    text = f'the {kind} "{offer.name}" of the package {offer.package} is left out: {problem}'
    _LOG.warning("%s", plain(text, 400))


def _package(point: "EntryPoint") -> str:
    return f"{point.dist.name} {point.dist.version}" if point.dist else "that names none"

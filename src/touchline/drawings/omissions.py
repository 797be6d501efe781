"""Parts of a drawing that the import left out, by element, with the reason and the remedy."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Omission:
    """One element that is not painted, or not all of it.

    Attributes:
        name: The element's id or handle; without one, its kind and number.
        reason: Why, as a clause; it names a remedy where there is one.
        line: Line of the file where the element begins; None: the format has none that a person could look up.
    """

    name: str
    reason: str
    line: int | None = None

    @property
    def element(self) -> str:
        """The name, and where it stands in the file."""
        return self.name if self.line is None else f"{self.name} (line {self.line})"


class Unclear(Exception):
    """An element that cannot be followed; the text is the reason of its omission."""

"""Parts of a drawing that the import left out, by element, with the reason and the remedy."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Omission:
    """Element that is not, or not fully, painted.

    Attributes:
        name: Id or handle of the element; without one, its kind and number.
        reason: Reason as a clause, with a remedy where there is one.
        line: Line of the file at which the element begins; None: the format has no useful line numbers.
    """

    name: str
    reason: str
    line: int | None = None

    @property
    def element(self) -> str:
        """Name and line of the element."""
        return self.name if self.line is None else f"{self.name} (line {self.line})"


class Unclear(Exception):
    """Raised for an element that cannot be converted; the text is the reason of its omission."""

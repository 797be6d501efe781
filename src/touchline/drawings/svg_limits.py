"""Limits of SVG files, which could grow without bound by copies of copies, or by entities."""

from pathlib import Path
from xml.parsers import expat

from touchline.schemas.errors import SpecError

#: Maximum number of elements, counting each copy by a ``use``.
MOST_ELEMENTS = 20_000
#: Maximum nesting of elements, copies included.
MOST_DEPTH = 100
#: Maximum number of characters of all attributes except images; the lines of a path are in one.
MOST_ATTRIBUTE_CHARACTERS = 1_000_000
_NOTHING = "nothing"


class _Scan:
    """One pass through the file that records the elements and their copies."""

    def __init__(self, source: str) -> None:
        self._source = source
        self._characters = 0
        self._elements = 0
        self._stack: list[str] = []
        # For each element with an id (others belong to the nearest enclosing one): its parts, and what it copies.
        self._inside: dict[str, int] = {_NOTHING: 0}
        self._copies: dict[str, list[str]] = {_NOTHING: []}

    def refuse(self, field: str, problem: str, remedy: str) -> SpecError:
        return SpecError(self._source, field, problem, remedy)

    def entity(self, name: str, _is_parameter: bool, value: str | None, *_where: str | None) -> None:
        if value is None or "&" in value or "%" in value or len(value) > 1000:
            raise self.refuse(f"entity {name[:60]}", "is not a plain text", "save it as plain SVG")

    def start(self, tag: str, attributes: dict[str, str]) -> None:
        self._elements += 1
        self._characters += sum(len(value) for value in attributes.values() if not value.startswith("data:"))
        if self._elements > MOST_ELEMENTS:
            raise self.refuse("", f"has more than {MOST_ELEMENTS:,} elements", "simplify the drawing")
        if self._characters > MOST_ATTRIBUTE_CHARACTERS:
            problem = f"has attributes of more than {MOST_ATTRIBUTE_CHARACTERS:,} characters"
            raise self.refuse("", problem, "simplify its paths")
        if len(self._stack) >= MOST_DEPTH:
            raise self.refuse("", f"nests elements deeper than {MOST_DEPTH}", "ungroup them")
        own = attributes.get("id", "")
        outer = self._stack[-1] if self._stack else _NOTHING
        name = f"#{own}" if own else outer
        self._stack.append(name)
        self._inside.setdefault(name, 0)
        self._inside[name] += 1
        copies = self._copies.setdefault(name, [])
        if own and name != outer:
            self._copies[outer].append(name)  # what is inside counts as a part
        if tag.rpartition(":")[2] == "use":
            copies += [value for key, value in attributes.items() if key.rpartition(":")[2] == "href"]

    def end(self, _tag: str) -> None:
        self._stack.pop()

    def check_copies(self) -> None:
        """Refuse files with too many copies; a copy of an element within itself does not count."""
        sizes: dict[str, int] = {}
        self._size(_NOTHING, sizes, [])

    def _size(self, name: str, sizes: dict[str, int], above: list[str]) -> int:
        if name in sizes:
            return sizes[name]
        if name in above:
            return 0
        if len(above) > MOST_DEPTH:
            raise self.refuse(name, f"nests elements deeper than {MOST_DEPTH}", "ungroup them")
        parts = (self._size(each, sizes, [*above, name]) for each in self._copies.get(name, ()))
        size = self._inside.get(name, 0) + sum(parts)
        if size > MOST_ELEMENTS:
            raise self.refuse(name, f"makes more than {MOST_ELEMENTS:,} elements by use", "simplify the drawing")
        sizes[name] = size
        return size


def check_svg(path: Path) -> None:
    """Refuse a file that would take too long to read.

    Raises:
        SpecError: The file is no XML, or exceeds a limit.
    """
    scan, parser = _Scan(path.name), expat.ParserCreate()
    parser.StartElementHandler = scan.start
    parser.EndElementHandler = scan.end
    parser.EntityDeclHandler = scan.entity
    try:
        parser.Parse(path.read_bytes(), True)
    except (expat.ExpatError, LookupError, ValueError, OSError) as error:
        raise SpecError(path.name, "", f"is not a readable SVG ({error})", "save it as plain SVG") from error
    scan.check_copies()

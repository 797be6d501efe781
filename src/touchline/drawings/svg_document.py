"""SVG files as trees of elements with line numbers."""

from dataclasses import dataclass
from pathlib import Path
from xml.etree.ElementTree import Element, TreeBuilder
from xml.parsers import expat

from touchline.schemas.errors import SpecError

SVG_SPACE = "http://www.w3.org/2000/svg"
_XLINK_HREF = "{http://www.w3.org/1999/xlink}href"


@dataclass(frozen=True)
class SvgDocument:
    """A parsed file.

    Attributes:
        root: Outermost svg element.
        lines: Line at which each element begins.
        by_id: First element of each id.
        parents: Parent of each element but the root.
        linked_styles: Whether it refers to style sheets in other files.
    """

    root: Element
    lines: dict[Element, int]
    by_id: dict[str, Element]
    parents: dict[Element, Element]
    linked_styles: bool

    def kind(self, element: Element) -> str:
        """Local name of an SVG element, "" for others; files without namespaces are taken to be SVG."""
        space, _, local = element.tag.rpartition("}")
        return local if space in ("", f"{{{SVG_SPACE}") else ""

    def ancestors(self, element: Element) -> list[Element]:
        """Ancestors of an element, the root first."""
        found: list[Element] = []
        while element in self.parents:
            element = self.parents[element]
            found.append(element)
        return found[::-1]

    def target(self, reference: str) -> Element | None:
        """Element that a reference within the file ("#id") names."""
        return self.by_id.get(reference.strip()[1:]) if reference.strip().startswith("#") else None


def href(element: Element) -> str:
    """Reference of an element."""
    return element.get("href") or element.get(_XLINK_HREF) or ""


def parse_svg(path: Path) -> SvgDocument:
    """Parse a file that is within the limits.

    Raises:
        SpecError: The file is no SVG.
    """
    builder, lines, linked = TreeBuilder(), {}, []
    parser = expat.ParserCreate(namespace_separator="}")
    parser.buffer_text = True

    def start(tag: str, attributes: dict[str, str]) -> None:
        named = {_clark(name): value for name, value in attributes.items()}
        lines[builder.start(_clark(tag), named)] = parser.CurrentLineNumber

    parser.StartElementHandler = start
    parser.EndElementHandler = lambda tag: builder.end(_clark(tag))
    parser.CharacterDataHandler = builder.data
    parser.ProcessingInstructionHandler = lambda target, _data: linked.append(target)
    try:
        parser.Parse(path.read_bytes(), True)
    except (expat.ExpatError, LookupError, ValueError) as error:
        raise SpecError(path.name, "", f"is not a readable SVG ({error})", "save it as plain SVG") from error
    root = builder.close()
    by_id: dict[str, Element] = {}
    for element in root.iter():
        by_id.setdefault(element.get("id", ""), element)
    parents = {child: element for element in root.iter() for child in element}
    document = SvgDocument(root, lines, by_id, parents, "xml-stylesheet" in linked)
    if document.kind(root) != "svg":  # another kind of XML
        raise SpecError(path.name, "", "has no svg element at its root", "save it as plain SVG")
    return document


def _clark(name: str) -> str:
    return f"{{{name}" if "}" in name else name

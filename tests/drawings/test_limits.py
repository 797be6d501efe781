"""A drawing that would take for ever is refused at once, with the limit."""

from pathlib import Path

import pytest

from schemas.errors import SpecError
from services.drawings.importer import MAX_PIECES, import_drawing

SVG = '<svg xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink" width="9cm" viewBox="{box}">'
HEAD = SVG.format(box="0 0 90 90")
RECT = '<rect x="1" y="1" width="50" height="50"/>'
USES = [f"<use xlink:href='#a{i}'/>" * 10 for i in range(11)]
TENFOLD = "".join(f'<g id="a{i}">{USES[i - 1]}</g>' for i in range(1, 12))
TALK = [f"&a{i};" * 10 for i in range(10)]
LAUGHS = "".join(f'<!ENTITY a{i} "{TALK[i - 1]}">' for i in range(1, 10))


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (f'{HEAD}<g id="a0">{RECT}</g>{TENFOLD}', "more than 20,000 elements by use"),
        (f'{HEAD}<g id="a"><use href="#a"/></g>', "#a contains itself"),
        (f'{HEAD}<g id="a"><use href="#b"/></g><g id="b"><g><use href="#a"/></g></g>', "contains itself"),
        (f"{HEAD}{'<g>' * 200}{RECT}{'</g>' * 200}", "deeper than 100"),
        (f"{HEAD}{RECT * 20_001}", "more than 20,000 elements"),
        (HEAD + '<path d="' + "M0 0L9 9" * 500_000 + '"/>', "attributes of more than 1,000,000 characters"),
        (HEAD + '<path stroke="red" d="M0 0' + "L9 9L5 5" * (MAX_PIECES // 2 + 1) + '"/>', "give at most 20,000"),
        (f'<!DOCTYPE svg [<!ENTITY a0 "ha">{LAUGHS}]>{HEAD}<text>&a9;</text>', "a1 is not a plain text"),
        (f'<!DOCTYPE svg [<!ENTITY x SYSTEM "file:///etc/passwd">]>{HEAD}<text>&x;</text>', "x is not a plain text"),
        (SVG.format(box="0 0 1e-300 1e-300") + RECT, "viewBox cannot be carried to metres"),
        (SVG.format(box="1e308 1e308 1e308 1e308") + RECT, "viewBox cannot be carried to metres"),
        (SVG.format(box="0 0 0 0") + RECT, "is not a readable SVG"),
        (f'{HEAD}<g transform="matrix(1e308 1e308 1e308 1e308 1e308 1e308)">{RECT}</g>', "not finite"),
        (f'{HEAD}<g transform="rotate(1e308)">{RECT}</g>', "is not a readable SVG"),
    ],
)
def test_an_svg_that_asks_for_too_much_is_refused(tmp_path: Path, text: str, says: str) -> None:
    path = tmp_path / "bomb.svg"
    path.write_text(f"{text}</svg>")
    with pytest.raises(SpecError, match=says):
        import_drawing(path)


def test_what_an_svg_copies_is_painted(tmp_path: Path) -> None:
    path = tmp_path / "copies.svg"
    copies = "".join(f'<use href="#a" transform="translate({10 * i} 0)"/>' for i in range(3))
    path.write_text(f'<!DOCTYPE svg [<!ENTITY ns "urn:x">]>{HEAD}<defs><g id="a">{RECT}</g></defs>{copies}</svg>')
    assert len(import_drawing(path).template.segments) == 12


def dxf(entities: str, blocks: str = "") -> str:
    head = "0\nSECTION\n2\nHEADER\n9\n$ACADVER\n1\nAC1015\n9\n$INSUNITS\n70\n6\n0\nENDSEC\n"
    return f"{head}0\nSECTION\n2\nBLOCKS\n{blocks}0\nENDSEC\n0\nSECTION\n2\nENTITIES\n{entities}0\nENDSEC\n0\nEOF\n"


def block(name: str, content: str) -> str:
    head = f"0\nBLOCK\n8\n0\n2\n{name}\n70\n0\n10\n0\n20\n0\n3\n{name}\n1\n\n"
    return f"{head}{content}0\nENDBLK\n8\n0\n"


def insert(name: str, columns: int = 1, rows: int = 1) -> str:
    return f"0\nINSERT\n8\n0\n2\n{name}\n10\n0\n20\n0\n70\n{columns}\n71\n{rows}\n44\n1\n45\n10\n"


LINE = "0\nLINE\n8\n0\n10\n0\n20\n0\n11\n0\n21\n5\n"
A = block("A", LINE)
BLOCKS = block("B0", LINE) + "".join(block(f"B{i}", insert(f"B{i - 1}") * 10) for i in range(1, 8))


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (dxf(insert("B7"), BLOCKS), "more than 20,000 entities of its blocks"),
        (dxf(insert("A"), block("A", LINE + insert("A") * 3)), "nests blocks too deeply"),
        (dxf(insert("A", 30_000, 30_000), A), "repeats a block 900,000,000 times"),
        (dxf(LINE * 50_000), "give at most 40,000"),
        ("AutoCAD Binary DXF" + "x" * 1_000_000, "is a binary DXF"),
    ],
    ids=["copies of copies", "itself", "array", "many", "binary"],
)
def test_a_dxf_that_asks_for_too_much_is_refused(tmp_path: Path, text: str, says: str) -> None:
    path = tmp_path / "bomb.dxf"
    path.write_text(text)
    with pytest.raises(SpecError, match=says):
        import_drawing(path)


def test_an_array_of_a_block_is_painted_whole(tmp_path: Path) -> None:
    path = tmp_path / "array.dxf"
    path.write_text(dxf(insert("A", 3, 2), A))
    assert len(import_drawing(path).template.segments) == 6

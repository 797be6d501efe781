"""A drawing that would take for ever is refused at once, with the limit."""

from contextlib import suppress
from pathlib import Path
from random import Random

import pytest

from touchline.drawings import dxf as reading_dxf
from touchline.drawings import importer
from touchline.drawings.importer import ImportOptions, import_drawing
from touchline.schemas.errors import SpecError

SVG = '<svg xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink" width="9cm" viewBox="{box}">'
HEAD = SVG.format(box="0 0 90 90")
RECT = '<rect x="1" y="1" width="50" height="50"/>'
USES = [f"<use xlink:href='#a{i}'/>" * 10 for i in range(11)]
TENFOLD = "".join(f'<g id="a{i}">{USES[i - 1]}</g>' for i in range(1, 12))
TALK = [f"&a{i};" * 10 for i in range(10)]
LAUGHS = "".join(f'<!ENTITY a{i} "{TALK[i - 1]}">' for i in range(1, 10))


def ending(text: str) -> str:
    """The end of a text that may have a million characters."""
    return text[-40:]


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (f'{HEAD}<g id="a0">{RECT}</g>{TENFOLD}', "more than 20,000 elements by use"),
        (f'{HEAD}<g id="a"><use href="#a"/></g>', "has nothing to paint; use .* refers to what it is in"),
        (f'{HEAD}<g id="a"><use href="#b"/></g><g id="b"><g><use href="#a"/></g></g>', "has nothing to paint; use"),
        (f"{HEAD}{'<g>' * 200}{RECT}{'</g>' * 200}", "deeper than 100"),
        (f"{HEAD}{RECT * 20_001}", "more than 20,000 elements"),
        (HEAD + '<path d="' + "M0 0L9 9" * 500_000 + '"/>', "attributes of more than 1,000,000 characters"),
        ('<?xml version="1.0" encoding="nonsense"?><svg>', "is not a readable SVG .*unknown encoding"),
        (f"{HEAD}<style>{'a{}' * 600}</style>{'<g/>' * 9_000}", "style has 600 rules for 9,002 elements"),
        (f'<!DOCTYPE svg [<!ENTITY a0 "ha">{LAUGHS}]>{HEAD}<text>&a9;</text>', "a1 is not a plain text"),
        (f'<!DOCTYPE svg [<!ENTITY x SYSTEM "file:///etc/passwd">]>{HEAD}<text>&x;</text>', "x is not a plain text"),
        (SVG.format(box="0 0 1e-300 1e-300") + RECT, "viewBox cannot be carried to metres"),
        (SVG.format(box="1e308 1e308 1e308 1e308") + RECT, "viewBox cannot be carried to metres"),
        (SVG.format(box="0 0 0 0") + RECT, "has nothing to paint"),
        (f'{HEAD}<g transform="matrix(1e308 1e308 1e308 1e308 1e308 1e308)">{RECT}</g>', "has nothing to paint"),
        (f'{HEAD}<g transform="rotate(1e308)">{RECT}</g>', "has nothing to paint"),
    ],
    ids=ending,
)
def test_an_svg_that_asks_for_too_much_is_refused(tmp_path: Path, text: str, says: str) -> None:
    path = tmp_path / "bomb.svg"
    path.write_text(f"{text}</svg>")
    with pytest.raises(SpecError, match=says):
        import_drawing(path)


def test_more_pieces_than_can_be_fitted_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert importer.MAX_PIECES == 20_000
    monkeypatch.setattr(importer, "MAX_PIECES", 400)
    path = tmp_path / "lines.svg"
    path.write_text(f"""{HEAD}<path stroke="red" d="M0 0{"L9 9L5 5" * 201}"/></svg>""")
    with pytest.raises(SpecError, match="has 402 lines and curves; give at most 400"):
        import_drawing(path)


def test_what_an_svg_copies_is_painted(tmp_path: Path) -> None:
    path = tmp_path / "copies.svg"
    copies = "".join(f'<use href="#a" transform="translate({10 * i} 0)"/>' for i in range(3))
    path.write_text(f'<!DOCTYPE svg [<!ENTITY ns "urn:x">]>{HEAD}<defs><g id="a">{RECT}</g></defs>{copies}</svg>')
    assert len(import_drawing(path, ImportOptions(detail_m=0.0)).template.segments) == 12


def dxf(entities: str, blocks: str = "") -> str:
    head = "0\nSECTION\n2\nHEADER\n9\n$ACADVER\n1\nAC1015\n9\n$INSUNITS\n70\n6\n0\nENDSEC\n"
    return f"{head}0\nSECTION\n2\nBLOCKS\n{blocks}0\nENDSEC\n0\nSECTION\n2\nENTITIES\n{entities}0\nENDSEC\n0\nEOF\n"


def block(name: str, content: str) -> str:
    head = f"0\nBLOCK\n8\n0\n2\n{name}\n70\n0\n10\n0\n20\n0\n3\n{name}\n1\n\n"
    return f"{head}{content}0\nENDBLK\n8\n0\n"


def insert(name: str, columns: int = 1, rows: int = 1) -> str:
    return f"0\nINSERT\n8\n0\n2\n{name}\n10\n0\n20\n0\n70\n{columns}\n71\n{rows}\n44\n1\n45\n10\n"


#: What takes the place of a line of a file.
ODD = (
    "",
    "0",
    "-1",
    "1e308",
    "-1e308",
    "nan",
    "inf",
    "1e-320",
    "40",
    "10",
    "999999",
    "ENDSEC",
    "LINE",
    "SPLINE",
    "\0",
    "é",
)
LINE = "0\nLINE\n8\n0\n10\n0\n20\n0\n11\n0\n21\n5\n"
A = block("A", LINE)
BLOCKS = block("B0", LINE) + "".join(block(f"B{i}", insert(f"B{i - 1}") * 10) for i in range(1, 8))


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (dxf(insert("A", 30_000, 30_000), A), "repeats a block 900,000,000 times"),
        (dxf(LINE * 50_000), "give at most 40,000"),
        ("AutoCAD Binary DXF" + "x" * 1_000_000, "is a binary DXF"),
    ],
    ids=["array", "many", "binary"],
)
def test_a_dxf_that_asks_for_too_much_is_refused(tmp_path: Path, text: str, says: str) -> None:
    path = tmp_path / "bomb.dxf"
    path.write_text(text)
    with pytest.raises(SpecError, match=says):
        import_drawing(path)


def test_a_dxf_with_copies_of_copies_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert reading_dxf.MOST_ENTITIES == 20_000
    monkeypatch.setattr(reading_dxf, "MOST_ENTITIES", 400)
    path = tmp_path / "bomb.dxf"
    path.write_text(dxf(insert("B7"), BLOCKS))
    with pytest.raises(SpecError, match="more than 400 entities of its blocks"):
        import_drawing(path)


def test_a_block_in_itself_is_left_out_by_name(tmp_path: Path) -> None:
    path = tmp_path / "itself.dxf"
    path.write_text(dxf(insert("A"), block("A", LINE + insert("A") * 3)))
    imported = import_drawing(path)
    assert len(imported.template.segments) == 1
    assert ["block that it is in" in omission.reason for omission in imported.omissions] == [True] * 3


def test_an_array_of_a_block_is_painted_whole(tmp_path: Path) -> None:
    path = tmp_path / "array.dxf"
    path.write_text(dxf(insert("A", 3, 2), A))
    assert len(import_drawing(path).template.segments) == 6


@pytest.mark.parametrize("seed", range(8))
def test_a_damaged_dxf_is_read_or_refused(tmp_path: Path, seed: int) -> None:
    """Never a traceback, whatever a group's code or value is replaced by."""
    path, chance = tmp_path / "damaged.dxf", Random(seed)
    arc = "0\nARC\n8\n0\n10\n3\n20\n4\n40\n2\n50\n10\n51\n200\n"
    polyline = "0\nLWPOLYLINE\n8\n0\n90\n3\n70\n1\n10\n0\n20\n0\n42\n0.5\n10\n4\n20\n0\n10\n4\n20\n4\n"
    ellipse = "0\nELLIPSE\n8\n0\n10\n0\n20\n0\n30\n0\n11\n5\n21\n0\n31\n0\n40\n0.4\n41\n0\n42\n3\n"
    whole = dxf(insert("A", 2, 2) + arc + polyline + ellipse + LINE, A).splitlines()
    for _ in range(4):
        lines = list(whole)
        for _ in range(chance.randint(1, 3)):
            lines[chance.randrange(len(lines))] = chance.choice(ODD)
        path.write_text("\n".join(lines) + "\n")
        with suppress(SpecError):
            import_drawing(path, ImportOptions(scale_m=0.1, detail_m=chance.choice((0.0, None))))


@pytest.mark.parametrize(
    "damaged",
    [LINE.replace("LINE", "999999"), LINE.replace("10\n0\n", "90\ninf\n")],
    ids=["unknown entity", "no integer"],
)
def test_what_the_library_stumbles_over_is_refused(tmp_path: Path, damaged: str) -> None:
    path = tmp_path / "damaged.dxf"
    path.write_text(dxf(LINE + damaged))
    with pytest.raises(SpecError, match="is not a readable DXF"):
        import_drawing(path, ImportOptions())

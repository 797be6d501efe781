"""The key of a compiled kernel: the text of its module and of all that this imports."""

from pathlib import Path

import pytest

from touchline.core import import_closure


@pytest.fixture
def package(tmp_path: Path) -> Path:
    """A package whose module `a` imports `b` in some way, and `b` imports `c`."""
    for name in ("pack", "pack/below"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "__init__.py").touch()
    (tmp_path / "pack" / "below" / "b.py").write_text("import pack.c\nB = 1\n")
    (tmp_path / "pack" / "c.py").write_text("C = 1\n")
    (tmp_path / "pack" / "other.py").write_text("D = 1\n")
    return tmp_path / "pack"


def _digest(file: Path) -> str:
    for remembered in (
        import_closure.closure_digest,
        import_closure._digest,
        import_closure._text,
        import_closure._imported,
        import_closure._files,
    ):
        remembered.cache_clear()
    return import_closure.closure_digest(str(file))


@pytest.mark.parametrize(
    "statement",
    [
        "from pack.below.b import B",
        "from pack.below import b",
        "from pack.below import (\n    other,  # a comment, with a comma\n    b as renamed,\n)",
        "from .below.b import B",
        "from .below import b",
        "import os, pack.below.b as b",
        "def f():\n    from pack.below import b",
    ],
)
def test_every_kind_of_import_is_followed(package: Path, statement: str) -> None:
    file = package / "a.py"
    file.write_text(statement + "\n")
    before = _digest(file)
    (package / "other.py").write_text("D = 2\n")
    assert _digest(file) == before
    (package / "c.py").write_text("C = 2\n")
    after = _digest(file)
    assert after != before
    (package / "below" / "b.py").write_text("B = 1\n")
    assert _digest(file) not in (before, after)


def test_imports_of_this_package_are_followed_from_files_of_others(package: Path) -> None:
    file = package / "a.py"
    file.write_text("from touchline.core.angles import wrap\n")
    places = import_closure._imported(str(file), import_closure._root(str(file)))
    names = {Path(place).stem for place in places}
    assert names == {"angles"}


def test_the_folder_of_the_checkout_does_not_matter(package: Path, tmp_path: Path) -> None:
    (package / "a.py").write_text("from pack.below import b\n")
    before = _digest(package / "a.py")
    moved = tmp_path / "elsewhere"
    moved.mkdir()
    package.rename(moved / "pack")
    assert _digest(moved / "pack" / "a.py") == before


def test_other_packages_beside_it_are_not_followed(package: Path) -> None:
    beside = package.parent / "beside"
    beside.mkdir()
    (beside / "__init__.py").write_text("E = 1\n")
    (package / "a.py").write_text("import beside\n")
    before = _digest(package / "a.py")
    (beside / "__init__.py").write_text("E = 2\n")
    assert _digest(package / "a.py") == before

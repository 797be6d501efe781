"""The docs name files that are there, and their tables are those of the models."""

import re
from pathlib import Path

import pytest

from tests.doc_tables import written

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
#: Pages whose links no build of the site checks.
BESIDE_THE_SITE = [ROOT / "README.md", ROOT / "CONTRIBUTING.md"]
PLACES = (
    ROOT,
    ROOT / "services",
    ROOT / "services" / "planner",
    ROOT / "services" / "robot_sim",
    ROOT / "src" / "touchline",
    ROOT / "src" / "touchline" / "onboard",
)
NAMED = re.compile(r"`((?:[a-z_0-9]+/)+(?:[a-z_0-9]+\.(?:py|json|msg|srv))?)`")
#: Folders of others and of keys, where topics are, and what only `make` makes.
ELSEWHERE = frozenset(
    ("authority/", "identities/", "ws/src/", "zenoh/", "truth/", "tls/", "build/tree/", "build/docs/")
)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_every_file_that_a_page_names_is_there(page: Path) -> None:
    named = set(NAMED.findall(page.read_text(encoding="utf-8"))) - ELSEWHERE
    missing = [name for name in sorted(named) if not any((place / name).exists() for place in PLACES)]
    assert not missing


@pytest.mark.parametrize("page", BESIDE_THE_SITE, ids=lambda page: page.name)
def test_every_link_between_pages_leads_somewhere(page: Path) -> None:
    for target, anchor in re.findall(r"\]\(([\w./-]*)(#[\w-]+)?\)", page.read_text(encoding="utf-8")):
        path = (page.parent / target).resolve() if target else page
        assert path.exists(), target
        if anchor and path.suffix == ".md":
            text = path.read_text(encoding="utf-8")
            heads = [
                re.sub(r"[^\w -]", "", head.strip().lower()).replace(" ", "-")
                for head in re.findall(r"^#+ (.*)$", text, re.M)
            ]
            assert anchor[1:] in heads, f"{target}{anchor}"


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_every_table_is_as_the_models_are(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    assert written(text) == text, "run python -m tests.doc_tables"

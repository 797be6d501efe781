"""The page of what came of a check: it stands alone, says what differs, and nothing in a recording becomes markup."""

import re
from dataclasses import replace
from datetime import UTC, datetime
from html.parser import HTMLParser

import pytest

from tests.checking.test_mutations import MUTATIONS
from touchline.checking.check_files import SessionVerdict, check_file
from touchline.checking.check_page import MOST_DETAILED, page_of, to_be_detailed
from touchline.checking.draw_differences import draw_differences

pytestmark = pytest.mark.xdist_group("checking")
WHEN = datetime(2026, 1, 2, 3, 4, tzinfo=UTC)
HOSTILE = "<script>alert(1)</script>$\\frac{"


class Tags(HTMLParser):
    """The tags of a page, and their references."""

    def __init__(self, page):
        super().__init__()
        self.tags, self.links = [], []
        self.feed(page)

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        self.links += [value for name, value in attrs if name in ("src", "href", "xlink:href")]


@pytest.mark.parametrize("name", ["a heavier body", "a plan with another σ_max"])
def test_a_page_of_what_differs(brief, monkeypatch, name):
    MUTATIONS[name][0](monkeypatch)
    (verdict,) = check_file("", brief)
    plots = draw_differences("", verdict)
    titles = [plot.title for plot in plots]
    assert "Paths of the robots" in titles or "Plan" in titles
    page = page_of("bend.mcap", [verdict], {0: plots}, WHEN)
    found = Tags(page)
    assert found.tags.count("svg") == len(plots)
    assert all(link.startswith("#") for link in found.links)
    assert not {"script", "link", "img", "iframe"} & set(found.tags)
    assert f"<b>{MUTATIONS[name][1]}</b>" in page
    assert f"<code>{verdict.first.field}</code>" in page
    assert re.search(r"coverage</td>", page)
    assert len(page) < 500_000


@pytest.mark.parametrize(
    ("name", "part", "titles"),
    [
        ("another gain of the filter", "estimator", ("Error of", "Distance between", "NIS of", "Innovations of")),
        ("another follower", "follower", ("Commands to the actuators",)),
    ],
)
def test_a_part_alone_is_drawn(brief, monkeypatch, name, part, titles):
    MUTATIONS[name][0](monkeypatch)
    (verdict,) = check_file(part, brief)
    plots = draw_differences(part, verdict)
    for title in ("What differs first", *titles):
        assert any(plot.title.startswith(title) for plot in plots), [plot.title for plot in plots]
    assert all(plot.svg.startswith("<svg") and plot.svg.count("<path") > 3 for plot in plots)


def test_what_a_recording_says_is_no_markup():
    verdict = SessionVerdict(
        f"/a/{HOSTILE}.mcap", HOSTILE, False, HOSTILE, notes=(HOSTILE,), schemas={HOSTILE: (HOSTILE,)}
    )
    verdict = replace(verdict, made_by={"numpy": HOSTILE})
    page = page_of(HOSTILE, [verdict], {0: []}, WHEN)
    assert "script" not in Tags(page).tags
    assert page.count("&lt;script&gt;") >= 4


def test_many_sessions_make_a_small_page():
    verdicts = [SessionVerdict(f"{i}.mcap", "tt2", i % 2 == 0, "" if i % 2 == 0 else "broken") for i in range(5000)]
    told = to_be_detailed(verdicts)
    assert len(told) == MOST_DETAILED
    page = page_of("sessions", verdicts, {i: [] for i, each in enumerate(verdicts) if each in told}, WHEN)
    assert len(page) < 2_500_000
    assert page.count("<section") == MOST_DETAILED
    assert "3,000 sessions" in page

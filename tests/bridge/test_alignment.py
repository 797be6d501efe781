"""Messages of two recordings are paired as a person would pair them."""

import random
from pathlib import Path

import pytest

from tests.bridge.foreign import foreign
from touchline.recordings.alignment import SIGHT, Alignment
from touchline.recordings.compare import compare
from touchline.recordings.recorded import Recorded, RecordingKind
from touchline.schemas.cdr import encode
from touchline.schemas.messages import String

Made = tuple[float, str]


def aligned(left: list[Made], right: list[Made]) -> list[tuple[str | None, str | None]]:
    """Payloads of two topics that belong together, given as (time in s, payload)."""
    alignment, found = Alignment(), []
    for side, made in enumerate((left, right)):
        for at_s, text in made:
            alignment.add(side, Recorded("/a", 0, round(at_s * 1e9) + 1, 0, text.encode(), RecordingKind()))
            found += list(alignment.decided())
        alignment.end(side)
    found += list(alignment.decided())
    return [tuple(m and m.payload.decode() for m in pair) for pair in found]  # type: ignore[misc]


def noisy(number: int, prefix: str, apart_s: float = 0.0) -> list[Made]:
    """100 Hz, every payload different from the other recording's."""
    return [(tick / 100 + apart_s, f"{prefix}{tick}") for tick in range(number)]


@pytest.mark.parametrize("dropped", [0, 1, 500, 999])
@pytest.mark.parametrize("apart_s", [0.0, 0.003])
def test_one_dropped_message_is_one_missing_message(dropped: int, apart_s: float) -> None:
    left, right = noisy(1000, "a"), noisy(1000, "b", apart_s)
    del right[dropped]
    pairs = aligned(left, right)
    assert [pair for pair in pairs if None in pair] == [(f"a{dropped}", None)]
    assert all(one[1:] == other[1:] for one, other in pairs if one and other)


def test_of_messages_of_one_time_those_with_the_same_bytes_belong_together() -> None:
    texts = [str(number) for number in range(4 * SIGHT)]
    left, right = [(5.0, text) for text in texts], [(5.0, text) for text in texts if text != "7"]
    assert [pair for pair in aligned(left, right) if pair[0] != pair[1]] == [("7", None)]


def test_messages_of_one_time_that_all_differ_are_paired_in_their_order() -> None:
    left, right = [(5.0, f"a{n}") for n in range(100)], [(5.0, f"b{n}") for n in range(100)]
    assert aligned(left, right) == [(f"a{n}", f"b{n}") for n in range(100)]


def test_a_single_message_belongs_to_a_single_message_however_late() -> None:
    assert aligned([(300.0, "a")], [(303.0, "b")]) == [("a", "b")]


def test_what_only_one_recording_covers_is_missing_from_the_other() -> None:
    left, right = noisy(300, "x"), noisy(500, "x")[200:]
    pairs = aligned(left, right)
    assert sum(right is None for _, right in pairs) == 200
    assert sum(left is None for left, _ in pairs) == 200
    assert sum(left == right for left, right in pairs) == 100


def test_a_clock_that_begins_anew_is_followed() -> None:
    left = [*noisy(500, "a"), *noisy(300, "b")]
    right = [*noisy(500, "a")[:450], *noisy(300, "b")]
    assert [pair for pair in aligned(left, right) if pair[0] != pair[1]] == [(f"a{n}", None) for n in range(450, 500)]


def test_random_losses_on_both_sides_are_all_found() -> None:
    draw = random.Random(1)
    both = noisy(3000, "x")
    left, right = ([made for made in both if draw.random() > 0.05] for _ in range(2))
    pairs = aligned(left, right)
    assert all(one == other for one, other in pairs if one and other)
    assert {one for one, other in pairs if other is None} == {text for _, text in left} - {text for _, text in right}
    assert {other for one, other in pairs if one is None} == {text for _, text in right} - {text for _, text in left}


def test_the_same_session_recorded_by_other_clocks_is_compared_from_the_beginning(tmp_path: Path) -> None:
    said = [(n * 10_000_000, encode(String(data=str(n)))) for n in range(100)]
    one = foreign(tmp_path / "one.mcap", (("/a", 10**18 + ns, payload) for ns, payload in said))
    other = foreign(tmp_path / "other.mcap", (("/a", 10**9 + ns, payload) for ns, payload in said))
    result = compare(one, other)
    assert result.identical
    assert any("times are taken from the beginning" in line for line in result.lines())

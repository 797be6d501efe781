"""Paint arrives in numbered batches; none may be lost, none counted twice."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from touchline.schemas.messages import PaintMarks
from touchline.tui.paint_track import THINNING, PaintTrack


def batch(first_index: int, *x_m: float) -> PaintMarks:
    return PaintMarks(segment_id="a", first_index=first_index, width_m=0.12, x_m=list(x_m), y_m=[0.0] * len(x_m))


def test_batches_of_one_stroke_are_one_line_and_a_new_stroke_is_not_joined() -> None:
    track = PaintTrack()
    track.add(batch(0, 0.0, 0.1, 0.2))
    track.add(batch(2, 0.2, 0.3))  # begins with the point that the last one ended with
    track.add(batch(4, 5.0, 5.1))
    assert track.line.x_m.tolist() == [0.0, 0.2, 0.3, 5.0, 5.1]
    assert track.line.joined.tolist() == [False, True, True, False, True]
    assert not track.needs_fetch


def test_a_gap_asks_for_everything_and_waits() -> None:
    track = PaintTrack()
    track.add(batch(0, 0.0, 0.1))
    track.add(batch(7, 0.7, 0.8))
    track.add(batch(8, 0.8, 0.9))
    assert track.needs_fetch
    assert len(track) == 2
    track.restore([batch(0, *np.arange(9) / 10)])
    assert not track.needs_fetch
    assert track.line.x_m.tolist() == [0.0, 0.8, 0.9]
    assert track.line.joined.tolist() == [False, True, True]


def test_what_the_answer_already_holds_is_not_drawn_again() -> None:
    track = PaintTrack()
    track.request_fetch()
    track.add(batch(0, 0.0, 0.1, 0.2))
    track.add(batch(2, 0.2, 0.3, 0.4, 0.5))
    track.restore([batch(0, 0.0, 0.1, 0.2, 0.3)])
    assert track.line.x_m.tolist() == [0.0, 0.3, 0.5]
    assert track.line.joined.tolist() == [False, True, True]
    track.add(batch(5, 0.5, 0.6))
    assert not track.needs_fetch


def test_a_new_session_of_the_robot_is_noticed() -> None:
    track = PaintTrack()
    track.add(batch(0, 0.0, 0.1, 0.2))
    track.add(batch(0, 9.0, 9.1))
    assert track.needs_fetch
    track.restore([batch(0, 9.0, 9.1)])
    assert track.line.x_m.tolist() == [9.0, 9.1]


def test_a_jump_within_a_stroke_is_not_believed() -> None:
    track = PaintTrack()
    track.add(batch(0, 0.0, 0.1))
    track.add(batch(1, 4.0, 4.1))
    assert track.needs_fetch


def test_restoring_changes_the_revision_and_growing_does_not() -> None:
    track = PaintTrack()
    before = track.revision
    track.add(batch(0, 0.0, 0.1))
    assert track.revision == before
    track.restore([])
    assert track.revision != before
    assert len(track) == 0


@settings(deadline=None, max_examples=40)
@given(st.lists(st.tuples(st.integers(2, 30), st.booleans()), min_size=1, max_size=30), st.integers(0, 29))
def test_nothing_is_lost_whatever_is_missed(batches: list[tuple[int, bool]], missed: int) -> None:
    """However the points are cut into batches, and whichever batch is missed, the line ends up whole."""
    sent, strokes = [], []
    index = 0
    for count, new_stroke in batches:
        first = index if new_stroke or not sent else index - 1
        x = np.arange(first, first + count) / 100
        sent.append(PaintMarks(segment_id="a", first_index=first, x_m=x, y_m=np.zeros(count)))
        strokes.append(sent[-1])
        index = first + count
    track = PaintTrack()
    for number, marks in enumerate(sent):
        if number != missed or number == len(sent) - 1:
            track.add(marks)
        if track.needs_fetch:
            track.restore(strokes[: number + 1])
    assert not track.needs_fetch
    drawn = track.line.x_m
    expected = np.unique(np.concatenate([marks.x_m for marks in sent]))
    assert drawn[-1] == expected[-1]
    assert np.diff(drawn).max(initial=0) <= THINNING / 100 + 1e-9
    assert np.all(np.diff(drawn) > 0)

"""The transitions from line to line are timed in parts: between any two of them it can be stopped, and it tells."""

import numpy as np
import pytest

from tests.planner.drawn import drawn
from touchline.schemas.messages import PlanOptions
from touchline.schemas.template import Template
from touchline.schemas.vehicles import Vehicle
from touchline.services.planner.budget import Budget
from touchline.services.planner.geometry.clothoid import Floats
from touchline.services.planner.limits import Limits
from touchline.services.planner.marking import transitions_of
from touchline.services.planner.plan import plan
from touchline.services.planner.sequencing import costs
from touchline.services.planner.swaths.offset import modes
from touchline.services.planner.swaths.swaths import Painting, swaths
from touchline.services.planner.tour import ORDER, TIMING
from touchline.services.planner.transitions import methods

# Paint dries at once: wet paint has its own tests.
VEHICLE, OPTIONS = Vehicle(), PlanOptions(drying_time_s=1e-3)
LINES = 20


class Stop(Exception):
    """Somebody does not want to wait any longer."""


def in_parts(monkeypatch: pytest.MonkeyPatch, rough: int, words: int, hops: int) -> None:
    monkeypatch.setattr(costs, "ROUGH_PART", rough)
    monkeypatch.setattr(costs, "FIRST", costs.FIRST._replace(part=words))
    monkeypatch.setattr(costs, "SECOND", costs.SECOND._replace(part=hops))


@pytest.fixture
def parts(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """The parts that were timed; the matrix is that of many lines, in many small parts."""
    done: list[str] = []
    words, rough = methods.transition_times, methods.word_lengths

    def transition_times(*given: object) -> Floats:
        done.append("hops" if given[3] else "words")
        return words(*given)

    def word_lengths(*given: object, **named: object) -> Floats:
        done.append("rough")
        return rough(*given, **named)

    monkeypatch.setattr(costs, "ALL_NODES", 10)
    in_parts(monkeypatch, 200, 50, 10)
    monkeypatch.setattr(methods, "transition_times", transition_times)
    monkeypatch.setattr(methods, "word_lengths", word_lengths)
    return done


def strewn() -> Template:
    rng = np.random.default_rng(4)
    starts, angles = rng.random((LINES, 2)) * 20.0, rng.random(LINES) * 7.0
    ends = starts + 3.0 * np.stack((np.cos(angles), np.sin(angles)), axis=1)
    return drawn(*np.hstack((starts, ends)).tolist())


def test_parts_are_all_there_is_and_end_when_it_is_enough() -> None:
    told: list[float] = []
    slices = list(Budget(told.append).parts(10, 4, 0.2, 0.7))
    assert [list(range(10))[part] for part in slices] == [[0, 1, 2, 3], [4, 5, 6, 7], [8, 9]]
    assert told == pytest.approx([0.4, 0.6, 0.7])
    assert len(list(Budget(enough=lambda: True).parts(10, 4, 0.0, 1.0))) == 0


def test_progress_that_raises_ends_the_timing_at_once(parts: list[str]) -> None:
    plan(strewn(), VEHICLE, OPTIONS)
    whole, kinds = len(parts), ("rough", "words", "hops")
    assert [parts.count(each) >= 4 for each in kinds] == [True] * 3
    for stopped in kinds:
        parts.clear()

        def tell(stage: str, fraction: float, stopped: str = stopped) -> None:
            assert stage == TIMING
            if parts[-1] == stopped:
                raise Stop

        with pytest.raises(Stop):
            plan(strewn(), VEHICLE, OPTIONS, progress=tell)
        # One part of that kind, which for rough times is made of several kinds of turns, and none behind it.
        first = parts.index(stopped)
        assert len(parts) < 0.9 * whole
        assert set(parts[first:]) == {stopped}
        assert len(parts) - first == (2 if stopped == "rough" else 1)


@pytest.mark.parametrize("after", [0, 1, 16])
def test_what_is_enough_while_timing_gives_a_whole_plan(parts: list[str], after: int) -> None:
    planned = plan(strewn(), VEHICLE, OPTIONS, enough=lambda: len(parts) >= after)
    # A part of rough times is of more than one kind of turns.
    assert after <= len(parts) <= after + 1
    assert planned.report.painted_segments == LINES


def test_progress_grows_all_the_while(parts: list[str]) -> None:
    told: list[tuple[str, float, int]] = []
    plan(strewn(), VEHICLE, OPTIONS, progress=lambda stage, fraction: told.append((stage, fraction, len(parts))))
    timing = [(fraction, done) for stage, fraction, done in told if stage == TIMING]
    assert [fraction for fraction, _ in timing] == sorted(fraction for fraction, _ in timing)
    assert timing[-1][0] == 1.0
    # It is told after every part: of rough times after those of two kinds of turns.
    assert [done for _, done in timing] == [
        k + 1 for k, part in enumerate(parts) if part != "rough" or parts[: k + 1].count("rough") % 2 == 0
    ]
    assert [stage for stage, _, _ in told].index(ORDER) == len(timing)


def test_the_matrix_does_not_depend_on_the_parts(monkeypatch: pytest.MonkeyPatch) -> None:
    limits = Limits.of(VEHICLE, OPTIONS)
    transitions = transitions_of(VEHICLE, OPTIONS, limits)
    painting = Painting.of(VEHICLE, limits, OPTIONS)
    choices = swaths(modes(strewn().segments, VEHICLE, limits.curvature_max_1pm), painting, free=True)
    monkeypatch.setattr(costs, "ALL_NODES", 10)
    whole, tracks = costs.problem(choices, transitions, painting, None)
    in_parts(monkeypatch, 70, 9, 3)
    cut, cut_tracks = costs.problem(choices, transitions, painting, None)
    assert np.array_equal(whole.cost, cut.cost)
    assert np.array_equal(tracks.kind, cut_tracks.kind)
    assert np.array_equal(tracks.pieces, cut_tracks.pieces)

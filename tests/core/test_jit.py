"""Kernels: compiled once, kept on disk, called from Python and from each other."""

import gc
import math
import resource
import struct
import sys
import threading
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest

from touchline.core.arrays import ascending, copy, least
from touchline.core.jit import borrowing, kernel, kernel_of_class, unlocked
from touchline.core.records import Record


@pytest.fixture(autouse=True)
def compiled_anew(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))


def chain() -> tuple[Any, Any]:
    """A kernel, and one that calls it, both never called before."""

    @kernel
    def inner(x: float, factor: int = 3) -> float:
        return x * factor

    @kernel
    def outer(x: float) -> float:
        return inner(x) + inner(x, 4) + inner(x, factor=5)

    return inner, outer


def test_a_kernel_is_called_from_python_and_from_kernels_with_defaults_and_names() -> None:
    inner, outer = chain()
    assert outer(2.0) == 24.0
    assert not inner.prepared
    assert (inner(2.0, 7), inner(2.0), inner(2.0, factor=4), outer(2)) == (14.0, 6.0, 8.0, 24)
    with pytest.raises(TypeError, match="argument"):
        inner(1.0, 2, 3)


class State(Record):
    """A record with a part of each kind."""

    length_m: float
    count: int
    still: bool = True


ARGUMENTS = [
    None,
    7,
    True,
    2.5,
    1.0 - 2.0j,
    np.float64(0.25),
    np.int64(-3),
    np.bool_(False),
    np.arange(6.0),
    np.arange(6).reshape(2, 3),
    np.asfortranarray(np.arange(6.0).reshape(2, 3)),
    np.arange(12.0).reshape(3, 4)[:, ::2],
    np.array([True, False]),
    np.array([1.0 + 2.0j]),
    np.arange(4, dtype=np.int16),
    (1, 2.0, (np.arange(3.0), True)),
]


@pytest.mark.parametrize(
    "value",
    [
        pytest.param(tuple(ARGUMENTS), id="all in one"),
        pytest.param(np.arange(6.0), id="array"),
        *(pytest.param(each, marks=pytest.mark.full, id=str(each)) for each in ARGUMENTS),
    ],
)
def test_values_come_back_as_they_were_given(value: Any) -> None:
    @kernel
    def same(value: Any) -> Any:
        return value

    assert_same(same(value), value)


def assert_same(found: Any, value: Any) -> None:
    """The same value, of the same type but for NumPy's numbers, which come back as Python's."""
    assert type(found) is (type(value.item()) if isinstance(value, np.generic) else type(value))
    if isinstance(value, tuple):
        for pair in zip(found, value, strict=True):
            assert_same(*pair)
    else:
        assert str(found) == str(value)


def test_what_a_kernel_writes_is_seen_and_what_nobody_may_write_stays() -> None:
    @kernel
    def doubled(values: Any, state: Any) -> float:
        values[:] = 2.0 * values
        state[0].count += 1
        state[0].still = False
        state[0].length_m = values.sum()
        return state[0].length_m

    state, strided, fixed = State(count=4), np.arange(6.0)[::2], np.ones(3)
    fixed.flags.writeable = False
    assert doubled(strided, state.array) == 12.0
    assert strided.tolist() == [0.0, 4.0, 8.0]
    assert (state.count, state.still, state.length_m) == (5, False, 12.0)
    assert doubled(fixed, state.array) == 6.0
    assert fixed.tolist() == [1.0] * 3


def test_exceptions_are_raised() -> None:
    @kernel
    def root(x: float) -> float:
        if x < 0.0:
            raise ValueError("negative", 3)
        return math.sqrt(x)

    assert root(4.0) == 2.0
    with pytest.raises(ValueError, match="negative"):
        root(-1.0)
    assert root(9.0) == 3.0


def test_what_does_not_fit_into_words_is_left_to_numba() -> None:
    @kernel
    def length(text: str) -> int:
        return len(text)

    assert length("four") == 4


def test_what_is_left_to_numba_calls_kernels() -> None:
    _, outer = chain()

    @kernel
    def scaled(text: str, x: float) -> float:
        return len(text) * outer(x)

    assert scaled("four", 1.0) == 48.0


def test_code_holds_the_functions_of_numba_that_it_and_its_callees_call() -> None:
    @kernel
    def near(x: float) -> float:
        return math.hypot(x, 0.0)

    @kernel
    def total(values: Any) -> float:
        return near(values[0]) + math.hypot(values[1], 0.0) + (2.0 * values).sum()

    assert total.address((np.ones(2),))
    assert total(np.ones(2)) == 6.0


def test_lists_in_kernels_are_given_back() -> None:
    @kernel
    def total(count: int) -> float:
        found = [0.5]
        i = 0
        while i < count:
            found.append(float(i))
            i += 1
        return sum(found)

    def grown_kb() -> int:
        before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        for _ in range(200):
            assert total(10_000) == 49_995_000.5
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before

    grown_kb()
    assert grown_kb() < 8_000  # 200 lists have 16 MB


def test_a_kernel_that_cannot_be_typed_is_told_and_garbage_is_collected_as_before() -> None:
    from numba.core.errors import TypingError  # here: few workers compile anything

    _, outer = chain()
    before = gc.get_threshold()
    gc.set_threshold(701, 11, 9)
    try:
        with pytest.raises(TypingError, match="inner"):
            outer(None)
        assert gc.get_threshold() == (701, 11, 9)
        assert outer(1.0) == 12.0
        assert gc.get_threshold() == (701, 11, 9)
    finally:
        gc.set_threshold(*before)


def test_arrays() -> None:
    values = np.array([3.0, -1.0, 2.0, -1.0, 5.0])
    target = np.zeros(7)
    copy(values, target[1:])
    assert target.tolist() == [0.0, *values, 0.0]
    order = np.empty(5, dtype=np.int64)
    ascending(values, order)
    assert order.tolist() == np.argsort(values, kind="stable").tolist()
    assert least(values) == 1


class Square(NamedTuple):
    """A shape."""

    side: float

    @kernel
    def area(self, share: float) -> float:
        return share * self.side * self.side


class Circle(NamedTuple):
    """Another shape."""

    radius: float

    @kernel
    def area(self, share: float) -> float:
        return share * math.pi * self.radius * self.radius


class Framed(NamedTuple):
    """A shape in a frame."""

    width: float
    shape: Any


@kernel_of_class
def area(shape: Any, share: float) -> float:
    """Stands for those of the shapes."""


def test_a_kernel_of_a_class_is_that_of_its_first_argument() -> None:
    @kernel
    def halves(framed: Framed) -> float:
        return area(framed.shape, 0.5) + area(framed.shape, share=0.5)

    assert halves(Framed(1.0, Square(3.0))) == 9.0
    assert halves(Framed(1.0, Circle(1.0))) == math.pi
    assert halves(Framed(1.0, Square(2.0))) == 4.0
    assert area(Square(2.0), 0.25) == Square(2.0).area(0.25) == 1.0


def test_a_class_without_a_kernel_of_that_name_is_told() -> None:
    @kernel
    def outer(framed: Framed) -> float:
        return area(framed, 1.0)

    with pytest.raises(Exception, match="area"):
        outer(Framed(1.0, Square(3.0)))


class Mounted(NamedTuple):
    """A shape of a class that a function makes."""

    shape: Any


@pytest.mark.parametrize("known", [True, False])
def test_code_is_kept_for_classes_that_are_found_again(known: bool, tmp_path: Path) -> None:
    class Local(NamedTuple):
        side: float

        @kernel
        def area(self, share: float) -> float:
            return share * self.side

    assert whole(Mounted(Square(3.0) if known else Local(9.0))) == 9.0
    assert bool(list(tmp_path.rglob("whole*.o"))) == known


@kernel
def whole(mounted: Mounted) -> float:
    return area(mounted.shape, 1.0)


class Pair(NamedTuple):
    """Two arrays that a kernel takes in one."""

    first: np.ndarray
    second: np.ndarray


def test_a_kernel_that_borrows_gives_back_what_it_was_given() -> None:
    @borrowing
    def dot(pair: Pair, begin: int) -> float:
        total = 0.0
        for a in pair.first[begin:]:
            total += a * pair.second[0]
        pair.second[1] = total
        return total

    @kernel
    def both(pair: Pair) -> float:
        made = np.ones(3)
        return dot(pair, 1) + dot(Pair(made, pair.second), 0)

    pair = Pair(np.arange(4.0), np.array([2.0, 0.0]))
    held = [sys.getrefcount(array) for array in pair]
    for _ in range(100):
        assert dot(pair, 1) == 12.0
        assert both(pair) == 18.0
    assert [sys.getrefcount(array) for array in pair] == held
    assert pair.second[1] == 6.0


def test_a_kernel_that_borrows_can_make_no_arrays() -> None:
    from numba.core.errors import NumbaError

    @borrowing
    def make(count: int) -> float:
        return float(np.ones(count)[0])

    with pytest.raises(NumbaError):
        make(3)


class Scaled(NamedTuple):
    scale: float
    rows: np.ndarray


def test_a_function_for_some_types_takes_what_is_the_same_object_for_unchanged() -> None:
    @kernel
    def total(scaled: Scaled, more: float) -> float:
        return scaled.scale * scaled.rows.sum() + more

    rows = np.arange(6.0).reshape(2, 3)
    scaled = Scaled(2.0, rows)
    code = total.for_types_of((scaled, 0.0))
    assert (code(scaled, 0.0), code(scaled, 1.0), code(Scaled(2.0, rows + 1.0), 1.0)) == (30.0, 31.0, 43.0)
    rows[0, 0] = 5.0
    assert (code(scaled, 1.0), total(scaled, 1.0)) == (41.0, 41.0)
    for others in (rows.astype(np.float32), rows[:, ::2]):
        scaled = Scaled(1.0, others)
        assert total.for_types_of((scaled, 0.0))(scaled, 0.0) == others.sum()


class Found(NamedTuple):
    count: int
    where: tuple[float, bool, None]


def test_calls_give_back_what_they_were_given_whatever_comes_of_them() -> None:
    @kernel
    def found(scaled: Scaled, many: int) -> Found:
        if many < 0:
            raise ValueError("too few")
        return Found(many, (scaled.scale + scaled.rows[0], many > 2, None))

    scaled, fixed = Scaled(0.5, np.arange(3.0)), Scaled(0.5, np.arange(3.0))
    fixed.rows.flags.writeable = False
    code = found.for_types_of((scaled, 1))

    def call_each_way() -> None:
        for call in (found, code):
            assert call(scaled, 3) == call(fixed, 3) == Found(3, (0.5, True, None))
            with pytest.raises(ValueError, match="too few"):
                call(scaled, -1)
            with pytest.raises((OverflowError, struct.error)):
                call(scaled, 2**70)
            with pytest.raises(TypeError):
                call(scaled)

    call_each_way()
    counted = [scaled, fixed, scaled.rows, fixed.rows, Found, ValueError]
    before = [sys.getrefcount(each) for each in counted]
    for _ in range(100):
        call_each_way()
    assert [sys.getrefcount(each) for each in counted] == before


def test_a_call_for_other_types_goes_to_their_code() -> None:
    @kernel
    def halved(x: Any) -> float:
        return x / 2

    values: list[Any] = [3, 3.0, True, np.float64(3.0), np.int64(3), 3 + 0j]
    for _ in range(2):
        assert [halved(value) for value in values] == [1.5, 1.5, 0.5, 1.5, 1.5, 1.5]


def test_other_threads_go_on_while_an_unlocked_kernel_runs() -> None:
    @unlocked
    def settle(x: float, steps: int) -> float:
        for _ in range(steps):
            x = 0.5 * x + 1.0
        return x

    turns, over = [0], threading.Event()

    def turn() -> None:
        while not over.is_set():
            turns[0] += 1

    settle(1.0, 1)
    thread = threading.Thread(target=turn)
    thread.start()
    try:
        before = turns[0]
        assert settle(1.0, 30_000_000) == 2.0
        assert turns[0] - before > 1000
    finally:
        over.set()
        thread.join()

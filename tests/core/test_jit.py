"""Kernels: what is compiled for Python, and what only as a part of another kernel."""

import gc
import math
import os
import resource
import subprocess
import sys
import threading
import time
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from numba.core.caching import IndexDataCacheFile
from numba.core.errors import NumbaError, TypingError

from touchline.core.arrays import ascending, copy, least
from touchline.core.jit import _Cache, borrowing, kernel, kernel_of_class


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


def test_a_kernel_that_only_kernels_call_is_not_made_for_python() -> None:
    inner, outer = chain()
    assert outer(2.0) == 24.0
    assert not inner.overloads
    assert inner(2.0, 7) == 14.0
    assert outer(2) == 24


def test_what_was_made_for_python_serves_kernels_as_well() -> None:
    inner, outer = chain()
    assert inner(2.0, 4) == 8.0
    assert outer(2.0) == 24.0
    assert len(inner._parts) == 1  # with the factor left out


def test_constants_are_no_types_of_their_own() -> None:
    @kernel
    def inner(x: int) -> int:
        return 2 * x

    @kernel
    def outer() -> int:
        return inner(1) + inner(2) + inner(3)

    assert outer() == 12
    assert len(inner._parts) == 1


def test_a_kernel_that_cannot_be_typed_is_told() -> None:
    _, outer = chain()
    with pytest.raises(TypingError, match="inner"):
        outer(None)
    assert outer(1.0) == 12.0


def test_garbage_is_collected_as_before() -> None:
    _, outer = chain()
    before = gc.get_threshold()
    gc.set_threshold(701, 11, 9)
    try:
        outer(1.0)
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


def _no_room() -> None:
    resource.setrlimit(resource.RLIMIT_FSIZE, (100, 100))


def test_two_that_cache_a_kernel_at_once_know_of_each_other(monkeypatch: pytest.MonkeyPatch) -> None:
    """Else the code of one signature would be found under the name of the other."""

    def double(x: Any) -> Any:
        return 2 * x

    compiled = []
    with monkeypatch.context() as meanwhile:
        meanwhile.setattr(_Cache, "save_overload", lambda *what: compiled.append(what))
        assert (kernel(double)(21), kernel(double)(1.5)) == (42, 3.0)
    both = threading.Barrier(2)

    def read_by_both(file: IndexDataCacheFile, read: Any = IndexDataCacheFile._load_index) -> Any:
        index = read(file)
        with suppress(threading.BrokenBarrierError):  # the other has to wait for this one
            both.wait(0.5)
        return index

    with monkeypatch.context() as meanwhile:
        meanwhile.setattr(IndexDataCacheFile, "_load_index", read_by_both)
        writers = [threading.Thread(target=_Cache.save_overload, args=what) for what in compiled]
        for writer in writers:
            writer.start()
        for writer in writers:
            writer.join()
    assert len(set(compiled[0][0].files._cache_file._load_index().values())) == 2


def test_a_full_disk_costs_the_cache_and_nothing_else(tmp_path: Path) -> None:
    file = tmp_path / "doubled.py"
    file.write_text(
        "from touchline.core.jit import kernel\n\n\n"
        "@kernel\ndef doubled(x):\n    return 2 * x\n\n\nassert doubled(21) == 42\n"
    )
    command = [sys.executable, str(file)]
    done = subprocess.run(command, preexec_fn=_no_room, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert not any(path.stat().st_size for path in tmp_path.rglob("*.nbc"))
    assert subprocess.run(command, check=False).returncode == 0
    assert any(tmp_path.rglob("*.nbc"))


SCRIPT = """
from numbers_of import FACTOR
from touchline.core.jit import kernel

@kernel
def scaled(x):
    return FACTOR * x

print(scaled(21), sum(scaled.stats.cache_hits.values()))
"""


def _scaled(folder: Path, *, factor: int, unrelated: str = "") -> str:
    """The output of a script whose kernel takes a constant from another file."""
    (folder / "numbers_of.py").write_text(f"FACTOR = {factor}\n")
    (folder / "unrelated.py").write_text(unrelated)
    (folder / "script.py").write_text(SCRIPT)
    # No bytecode files (-B): they are out of date unseen when an edit of the same size falls into the same second.
    command = [sys.executable, "-B", "script.py"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=True)
    return done.stdout.strip()


def test_an_edit_compiles_again_what_depends_on_it_and_nothing_else(tmp_path: Path) -> None:
    assert _scaled(tmp_path, factor=2) == "42 0"
    assert _scaled(tmp_path, factor=2, unrelated="# edited") == "42 1"
    assert _scaled(tmp_path, factor=3) == "63 0"
    assert _scaled(tmp_path, factor=2) == "42 1"


def test_compiled_code_that_nobody_has_used_for_a_month_is_removed(tmp_path: Path) -> None:
    kernels = tmp_path / "touchline" / "kernels"
    for name, days in (("old", 31), ("recent", 29)):
        (kernels / name).mkdir(parents=True)
        (kernels / name / "code.nbc").touch()
        then = time.time() - days * 24 * 3600
        os.utime(kernels / name, (then, then))
    _, outer = chain()
    assert outer(2.0) == 24.0
    assert [path.name for path in kernels.iterdir() if path.name in ("old", "recent")] == ["recent"]


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
    assert len(halves.overloads) == 2


def test_a_class_without_a_kernel_of_that_name_is_told() -> None:
    @kernel
    def outer(framed: Framed) -> float:
        return area(framed, 1.0)

    with pytest.raises(Exception, match="area"):
        outer(Framed(1.0, Square(3.0)))


@pytest.mark.parametrize("ours", [True, False])
def test_code_for_named_tuples_of_somebody_else_is_not_kept(
    ours: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    if ours:
        monkeypatch.setattr("touchline.core.jit._PACKAGE", __name__.partition(".")[0])

    @kernel
    def whole(framed: Framed) -> float:
        return area(framed.shape, 1.0)

    assert whole(Framed(1.0, Square(3.0))) == 9.0
    assert bool(list(tmp_path.rglob("*whole*.nbc"))) == ours


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
    @borrowing
    def make(count: int) -> float:
        return float(np.ones(count)[0])

    with pytest.raises(NumbaError):
        make(3)


class Scaled(NamedTuple):
    scale: float
    rows: np.ndarray


def test_code_is_found_again_by_the_types_of_its_arguments_alone() -> None:
    @kernel
    def total(scaled: Scaled) -> float:
        return scaled.scale * scaled.rows.sum()

    rows = np.arange(6.0).reshape(2, 3)
    code = total.for_types_of((Scaled(2.0, rows),))
    assert code(Scaled(2.0, rows)) == 30.0
    assert total.for_types_of((Scaled(3.0, rows + 1.0),)) is code and len(total.overloads) == 1
    for others in (rows.astype(np.float32), rows.T, rows[0], rows[:, ::2]):
        scaled = Scaled(1.0, others)
        assert total.for_types_of((scaled,))(scaled) == others.sum()
    assert len(total.overloads) == 5

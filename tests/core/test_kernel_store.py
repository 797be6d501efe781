"""Kernels on disk: kept, compiled again after an edit or damage, shipped as a library, removed."""

import json
import os
import resource
import shutil
import subprocess
import sys
import time
from functools import cache
from pathlib import Path

import pytest

from kernels import link
from touchline.core import kernel_store


@pytest.fixture(autouse=True)
def compiled_anew(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))


def _no_room() -> None:
    resource.setrlimit(resource.RLIMIT_FSIZE, (100, 100))


def test_a_full_disk_costs_the_cache_and_nothing_else(tmp_path: Path) -> None:
    file = tmp_path / "doubled.py"
    file.write_text(
        "from touchline.core.jit import kernel\n\n\n"
        "@kernel\ndef doubled(x):\n    return 2 * x\n\n\nassert doubled(21) == 42\n"
    )
    command = [sys.executable, str(file)]
    done = subprocess.run(command, preexec_fn=_no_room, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert not any(tmp_path.rglob("*.o"))


SCRIPT = """
import sys
from numbers_of import FACTOR
from touchline.core.jit import kernel

@kernel
def scaled(x):
    return FACTOR * x

print(scaled(21), "numba" in sys.modules)
"""


def _scaled(folder: Path, *, factor: int, unrelated: str = "", processes: int = 1) -> str:
    """Value of a script's kernel with a constant from another file, and whether it was compiled, in each process."""
    (folder / "numbers_of.py").write_text(f"FACTOR = {factor}\n")
    (folder / "unrelated.py").write_text(unrelated)
    (folder / "script.py").write_text(SCRIPT)
    # No bytecode files (-B): they are out of date unseen when an edit of the same size falls into the same second.
    command = [sys.executable, "-B", "script.py"]
    started = [subprocess.Popen(command, cwd=folder, stdout=subprocess.PIPE, text=True) for _ in range(processes)]
    return ", ".join(sorted(each.communicate()[0].strip() for each in started))


def test_processes_compile_once_what_is_new_or_depends_on_an_edit_or_is_damaged(tmp_path: Path) -> None:
    assert _scaled(tmp_path, factor=2, processes=2) == "42 False, 42 True"
    assert len(list((tmp_path / "touchline" / "kernels").iterdir())) == 1
    assert _scaled(tmp_path, factor=2, unrelated="# edited") == "42 False"
    assert _scaled(tmp_path, factor=3) == "63 True"
    for code in tmp_path.rglob("*.o"):
        code.write_bytes(code.read_bytes()[:20])
    assert _scaled(tmp_path, factor=2) == "42 True"


IN_LIBRARY = """
import sys
from pathlib import Path
from touchline.core import kernel_code, kernel_store

kernel_code.FOR_LIBRARY = "make" in sys.argv
if not kernel_code.FOR_LIBRARY:
    kernel_store._SHIPPED = Path("library")
    sys.modules["numba"] = sys.modules["llvmlite"] = None
"""


@pytest.mark.skipif(shutil.which("cc") is None, reason="a library is linked by a C compiler")
def test_a_library_of_kernels_is_used_without_numba_and_llvm(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "numbers_of.py").write_text("FACTOR = 2\n")
    (tmp_path / "script.py").write_text(IN_LIBRARY + SCRIPT)
    (tmp_path / "library").mkdir()
    command = [sys.executable, "-B", "script.py"]
    subprocess.run([*command, "make"], cwd=tmp_path, check=True)
    link(list(kernel_store.cache_folder().glob("*.o")), tmp_path / "library")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "empty"))
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=True)
    assert done.stdout.split()[0] == "42"
    (tmp_path / "numbers_of.py").write_text("FACTOR = 3\n")  # other text: the library has no code for it
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 1 and "numba" in done.stderr


def test_a_library_that_is_damaged_or_missing_is_told_and_not_used(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    def found() -> tuple[object, str]:
        monkeypatch.setattr(kernel_store, "shipped", cache(kernel_store.shipped.__wrapped__))
        caplog.clear()
        return kernel_store.find("some"), caplog.text

    monkeypatch.setattr(kernel_store, "_SHIPPED", tmp_path / "library")
    assert found() == (None, "")
    library, contents = tmp_path / "library" / kernel_store.LIBRARY, tmp_path / "library" / kernel_store.CONTENTS
    library.parent.mkdir()
    library.write_bytes(b"code")
    listed = kernel_store.Contents(numba="", digest=kernel_store.digest(b"code"), results={"some": "int64"})
    contents.write_text(json.dumps(listed))
    for problem, damage in (
        ("kernels.so: file too short", lambda: None),
        ("kernels.so is damaged", lambda: library.write_bytes(b"odes")),
        ("No such file", library.unlink),
        ("kernels.json is damaged", lambda: contents.write_text(contents.read_text()[:9])),
    ):
        damage()
        code, said = found()
        assert code is None and problem in said and said.rstrip().endswith("reinstall Touchline")


def test_code_that_nobody_has_used_for_a_month_is_removed_and_the_oldest_of_too_much(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    kernels = tmp_path / "touchline" / "kernels"
    for name, days in (("old", 31), ("older", 29), ("recent", 28)):
        kernels.mkdir(parents=True, exist_ok=True)
        (kernels / name).write_bytes(bytes(1000))
        then = time.time() - days * 24 * 3600
        os.utime(kernels / name, (then, then))
    kernel_store.keep("new", bytes(100), "none")
    assert {path.name for path in kernels.iterdir()} == {"older", "recent", "new.o"}
    monkeypatch.setattr(kernel_store, "_MOST_BYTES", 1500)
    kernel_store.keep("newest", bytes(100), "none")
    assert {path.name for path in kernels.iterdir()} == {"recent", "new.o", "newest.o"}

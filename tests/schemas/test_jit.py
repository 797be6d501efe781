"""Kernels whose compiled form cannot be kept."""

import resource
import subprocess
import sys


def _no_room():
    resource.setrlimit(resource.RLIMIT_FSIZE, (100, 100))


def test_a_full_disk_costs_the_cache_and_nothing_else(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    file = tmp_path / "doubled.py"
    file.write_text(
        "from schemas.jit import kernel\n\n\n@kernel\ndef doubled(x):\n    return 2 * x\n\n\nassert doubled(21) == 42\n"
    )
    command = [sys.executable, str(file)]
    done = subprocess.run(command, preexec_fn=_no_room, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert not any(path.stat().st_size for path in tmp_path.rglob("*.nbc"))
    assert subprocess.run(command, check=False).returncode == 0
    assert any(tmp_path.rglob("*.nbc"))

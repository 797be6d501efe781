"""Keeps Python from importing modules of the current folder in place of ours."""

import os
from pathlib import Path


def safe_path() -> dict[str, str]:
    """Environment variables for processes that we start, however they are started.

    ``python -m`` and ``python -c`` would look for modules in the current folder first, and so do empty and relative
    parts of ``PYTHONPATH``.
    """
    variables = {"PYTHONSAFEPATH": "1"}
    if parts := os.environ.get("PYTHONPATH"):
        variables["PYTHONPATH"] = os.pathsep.join(part for part in parts.split(os.pathsep) if Path(part).is_absolute())
    return variables

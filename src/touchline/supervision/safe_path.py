"""Protection from modules of the current folder, which Python would import in place of ours."""

import os
from pathlib import Path


def safe_path() -> dict[str, str]:
    """Return environment variables for our child processes, however they are started.

    ``python -m`` and ``python -c`` would look for modules in the current folder first, and so do empty and relative
    parts of ``PYTHONPATH``.
    """
    variables = {"PYTHONSAFEPATH": "1"}
    if parts := os.environ.get("PYTHONPATH"):
        variables["PYTHONPATH"] = os.pathsep.join(part for part in parts.split(os.pathsep) if Path(part).is_absolute())
    return variables

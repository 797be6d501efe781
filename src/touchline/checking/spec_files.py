"""Specifications that are written to files of a folder, to be given as `--vehicle`, `--scenario` and `--onboard`."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from touchline.recordings.writing import write_text, writing
from touchline.schemas.spec import EVERY_FIELD, Spec


def write_specs(specs: Mapping[str, Spec], folder: Path) -> tuple[Path, ...]:
    """Write specifications with all of their fields.

    Args:
        specs: Specifications by the names of their files.
        folder: Folder to write to, made if it does not exist.

    Returns:
        The files.

    Raises:
        SpecError: They cannot be written.
    """
    with writing(folder, "folder"):
        folder.mkdir(parents=True, exist_ok=True)
    for name, spec in specs.items():
        write_text(spec.model_dump_json(indent=1, context=EVERY_FIELD) + "\n", folder / name)
    return tuple(folder / name for name in specs)

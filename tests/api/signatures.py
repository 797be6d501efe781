"""Signatures of the public names as text; run as a module it writes those that the test holds."""

import inspect
import json
from pathlib import Path

import touchline


def signatures() -> dict[str, str | dict[str, str]]:
    """Return signatures of functions and of public methods of classes, and modules of all else."""
    found: dict[str, str | dict[str, str]] = {}
    for name in touchline.__all__:
        value = getattr(touchline, name)
        if inspect.isfunction(value):
            found[name] = str(inspect.signature(value))
        elif inspect.isclass(value) and value.__module__.startswith("touchline.api"):
            methods = {
                each: str(inspect.signature(method))
                for each, method in inspect.getmembers(value, inspect.isroutine)
                if not each.startswith("_") and each in vars(value) and callable(method)
            }
            found[name] = {each: method for each, method in methods.items() if not each.startswith("model_")}
        elif name != "__version__":
            found[name] = value.__module__
    return found


if __name__ == "__main__":
    text = json.dumps(signatures(), indent=1, sort_keys=True)
    Path(__file__).with_name("signatures.json").write_text(text + "\n", encoding="utf-8")

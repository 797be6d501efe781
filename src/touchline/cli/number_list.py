"""Numbers that an option is given, separated by commas."""

from collections.abc import Sequence

from touchline.schemas.errors import SpecError


def numbers_of(option: str, text: str, counts: Sequence[int], example: str) -> list[float]:
    """The numbers in the text of an option.

    Args:
        option: As written on the command line.
        text: What it is given.
        counts: How many there may be.
        example: A text that would do.

    Raises:
        SpecError: They are none, or not as many.
    """
    try:
        numbers = [float(part) for part in text.split(",")]
    except ValueError:
        numbers = []
    if len(numbers) not in counts:
        raise SpecError("command line", option, f"is {text!r}", f"give it as in {option} {example}")
    return numbers

"""Comma-separated numbers as the value of an option."""

from collections.abc import Sequence

from touchline.schemas.errors import SpecError


def numbers_of(option: str, text: str, counts: Sequence[int], example: str) -> list[float]:
    """Parse the numbers in an option's value.

    Args:
        option: Name of the option, with its dashes.
        text: Its value.
        counts: Allowed numbers of numbers.
        example: A valid value, for the error message.

    Raises:
        SpecError: The value is not a list of numbers, or has the wrong length.
    """
    try:
        numbers = [float(part) for part in text.split(",")]
    except ValueError:
        numbers = []
    if len(numbers) not in counts:
        raise SpecError("command line", option, f"is {text!r}", f"give it as in {option} {example}")
    return numbers

"""A text of megabytes is read, or refused with what is too much, in a time that grows with its size."""

import pytest

from touchline.schemas.catalogue import parse_template
from touchline.schemas.errors import SpecError
from touchline.schemas.spec import MAX_KEYS, MAX_SPEC_BYTES

SEGMENT = '{"id": "%d", "line": {"start": [0, 0], "end": [5, 0]}}'


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("{" + ",".join(f'"k{i}": 1' for i in range(100_000)) + ', "k5": 2}', "key 'k5' is given twice"),
        ("{" + ",".join(f'"k{i}": 1' for i in range(100_000)) + "}", f"give at most {MAX_KEYS:,}"),
        ('{"name": "' + "x" * MAX_SPEC_BYTES + '"}', f"give at most {MAX_SPEC_BYTES:,}"),
        ('{"name": ' + "[" * 100_000 + "]" * 100_000 + "}", "nested too deeply"),
        ('{"name": ' + "1" * 100_000 + "}", "thousands of digits"),
        ('{"name": "t", "line_width_m": 1e999}', "is inf"),
    ],
    ids=["repeated", "many keys", "large", "deep", "digits", "infinite"],
)
def test_what_is_too_much_is_refused_by_name(text: str, says: str) -> None:
    with pytest.raises(SpecError, match=says):
        parse_template(text)

"""Differences between the schemas of a topic in two recordings."""

from dataclasses import dataclass, field

from touchline.recordings.decoding import full_name, layout
from touchline.recordings.recorded import RecordingKind

#: Fields of a schema that are named; the others are counted.
_FIELDS_NAMED = 5


@dataclass(frozen=True)
class SchemaChange:
    """Differences in how a topic was recorded.

    Attributes:
        notes: One line each.
        compatible: Whether one only lacks fields that the other has, as an older version does.
        left_only, right_only: Fields, by their path, that only one has.
    """

    notes: tuple[str, ...] = ()
    compatible: bool = True
    left_only: frozenset[str] = field(default_factory=frozenset)
    right_only: frozenset[str] = field(default_factory=frozenset)


def schema_change(left: RecordingKind, right: RecordingKind, names: tuple[str, str]) -> SchemaChange:
    """Return the differences between two kinds of payload; comments and spaces in a definition make no difference.

    Args:
        left: Kind in the first recording.
        right: Kind in the second.
        names: Names of the two, for messages.
    """
    if left == right:
        return SchemaChange()
    notes: list[str] = []
    if left.encoding != right.encoding:
        forms = [kind.encoding or "an unnamed encoding" for kind in (left, right)]
        notes.append(f"recorded as {forms[0]} in {names[0]}, as {forms[1]} in {names[1]}")
    if full_name(left.type) != full_name(right.type):
        notes.append(f"of type {left.type or 'nothing'} in {names[0]}, {right.type or 'nothing'} in {names[1]}")
    ours, theirs = layout(left), layout(right)
    if ours is None or theirs is None:
        if left.schema != right.schema and left.encoding == right.encoding:
            notes.append("the schemas are different, and cannot be read here")
        return SchemaChange(tuple(notes), compatible=not notes)
    left_only, right_only = [f for f in ours if f not in theirs], [f for f in theirs if f not in ours]
    retyped = [f for f in ours if f in theirs and ours[f] != theirs[f]]
    compatible = not notes and not retyped and not (left_only and right_only)
    renamed = list(ours.values()) == list(theirs.values()) and len(left_only) == len(right_only) > 0
    if renamed:
        pairs = [(one, other) for one, other in zip(ours, theirs, strict=True) if one != other]
        notes += _named([f"field {one} of {names[0]} is called {other} in {names[1]}" for one, other in pairs])
    else:
        notes += [f"only {names[0]} has the field{_list(left_only)}"] if left_only else []
        notes += [f"only {names[1]} has the field{_list(right_only)}"] if right_only else []
    notes += _named([f"field {f} is {ours[f]} in {names[0]}, {theirs[f]} in {names[1]}" for f in retyped])
    if not notes and list(ours) != list(theirs):
        notes, compatible = ["the fields are in another order"], False
    return SchemaChange(tuple(notes), compatible, frozenset(left_only), frozenset(right_only))


def _named(notes: list[str]) -> list[str]:
    rest = len(notes) - _FIELDS_NAMED
    return notes[:_FIELDS_NAMED] + ([f"and {rest} more fields"] if rest > 0 else [])


def _list(fields: list[str]) -> str:
    shown = ", ".join(fields[:_FIELDS_NAMED])
    rest = len(fields) - _FIELDS_NAMED
    return f"{'s' if len(fields) > 1 else ''} {shown}{f' and {rest} more' if rest > 0 else ''}"

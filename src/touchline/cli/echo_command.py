"""``touchline echo``: messages of a topic, recorded or live."""

import sys
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any

import typer

from touchline.cli.display import print_event, print_json
from touchline.cli.groups import with_groups
from touchline.cli.message_source import LiveOption, SecondsOption, message_source
from touchline.cli.options import ExitCode, JsonOption
from touchline.schemas.errors import SpecError, TouchlineError
from touchline.schemas.messages import Event
from touchline.schemas.plain_text import plain

if TYPE_CHECKING:
    from touchline.recordings.recorded import Recorded

#: Elements of a list that are shown; --json has all.
_MOST_SHOWN = 12


def register(app: typer.Typer) -> None:
    """Add the subcommand to `app`."""
    app.command("echo")(with_groups(echo))


@dataclass(frozen=True)
class Extract:
    """Part of a topic to show."""

    field: Annotated[
        str,
        typer.Option(
            metavar="PATH", help="Show only this field, such as pose.pose.position.x or x_m[0].", show_default=False
        ),
    ] = ""
    from_s: Annotated[float | None, typer.Option("--from", metavar="S", help="Start at this time, s, as shown.")] = None
    to_s: Annotated[float | None, typer.Option("--to", metavar="S", help="End at this time, s, as shown.")] = None
    count: Annotated[
        int, typer.Option(metavar="N", help="Show at most N messages (0: all).", min=0, show_default=False)
    ] = 0

    def of(self, messages: "Iterator[Recorded]") -> "Iterator[Recorded]":
        """Yield the selected messages."""
        begin_s = float("-inf") if self.from_s is None else self.from_s
        end_s = float("inf") if self.to_s is None else self.to_s
        shown = 0
        for message in messages:
            if begin_s <= message.publish_time_ns / 1e9 <= end_s:
                yield message
                shown += 1
                if shown == self.count:
                    return


def echo(
    given: Annotated[
        list[str], typer.Argument(metavar="RECORDING TOPIC", help="/tt2/gnss/fix, or gnss/fix of all robots.")
    ],
    extract: Extract,
    robot: LiveOption = None,
    seconds: SecondsOption = 0.0,
    as_json: JsonOption = False,
) -> None:
    """Show the messages of a topic, from a recording or (--robot) from the bus, with their own time stamps.

    With --json one object per line, with the times at which it was stamped and recorded.
    """
    from touchline.recordings.recorded import Damage

    wanted = 2 if robot is None else 1
    if len(given) != wanted:
        needed = "RECORDING TOPIC" if robot is None else "TOPIC"
        raise SpecError("command line", "arguments", f"are {len(given)}", f"give {needed}")
    damaged, shown, reason = 0, 0, ""
    with message_source(given, robot, seconds) as messages:
        for message in extract.of(messages):
            try:
                _show(message, extract.field, as_json)
                shown += 1
            except Damage as damage:
                damaged, reason = damaged + 1, str(damage)
    if damaged and not shown:
        raise TouchlineError(f"{given[-1]}: none of {damaged:,} messages can be shown: {reason}")
    if damaged:
        print_event(Event.WARN, f"{damaged:,} messages cannot be shown: {reason}")
        sys.exit(ExitCode.FAILED)


def _show(message: "Recorded", field: str, as_json: bool) -> None:
    from touchline.recordings.message_values import at_path, values_of

    values = values_of(message)
    if field:
        values = at_path(values, field)
    time_s = message.publish_time_ns / 1e9
    if as_json:
        line: dict[str, Any] = {"time_s": time_s, "log_time_s": message.log_time_ns / 1e9, "topic": message.topic}
        print_json({**line, "field": field, "value": values} if field else {**line, "message": values}, None)
    elif field and not isinstance(values, dict):
        typer.echo(f"{time_s:.6f}  {_shown(field, values)}")
    else:
        typer.echo(f"{plain(message.topic)} at {time_s:.6f} s")
        typer.echo("".join(f"  {line}\n" for line in _lines(values)), nl=False)


def _lines(values: object) -> Iterator[str]:
    from touchline.recordings.message_values import flat

    for path, value in flat(values):
        yield f"{plain(path)}: {_shown(path, value)}"


def _shown(path: str, value: object) -> str:
    from touchline.recordings.units import unit_of

    if isinstance(value, list):
        rest = f", … {len(value)} in all" if len(value) > _MOST_SHOWN else ""
        text = f"[{', '.join(plain(str(each)) for each in value[:_MOST_SHOWN])}{rest}]"
    else:
        text = "–" if value is None else plain(str(value))
    unit = unit_of(path)
    return f"{text} {unit}" if unit and not isinstance(value, str) else text

"""``touchline hz``: rates of topics, recorded or live."""

from dataclasses import asdict
from typing import Annotated

import typer
from rich.markup import escape
from rich.table import Table

from touchline.cli.display import print_json, print_table
from touchline.cli.message_source import LiveOption, SecondsOption, message_source
from touchline.cli.options import JsonOption
from touchline.schemas.plain_text import plain


def register(app: typer.Typer) -> None:
    """Add the subcommand to `app`."""
    app.command("hz")(hz)


def hz(
    given: Annotated[
        list[str] | None, typer.Argument(metavar="RECORDING [TOPIC]...", help="All topics if none is given.")
    ] = None,
    robot: LiveOption = None,
    seconds: SecondsOption = 5.0,
    as_json: JsonOption = False,
) -> None:
    """Show rate and jitter of topics, by the times at which messages were recorded or (--robot) arrive here."""
    from touchline.recordings.topic_rates import topic_rates

    with message_source(given or (), robot, seconds) as messages:
        rates = topic_rates(messages)
    if as_json:
        print_json({name: asdict(rate) for name, rate in rates.items()})
        return
    table = Table(box=None, padding=(0, 2))
    table.add_column("topic")
    for name in ("messages", "rate Hz", "gap p50 ms", "p95 ms", "max ms", "jitter ms"):
        table.add_column(name, justify="right")
    for name, rate in rates.items():
        counted, *measured = asdict(rate).values()
        figures = ("–" if value is None else f"{value:,.4g}" for value in measured)
        table.add_row(escape(plain(name)), f"{counted:,}", *figures)
    print_table(table)

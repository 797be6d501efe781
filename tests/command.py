"""The command with all its subcommands, for tests that invoke it in their own process."""

from touchline.cli.commands import command_line

app = command_line()

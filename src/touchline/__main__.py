"""``python -m touchline``: the command line, also of the services that a supervisor starts with its own interpreter."""

from touchline.cli import main

main()

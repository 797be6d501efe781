"""``python -m services.cli``: how the supervisor executes services with its own interpreter."""

from services.cli.main import main

main()

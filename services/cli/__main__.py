"""``python -m services.cli``: how the supervisor executes services with its own interpreter."""

from services.cli import main

main()

"""Version of the installed package."""

from touchline.recordings.code_identity import own_version

__version__ = own_version()

"""What viewers draw of a robot: transforms, paths and markers, made of the messages that it sends."""

from touchline.recordings.viewing.viewing import Drawn, Viewing, frame_prefix

__all__ = ["Drawn", "Viewing", "frame_prefix"]

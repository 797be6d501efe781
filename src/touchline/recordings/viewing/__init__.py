"""Viewers' messages of a robot: transforms, paths and markers, made from the messages that it sends."""

from touchline.recordings.viewing.viewing import Drawn, Viewing, frame_prefix

__all__ = ["Drawn", "Viewing", "frame_prefix"]

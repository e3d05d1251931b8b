"""Video files: pictures one after the other, each with its time."""

from mtm_audit.readers.video.frames import read_frames
from mtm_audit.readers.video.header import VideoFile, inspect_video

__all__ = ["VideoFile", "inspect_video", "read_frames"]

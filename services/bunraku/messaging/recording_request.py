"""What the session service asks for on the bus when a session is to be kept as a motion (subject `ingest.keep`).

On the bus goes the name under which the order, MessagePack, lies in the library beside the log that it names.
"""

from __future__ import annotations

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field, FiniteFloat

RECORDING_FPS = 60
"""Frames a second of a kept motion: as many as viewers are shown."""
MAX_RECORDING_S = 600
"""The longest that is kept in one motion."""
MAX_CAMERA_KEYFRAMES = 36_001
"""Of the camera: one a frame of the longest motion."""

ClockTime = Annotated[int, Field(ge=0, lt=1 << 53)]
KeyframeValues = Annotated[list[FiniteFloat], Field(min_length=8, max_length=8)]


class RecordingRequest(BaseModel):
    """What to keep: clock times `begin` to `end`, microseconds, of the session whose log is the library's object `log`.

    `subject` is who stores it. `camera` are keyframes in ascending order of clock time: time, position and the point
    gazed at in metres, vertical field of view in radians. Without a `name` the motion has that of the dance.
    """

    model_config = ConfigDict(extra="ignore")
    log: str
    name: Annotated[str | None, Field(max_length=200)] = None
    subject: Annotated[str, Field(max_length=64)] = ""
    begin: ClockTime
    end: ClockTime
    camera: Annotated[list[KeyframeValues], Field(max_length=MAX_CAMERA_KEYFRAMES)] = []

    @property
    def frame_count(self) -> int:
        """Frames of the motion, should all of it be kept."""
        return max(round((self.end - self.begin) * RECORDING_FPS / 1e6), 0)

"""Request of the session service to record a session as a motion (bus subject `ingest.keep`).

The request, as MessagePack, and the session log are stored in the motion store; the bus message is the name of the
stored request.
"""

from __future__ import annotations

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field, FiniteFloat

RECORDING_FPS = 60
"""Frame rate of a recorded motion, the rate at which viewers render."""
MAX_RECORDING_S = 600
"""Maximum duration of a recording, in seconds."""
MAX_CAMERA_KEYFRAMES = 36_001
"""Maximum number of camera keyframes: one per frame of the longest recording."""

ClockTime = Annotated[int, Field(ge=0, lt=1 << 53)]
KeyframeValues = Annotated[list[FiniteFloat], Field(min_length=8, max_length=8)]


class RecordingRequest(BaseModel):
    """Interval of a session to record as a motion."""

    model_config = ConfigDict(extra="ignore")
    log: str
    """Name of the session log in the motion store."""
    name: Annotated[str | None, Field(max_length=200)] = None
    """Name of the new motion; None: derived from the name of the motion that was played."""
    subject: Annotated[str, Field(max_length=64)] = ""
    """Subject that stores the motion."""
    begin: ClockTime
    """Start of the interval, clock time in microseconds."""
    end: ClockTime
    """End of the interval, clock time in microseconds."""
    camera: Annotated[list[KeyframeValues], Field(max_length=MAX_CAMERA_KEYFRAMES)] = []
    """Keyframes in ascending order of clock time: time (microseconds), position and gaze point (metres), vertical field
    of view (radians)."""

    @property
    def frame_count(self) -> int:
        """Number of frames of the complete interval."""
        return max(round((self.end - self.begin) * RECORDING_FPS / 1e6), 0)

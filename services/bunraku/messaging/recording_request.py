"""Request of the session service to record a session as a motion (bus subject `ingest.keep`).

The request, as MessagePack, and the session log are stored in the motion store; the bus message is the name of the
stored request.
"""

from __future__ import annotations

from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import BaseModel, ConfigDict, Field

RECORDING_FPS = 60
"""Frame rate of a recorded motion, the rate at which viewers render."""
MAX_RECORDING_S = 600
"""Maximum duration of a recording, in seconds."""
MAX_CAMERA_KEYFRAMES = 36_001
"""Maximum number of camera keyframes: one per frame of the longest recording."""

RECORDING_SUBJECT = "ingest.keep"
"""Subject of the requests."""
RECORDING_KEY_PREFIX = "recordings"
"""Prefix of `recordings.{log}`: lease of the replica that records a session's log."""

CAMERA_VALUES = 8
"""Values of a camera keyframe: clock time (microseconds), position and gaze point (metres), vertical field of view
(radians)."""
CAMERA_DTYPE = np.dtype("<f8")

ClockTime = Annotated[int, Field(ge=0, lt=1 << 53)]


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
    camera: Annotated[bytes, Field(max_length=MAX_CAMERA_KEYFRAMES * CAMERA_VALUES * CAMERA_DTYPE.itemsize)] = b""
    """Camera keyframes by `pack_camera`."""

    @property
    def camera_keyframes(self) -> NDArray[np.float64]:
        """Keyframes of the camera (n, `CAMERA_VALUES`); raises ValueError for an incomplete one."""
        return np.frombuffer(self.camera, CAMERA_DTYPE).reshape(-1, CAMERA_VALUES).astype(np.float64)

    @property
    def frame_count(self) -> int:
        """Number of frames of the complete interval."""
        return max(round((self.end - self.begin) * RECORDING_FPS / 1e6), 0)


def pack_camera(keyframes: ArrayLike) -> bytes:
    """Return keyframes (n, `CAMERA_VALUES`), in ascending order of time, as bytes: parsing them takes no time."""
    return np.asarray(keyframes, CAMERA_DTYPE).tobytes()

"""Keeping what a stage showed: its log goes to the ingest service, which makes a motion of it."""

from __future__ import annotations

from typing import Annotated, Any

import msgpack
from pydantic import BaseModel, ConfigDict, Field, FiniteFloat

from bunraku.messaging.bus import NoResponse
from bunraku.messaging.recording_request import MAX_CAMERA_KEYFRAMES, MAX_RECORDING_S
from bunraku.runtime.context import ServiceContext
from bunraku.runtime.problem import ProblemError
from bunraku.session.stage_proxy import StageProxy

INGEST_TIMEOUT_S = 120.0
"""Seconds to wait for the ingest service."""

PointCoordinates = Annotated[list[FiniteFloat], Field(min_length=3, max_length=3, description="x, y, z, metres, y up")]


class Keyframe(BaseModel):
    """Where the camera was at a clock time; between two of them it moves evenly."""

    model_config = ConfigDict(extra="forbid")
    time: Annotated[int, Field(ge=0, lt=1 << 53, description="clock time, microseconds")]
    position: PointCoordinates
    gaze: PointCoordinates
    fov: Annotated[FiniteFloat, Field(gt=0.0, lt=3.14, description="vertical field of view, radians")]


class Recording(BaseModel):
    """What is to be kept of a session."""

    model_config = ConfigDict(extra="forbid")
    name: Annotated[str | None, Field(max_length=200)] = None
    seconds: Annotated[
        FiniteFloat | None,
        Field(
            gt=0.0, le=MAX_RECORDING_S, description="how much of what was shown last; the dance's length, if not said"
        ),
    ] = None
    camera: Annotated[list[Keyframe], Field(max_length=MAX_CAMERA_KEYFRAMES)] = []


async def record_session(
    stage: StageProxy, recording: Recording, context: ServiceContext, subject: str = ""
) -> dict[str, Any]:
    """The new motion, stored by `subject`, as the API shows it; raises `ProblemError`.

    Log and order lie in the library meanwhile: both may have more bytes than a bus takes in one message.
    """
    library, kept = context.motion_store, await stage.store_log(recording.seconds)
    order = {
        **kept,
        "name": recording.name,
        "subject": subject,
        "camera": [[key.time, *key.position, *key.gaze, key.fov] for key in recording.camera],
    }
    name = f"{kept['log']}-order"
    try:
        await library.put_log(name, msgpack.packb(order))
        answer = msgpack.unpackb(await context.bus.request("ingest.keep", name.encode(), INGEST_TIMEOUT_S))
    except NoResponse:
        raise ProblemError(
            503, "Cannot keep now", "the service that makes motions does not answer", hint="try again in a while"
        ) from None
    finally:
        await library.remove_log(name)
        await library.remove_log(kept["log"])
    if "problem" in answer:
        raise ProblemError.from_dict(answer["problem"])
    motion: dict[str, Any] = answer["motion"]
    return motion

"""Samples of live performers as JSON, for tools without a binary encoder (proto/server.md)."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, FiniteFloat, ValidationError

from bunraku.http.problem_details import validation_problem
from bunraku.http.structured_body import BodyStructure, decode_json
from bunraku.motion import rotation
from bunraku.motion.skeleton import JOINT_COUNT, JOINTS
from bunraku.playout.performance import pack_sample
from bunraku.runtime.problem import ProblemError
from bunraku.wire.live import MAX_ROOT_M, Sample

MAX_SAMPLE_BYTES = 4_096
"""Longest message: 18 quaternions with 17 digits per number have 2 kB."""
_STRUCTURE = BodyStructure(max_values=8 * JOINT_COUNT, max_depth=4)
_MIN_NORM = 1e-3

Quaternion = Annotated[list[FiniteFloat], Field(min_length=4, max_length=4, description="w, x, y, z")]

Coordinate = Annotated[FiniteFloat, Field(ge=-MAX_ROOT_M, le=MAX_ROOT_M)]


class JsonSample(BaseModel):
    """Pose of a performer; joints that are left out are in their rest rotation."""

    model_config = ConfigDict(extra="forbid")
    time: Annotated[int | None, Field(ge=0, lt=1 << 53, description="clock time, microseconds; now by default")] = None
    root: Annotated[list[Coordinate], Field(min_length=3, max_length=3, description="x, y, z of the root, metres")]
    rotations: Annotated[
        dict[str, Quaternion],
        Field(max_length=JOINT_COUNT, description="rotation of joints in the frame of their parent, by H-Anim name"),
    ] = {}


def parse_sample(message: bytes, now: int) -> Sample:
    """Return the sample in a JSON message that arrived at clock time `now`; raise `ProblemError`."""
    try:
        values = JsonSample.model_validate(decode_json(message, _STRUCTURE))
    except ValidationError as error:
        raise validation_problem(error) from None
    quaternions = np.tile(rotation.IDENTITY, (JOINT_COUNT, 1))
    for name, quaternion in values.rotations.items():
        if name not in JOINTS:
            raise _invalid(f"there is no joint {name[:40]!r}")
        norm = float(np.linalg.norm(np.clip(quaternion, -1e6, 1e6)))
        if norm < _MIN_NORM:
            raise _invalid(f"the quaternion of {name} has no length")
        quaternions[JOINTS.index(name)] = np.clip(quaternion, -1e6, 1e6) / norm
    return pack_sample(now if values.time is None else values.time, (np.array(values.root), quaternions))


def _invalid(detail: str) -> ProblemError:
    return ProblemError(422, "Invalid sample", detail, field="rotations")

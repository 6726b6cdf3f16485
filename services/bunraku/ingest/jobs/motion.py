"""Job that encodes a motion file. Importing this module loads and compiles everything that a job uses."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from bunraku.codec import motion_encoder
from bunraku.codec.container import pack_motion
from bunraku.codec.extension import encoder as extension_encoder
from bunraku.codec.extension.contact import EncodedContacts
from bunraku.codec.extension.encoder import EncodedExtension, encode_extension
from bunraku.codec.extension.track import Extension
from bunraku.codec.skeleton_description import BoneTooLong
from bunraku.ingest.jobs.encoding import describe_encoding, encode_foot_contacts, encode_motions
from bunraku.ingest.result import NOTHING_MOVES, JobRejection, JobResult, reject_file
from bunraku.marionette.limb_rig import ArmRig, Limb
from bunraku.marionette.proportions import ProportionsError
from bunraku.motion.analysis import Analysis, analyse
from bunraku.motion.errors import UnreadableFile
from bunraku.motion.readers.bvh import parse_bvh
from bunraku.motion.readers.motion_file import list_takes, read_motion
from bunraku.motion.readers.takes import TakeList
from bunraku.motion.rotation import Array

STILL_M, STILL_ALIGNMENT = 1e-3, 1.0 - 1e-6
"""Bounds of a pose: travel of the root in metres, and product of two quaternions, here 0.16 degrees apart."""
STILL_VALUE = 0.02
"""Bound of the change of a pose's extensions: radians, or a share of the range of an expression."""
_MINIMAL_BVH = b"HIERARCHY ROOT a { OFFSET 0 0 0 CHANNELS 1 Xrotation } MOTION Frames: 1 Frame Time: 0.1 0"

motion_encoder.warm_up()
extension_encoder.warm_up()
parse_bvh(_MINIMAL_BVH)


def encode_file(
    motion_id: str,
    path: Path,
    take: str | None = None,
    must_move: bool = False,
    on_progress: Callable[[float], None] = lambda _: None,
) -> JobResult | JobRejection:
    """Parse, analyse and encode `take` of the file at `path`; `on_progress` receives the encoded share, 0..1.

    With `must_move`, a motion that is a single pose is rejected.
    """
    try:
        analysis = analyse(read_motion(path.read_bytes(), take))
        for limb in (Limb.LEFT_HAND, Limb.RIGHT_HAND):
            ArmRig(analysis.motion.figure, limb)
    except UnreadableFile as error:
        return reject_file(error)
    except ProportionsError as error:
        detail = f"the arms of this skeleton cannot be controlled: {error}"
        return JobRejection("No puppet's arms", detail, field=error.field, hint=error.hint)
    if must_move and _is_still(analysis):
        hint = "a single pose is stored if its take is uploaded by its name"
        return JobRejection(NOTHING_MOVES, "it is a single pose", hint=hint)
    on_progress(0.0)
    try:
        (encoded,) = encode_motions([analysis.motion], on_progress)
    except BoneTooLong as error:
        return JobRejection("Bone too long", str(error), hint="check the unit of length and the joints' offsets")
    mean_errors_mm = [level.mean_error_mm for level in encoded.ladder]
    extensions: list[EncodedExtension | EncodedContacts] = [
        encode_extension(extension, values, encoded.track, mean_errors_mm)
        for extension, values in _find_extensions(analysis)
    ]
    extensions += encode_foot_contacts([analysis.motion], [encoded])
    return JobResult(
        pack_motion(motion_id, encoded, extensions=extensions),
        {
            **describe_encoding(analysis.motion, encoded),
            "profile": analysis.profile,
            "joints": analysis.source_joints,
            "rest_pose": analysis.rest_pose,
            "unit": analysis.unit,
            "guessed": analysis.assumptions,
            "fit": _describe_fit(analysis.mean_fit_error_mm, analysis.max_fit_error_mm),
            **({"tracks": ["motion", *(each.track.kind for each in extensions)]} if extensions else {}),
            **_describe_extensions(analysis),
        },
    )


def _find_extensions(analysis: Analysis) -> list[tuple[Extension, Array]]:
    """Return what a source has beside the figure, with its values (n, E, 3)."""
    found: list[tuple[Extension, Array]] = []
    if analysis.extension is not None:
        found.append((analysis.extension.extension, analysis.extension.values))
    if analysis.hands is not None:
        found.append((analysis.hands.hands, analysis.hands.values))
    if analysis.face is not None:
        found.append((analysis.face.face, analysis.face.values))
    return found


def _describe_extensions(analysis: Analysis) -> dict[str, Any]:
    """Return what extensions add to a motion's description: the extension of the body, fingers and face."""
    described: dict[str, Any] = {}
    if analysis.extension is not None:
        described["extension"] = {
            "joints": list(analysis.extension.extension.names),
            "fit": _describe_fit(analysis.extended_mean_error_mm, analysis.extended_max_error_mm),
        }
    if analysis.hands is not None:
        described["fingers"] = {
            "joints": list(analysis.hands.hands.names),
            "fit": _describe_fit(analysis.hands_mean_error_mm, analysis.hands_max_error_mm),
        }
    if analysis.face is not None:
        described["face"] = {"expressions": list(analysis.face.face.names)}
    return described


def _describe_fit(mean_mm: float, max_mm: float) -> dict[str, float]:
    return {"mean_mm": round(mean_mm, 3), "max_mm": round(max_mm, 3)}


def list_file_takes(path: Path, limit: int, opens_files: bool = True) -> TakeList | JobRejection:
    """Return the first `limit` takes of the file at `path`, as `list_takes` does; none if it is one motion."""
    try:
        return list_takes(path.read_bytes(), limit, opens_files)
    except UnreadableFile as error:
        return reject_file(error)


def _is_still(analysis: Analysis) -> bool:
    """Return whether root, joints and extensions are the same in all frames."""
    motion = analysis.motion
    if any(np.ptp(values, axis=0).max() > STILL_VALUE for _, values in _find_extensions(analysis)):
        return False
    alignment = np.abs(np.sum(motion.rotations * motion.rotations[0], axis=-1))
    return bool(np.ptp(motion.root, axis=0).max() < STILL_M and alignment.min() > STILL_ALIGNMENT)

"""Bitrates of fingers and faces at given errors, on synthetic takes (`takes`)."""

from __future__ import annotations

import numpy as np

from bunraku.codec.extension.encoder import EncodedExtension, encode_extension
from bunraku.codec.extension.track import Extension, decode_extension_block, parse_extension_track
from bunraku.codec.timing import plan_timing
from bunraku.motion import rotation
from bunraku.motion.face import EXPRESSION_INDEX, Face, face_expressions, face_of
from bunraku.motion.hands import Hands, pose_hands
from bunraku.motion.rotation import Array
from tests.bench.takes import face_take, hands_take

FPS, SECONDS, SEEDS = 60.0, 30.0, (0, 1, 2)
FINGERTIP_ERROR_MM, FACE_ERROR = 3.0, 0.01
"""Mean error of fingertips, and root of the mean squared error of weights, as a share of their range."""
_MOTION_ERRORS_MM = (6.0, 4.0, 3.0, 2.0, 1.4, 1.0, 0.7, 0.5)
"""Mean errors of a motion whose levels the extension has."""


def measure_fingers_kbps() -> float:
    """Return the bitrate of two hands at `FINGERTIP_ERROR_MM`, description and headers of blocks included."""
    return float(np.mean([_fingers_kbps(seed) for seed in SEEDS]))


def measure_face_kbps() -> float:
    """Return the bitrate of 52 expressions at `FACE_ERROR`, description and headers of blocks included."""
    return float(np.mean([_face_kbps(seed) for seed in SEEDS]))


def _fingers_kbps(seed: int) -> float:
    hands, values = hands_take(SECONDS, FPS, seed)
    truth = _place_tips(hands, values)
    encoded = _encode(hands, values)
    decoded = parse_extension_track(encoded.describe()).extension
    assert isinstance(decoded, Hands)
    errors = [
        1e3 * float(np.linalg.norm(_place_tips(decoded, level) - truth, axis=-1).mean())
        for level in _decode_levels(encoded)
    ]
    return _bitrate_at(encoded, errors, FINGERTIP_ERROR_MM)


def _face_kbps(seed: int) -> float:
    take = face_take(SECONDS, FPS, seed)
    face, values = face_of(take)
    truth = np.stack(list(take.values()), axis=1)
    columns = [EXPRESSION_INDEX[name] for name in take]
    encoded = _encode(face, values)
    decoded = parse_extension_track(encoded.describe()).extension
    assert isinstance(decoded, Face)
    errors = [
        float(np.sqrt(np.square(face_expressions(decoded, level)[:, columns] - truth).mean()))
        for level in _decode_levels(encoded)
    ]
    return _bitrate_at(encoded, errors, FACE_ERROR)


def _encode(extension: Extension, values: Array) -> EncodedExtension:
    return encode_extension(extension, values, plan_timing(FPS, len(values)), _MOTION_ERRORS_MM)


def _decode_levels(encoded: EncodedExtension) -> list[Array]:
    """Return the values (n, E, 3) of each level, decoded by the description of the track."""
    track = parse_extension_track(encoded.describe())
    return [
        np.concatenate(
            [
                decode_extension_block(track, data).values_at(np.arange(float(track.frames_in(index))))
                for index, data in enumerate(level.blocks)
            ]
        )
        for level in encoded.ladder
    ]


def _bitrate_at(encoded: EncodedExtension, errors: list[float], error: float) -> float:
    """Return the bitrate in kbit/s at an error between those of the levels."""
    seconds = encoded.track.frames / encoded.track.fps
    described = len(encoded.track.pack_extension())
    kbps = [(described + sum(map(len, level.blocks))) * 8e-3 / seconds for level in encoded.ladder]
    if not min(errors) <= error <= max(errors):
        raise ValueError(f"no level is as far off as {error}: {errors}")
    return float(np.exp(np.interp(np.log(error), np.log(errors[::-1]), np.log(kbps[::-1]))))


def _place_tips(hands: Hands, values: Array) -> Array:
    """Return the positions (n, 10, 3) of the fingertips at wrists that stand still."""
    still = np.tile(rotation.IDENTITY, (len(values), 2, 1))
    return pose_hands(hands, np.zeros((len(values), 2, 3)), still, values).tips

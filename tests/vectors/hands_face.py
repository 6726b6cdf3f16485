"""Fingers and faces of performers: tracks, blocks, poses and expressions (`hands_face.json`)."""

from __future__ import annotations

import base64
from typing import Any

import numpy as np

from bunraku.codec.extension.encoder import encode_extension
from bunraku.codec.extension.finger_joints import pack_fingers
from bunraku.codec.extension.track import Extension, ExtensionTrack, describe_extension_track, parse_extension_track
from bunraku.codec.timing import plan_timing
from bunraku.motion import rotation
from bunraku.motion.face import EXPRESSIONS, GAZE, Face, face_expressions, face_of
from bunraku.motion.hands import CHAIN_COUNT, MAX_CHAIN_JOINTS, Hands, pose_hands
from bunraku.motion.rotation import Array
from tests.vectors.blocks import encode_header, to_base64
from tests.vectors.extension import block_vector

_COUNTS = ((3,) * CHAIN_COUNT, (2, 0, 0, 1, 3, 3, 3, 0, 0, 0))
_FRAMES = 45


def smooth_values(generator: np.random.Generator, frames: int, count: int) -> Array:
    """Return values (frames, count) that move between still poses, with amplitudes that differ between them."""
    knots = generator.normal(size=(4, count)) * generator.choice([0.0, 0.02, 0.3, 0.9], size=count)
    at = np.clip(np.linspace(0.0, 3.0, frames) % 1.0 * 2.0, 0.0, 1.0)
    before = np.minimum(np.linspace(0.0, 3.0, frames).astype(int), 2)
    share = (at * at * (3.0 - 2.0 * at))[:, None]
    values: Array = knots[before] + share * (knots[before + 1] - knots[before])
    return values


def make_hands(seed: int, counts: tuple[int, ...], frames: int = _FRAMES) -> tuple[Hands, Array]:
    """Return fingers with these numbers of joints, and values (frames, E, 3) of a motion."""
    generator = np.random.default_rng(seed)
    bases = np.zeros((CHAIN_COUNT, 3))
    lengths = np.zeros((CHAIN_COUNT, MAX_CHAIN_JOINTS))
    for chain, count in enumerate(counts):
        if count:
            bases[chain] = [0.002 * (1 - 2 * (chain // 5)), -0.085, 0.03 - 0.015 * (chain % 5)]
        lengths[chain, :count] = [0.043, 0.027, 0.022][:count]
    return Hands(counts, bases, lengths), smooth_values(generator, frames, 3 * sum(counts)).reshape(frames, -1, 3)


def make_face(seed: int, names: list[str], frames: int = _FRAMES) -> tuple[Face, Array]:
    """Return a face with these expressions, and values (frames, C, 3) of a motion."""
    values = smooth_values(np.random.default_rng(seed), frames, len(names))
    return face_of(dict(zip(names, np.where([name in GAZE for name in names], values, np.abs(values)).T, strict=True)))


def make_track(extension: Extension, values: Array, number: int) -> tuple[dict[str, Any], list[bytes]]:
    """Return the description of a track in JSON, and the blocks of its levels."""
    encoded = encode_extension(extension, values, plan_timing(30.0, len(values)), (6.0, 1.0), number)
    described = encoded.describe()
    binary = {key: to_base64(value) for key, value in described.items() if isinstance(value, bytes)}
    return described | binary, [block for level in encoded.ladder for block in level.blocks]


def load_track(description: dict[str, Any]) -> ExtensionTrack:
    """Return the track of a golden description."""
    binary = {key: base64.b64decode(description[key]) for key in ("joints", "axes") if key in description}
    return parse_extension_track(description | binary)


def hands_vector(number: int, track: ExtensionTrack, values: Array) -> dict[str, Any]:
    """Return a pose of fingers at wrists that are turned and apart."""
    assert isinstance(track.extension, Hands)
    places = np.array([[0.4, 1.1, 0.2], [-0.3, 0.9, 0.1]])
    turns = rotation.from_rotation_vector(np.array([[0.3, -0.8, 1.1], [2.0, 0.4, -0.7]]))
    pose = pose_hands(track.extension, places[None], turns[None], values[None])
    return {
        "track": number,
        "wrist_positions": places.ravel().tolist(),
        "wrist_orientations": turns.ravel().tolist(),
        "values": values.ravel().tolist(),
        "positions": pose.positions.ravel().tolist(),
        "orientations": pose.orientations.ravel().tolist(),
    }


def face_vector(number: int, track: ExtensionTrack, values: Array) -> dict[str, Any]:
    """Return the expressions of a face for values of its axes."""
    assert isinstance(track.extension, Face)
    weights = face_expressions(track.extension, values[None])[0]
    return {"track": number, "values": values.ravel().tolist(), "weights": weights.tolist()}


def make_vectors() -> dict[str, Any]:
    """Return tracks, their blocks, poses and expressions, and invalid blocks and descriptions."""
    hands = [make_hands(seed, counts) for seed, counts in enumerate(_COUNTS)]
    motions: list[tuple[Extension, Array]] = [*hands]
    motions.append(make_face(7, list(EXPRESSIONS)))
    motions.append(make_face(8, ["jawOpen", "eyeBlinkLeft", "aa", "gazeYaw"]))
    made = [make_track(*motion, number) for number, motion in enumerate(motions)]
    tracks = [load_track(description) for description, _ in made]
    nominal = tracks[0].block_frames
    fingers, face = (describe_extension_track(tracks[number], made[number][0]["rates"]) for number in (0, 2))
    changes: dict[str, dict[str, Any]] = {
        "fingers of another codec": fingers | {"codec": "bunraku.extension/1"},
        "no joint": fingers | {"joints": bytes(3)},
        "joints of an eleventh chain": fingers | {"joints": bytes([0, 0, 16]) + bytes(30)},
        "no description of joints": fingers | {"joints": bytes(2)},
        "an integer too large": fingers | {"joints": fingers["joints"][:3] + bytes([37, 200, 3, 77, 1, 250]) * 9},
        "an offset too large": fingers | {"joints": pack_fingers(hands[0][0], np.full(90, 8))},
        "too long": fingers | {"joints": fingers["joints"] + bytes(512)},
        "face without axes": face | {"axes": bytes(8)},
        "a face too long": face | {"axes": face["axes"] + bytes(256)},
        "joints in place of axes": {key: value for key, value in face.items() if key != "axes"} | {"joints": bytes(9)},
    }
    return {
        "expressions": list(EXPRESSIONS),
        "tracks": [
            description | {"names": list(track.extension.names)}
            for (description, _), track in zip(made, tracks, strict=True)
        ],
        "valid": [
            block_vector(tracks[number], number, block) for number, (_, blocks) in enumerate(made) for block in blocks
        ],
        "hands": [
            hands_vector(number, tracks[number], motions[number][1][frame]) for number in (0, 1) for frame in (0, 30)
        ],
        "faces": [
            face_vector(number, tracks[number], motions[number][1][frame]) for number in (2, 3) for frame in (0, 30)
        ],
        "invalid": [
            {"why": "no frames", "block": to_base64(encode_header([(9, 8)], 0, scene=True))},
            {
                "why": "an escape too long",
                "block": to_base64(encode_header([(9, 8), (1, nominal.bit_length())], scene=True) + bytes(30)),
            },
        ],
        "invalid_tracks": [
            {
                "why": why,
                "track": {key: to_base64(value) if isinstance(value, bytes) else value for key, value in track.items()},
            }
            for why, track in changes.items()
        ],
    }

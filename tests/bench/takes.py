"""Takes of two hands and of a face for benches. They are SYNTHETIC: no performer was recorded.

Hands change between gestures, each finger at its own time, with slow drift and the noise of a glove. The face speaks,
changes its expression, blinks and looks around, with the noise of a face tracker. Equal arguments give equal takes.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from bunraku.motion.face import EXPRESSIONS
from bunraku.motion.hands import FINGERS, SIDES, Hands
from bunraku.motion.rotation import Array
from tests.motion.hand_source import standard_hands

_FINGER_SHAPES: dict[str, tuple[float, float, float]] = {
    "straight": (0.0, 0.0, 0.0),
    "pointing": (5.0, 5.0, 3.0),
    "curled": (82.0, 98.0, 62.0),
    "relaxed": (26.0, 35.0, 18.0),
    "hooked": (10.0, 70.0, 40.0),
    "round": (45.0, 45.0, 28.0),
    "pinching": (45.0, 55.0, 25.0),
    "aside": (18.0, 25.0, 12.0),
}
"""Flexion of a finger's three joints, in degrees."""
_THUMB_SHAPES: dict[str, tuple[float, float, float, float]] = {
    "out": (0.0, 40.0, 0.0, 0.0),
    "across": (35.0, 10.0, 35.0, 40.0),
    "relaxed": (10.0, 20.0, 10.0, 10.0),
    "opposed": (25.0, 30.0, 15.0, 25.0),
    "up": (-10.0, 45.0, 0.0, -10.0),
}
"""Flexion and abduction of a thumb's first joint, and flexion of the others, in degrees."""
GESTURES: dict[str, tuple[str, str, float]] = {
    "relaxed": ("relaxed", "relaxed relaxed relaxed relaxed", 0.3),
    "open": ("out", "straight straight straight straight", 1.0),
    "fist": ("across", "curled curled curled curled", 0.0),
    "point": ("across", "pointing curled curled curled", 0.1),
    "count two": ("across", "pointing pointing curled curled", 1.2),
    "count three": ("across", "pointing pointing pointing curled", 0.9),
    "count four": ("across", "pointing pointing pointing pointing", 0.8),
    "thumb up": ("up", "curled curled curled curled", 0.0),
    "pinch": ("opposed", "pinching aside aside aside", 0.4),
    "grasp": ("opposed", "round round round round", 0.4),
    "claw": ("out", "hooked hooked hooked hooked", 0.8),
}
"""Shape of the thumb, of the four fingers, and share of the full spread."""
_SPREAD_DEG = (8.0, 0.0, -6.0, -12.0)
_DRIFT_DEG, _DRIFT_S = 2.0, 1.0
GLOVE_NOISE_DEG = 0.15
_DOF_COUNT = 20
"""Angles of one hand: those of the thumb, the flexions of the fingers, their spreads."""

FACE_NOISE = 0.004
_VISEMES: dict[str, dict[str, float]] = {
    "aa": {"jawOpen": 0.5, "mouthLowerDown": 0.25, "mouthUpperUp": 0.1},
    "ee": {"jawOpen": 0.15, "mouthStretch": 0.3, "mouthSmile": 0.2, "mouthLowerDown": 0.3},
    "oo": {"jawOpen": 0.15, "mouthFunnel": 0.4, "mouthPucker": 0.5},
    "oh": {"jawOpen": 0.35, "mouthFunnel": 0.5, "mouthPucker": 0.2},
    "mm": {"jawOpen": 0.02, "mouthClose": 0.1, "mouthPress": 0.3, "mouthRollLower": 0.3, "mouthRollUpper": 0.25},
    "ff": {"jawOpen": 0.08, "mouthRollLower": 0.4, "mouthShrugUpper": 0.2},
    "ss": {"jawOpen": 0.06, "mouthStretch": 0.2, "mouthShrugLower": 0.15},
}
_MOODS: dict[str, dict[str, float]] = {
    "neutral": {},
    "smile": {"mouthSmile": 0.6, "cheekSquint": 0.3, "eyeSquint": 0.2, "mouthDimple": 0.15},
    "frown": {"browDown": 0.6, "mouthFrown": 0.3, "noseSneer": 0.2},
    "surprise": {"browInnerUp": 0.7, "browOuterUp": 0.6, "eyeWide": 0.5},
    "sad": {"browInnerUp": 0.5, "mouthFrown": 0.4, "mouthShrugLower": 0.3},
}
"""Weights of expressions; those of both sides without "Left" and "Right"."""
_ARKIT = EXPRESSIONS[: EXPRESSIONS.index("happy")]
_SACCADE_S, _SACCADE_WEIGHT = 0.05, 0.25


def hands_take(seconds: float = 30.0, fps: float = 60.0, seed: int = 0) -> tuple[Hands, Array]:
    """Return a SYNTHETIC take of two hands: their joints, and the values (n, 30, 3) in radians."""
    count = round(seconds * fps)
    values = [_finger_rotations(_hand_angles(count, fps, 2 * seed + side), side) for side in range(len(SIDES))]
    return standard_hands(), np.concatenate(values, axis=1)


def face_take(seconds: float = 30.0, fps: float = 60.0, seed: int = 0) -> dict[str, Array]:
    """Return a SYNTHETIC take of a face: the weights (n,) of the 52 expressions of ARKit, by their names."""
    random = np.random.default_rng(seed)
    t = np.arange(round(seconds * fps)) / fps
    weights = _follow_moods(random, t) + _follow_speech(random, t)
    blinks = _blink(random, t)
    for side, closed in (("Left", 0.95), ("Right", 0.92)):
        _column(weights, f"eyeBlink{side}")[:] = closed * blinks
    yaw, pitch = _gaze(random, t).T
    for side, outwards in (("Left", yaw), ("Right", -yaw)):
        for name, weight in (("Out", outwards), ("In", -outwards), ("Up", pitch), ("Down", -pitch)):
            _column(weights, f"eyeLook{name}{side}")[:] = np.maximum(weight, 0.0)
    weights += random.normal(0.0, FACE_NOISE, weights.shape)
    return {name: np.clip(_column(weights, name), 0.0, 1.0) for name in _ARKIT}


def _ease(t: Array, start: Array | float, duration: float) -> Array:
    """Return a minimum-jerk path from 0 at `start` to 1 after `duration`."""
    x = np.clip((t - start) / duration, 0.0, 1.0)
    path: Array = x**3 * (10.0 - 15.0 * x + 6.0 * x * x)
    return path


def _gesture_angles(name: str) -> Array:
    """Return the angles (20,) of a gesture in degrees."""
    thumb, fingers, spread = GESTURES[name]
    flexions = [_FINGER_SHAPES[shape] for shape in fingers.split()]
    return np.concatenate([_THUMB_SHAPES[thumb], np.ravel(flexions), spread * np.array(_SPREAD_DEG)])


def _hand_angles(count: int, fps: float, seed: int) -> Array:
    """Return the angles (n, 20) of one hand in radians."""
    random = np.random.default_rng(seed)
    t = np.arange(count)[:, None] / fps
    fingers = np.repeat([0, 1, 2, 3, 4], [4, 3, 3, 3, 3]), np.arange(1, 5)
    finger_of_angle = np.concatenate(fingers)
    current = _gesture_angles("relaxed")
    angles = np.tile(current, (count, 1))
    names = list(GESTURES)
    at = 0.0
    while (at := at + random.gamma(2.0, 0.45)) < count / fps:
        following = _gesture_angles(names[random.integers(len(names))]) * random.uniform(0.85, 1.05, _DOF_COUNT)
        if random.random() < 0.35:
            # only some fingers move
            following = np.where((random.random(len(FINGERS)) < 0.5)[finger_of_angle], following, current)
        duration = random.uniform(0.18, 0.5)
        lags = random.uniform(0.0, 0.06, len(FINGERS))[finger_of_angle]
        angles += _ease(t, at + lags, duration) * (following - current)
        current = following
        at += duration
    angles += _DRIFT_DEG * _drift(random, count, fps) + random.normal(0.0, GLOVE_NOISE_DEG, angles.shape)
    return np.radians(angles)


def _drift(random: np.random.Generator, count: int, fps: float) -> Array:
    """Return slow noise (n, 20) of unit variance."""
    length = round(3.0 * _DRIFT_S * fps)
    kernel = np.exp(-np.arange(length) / (_DRIFT_S * fps))
    kernel /= np.linalg.norm(kernel)
    noise = random.normal(size=(count + 2 * length, _DOF_COUNT))
    columns = [np.convolve(column, kernel, "same")[length : length + count] for column in noise.T]
    return np.stack(columns, axis=1)


def _finger_rotations(angles: Array, side: int) -> Array:
    """Return rotation vectors (n, 15, 3) of one hand's joints: flexion towards the palm, spread about x."""
    inwards = -1.0 if side == 0 else 1.0
    flexion_axis = np.array([0.0, 0.0, inwards])
    thumb_axis = np.array([0.0, inwards, inwards]) * np.sqrt(0.5)
    values = np.zeros((len(angles), 15, 3))
    for joint, angle in enumerate((0, 2, 3)):
        values[:, joint] = angles[:, [angle]] * thumb_axis
    values[:, 0, 0] = -angles[:, 1]
    values[:, 3:] = angles[:, 4:16, None] * flexion_axis
    values[:, 3::3, 0] = -angles[:, 16:]
    return values


def _column(weights: Array, name: str) -> Array:
    return weights[:, _ARKIT.index(name)]


def _expression_weights(expressions: Mapping[str, float]) -> Array:
    """Return weights (52,); a name without side stands for both."""
    weights = np.zeros(len(_ARKIT))
    for name, weight in expressions.items():
        for each in [name] if name in _ARKIT else [f"{name}Left", f"{name}Right"]:
            weights[_ARKIT.index(each)] = weight
    return weights


def _follow(t: Array, events: Sequence[tuple[float, float, Array]]) -> Array:
    """Return the weights (n, 52) of a path that goes, at each time and in a duration, to weights (52,)."""
    path, current = np.zeros((len(t), len(_ARKIT))), np.zeros(len(_ARKIT))
    for at, duration, following in events:
        path += _ease(t, at, duration)[:, None] * (following - current)
        current = following
    return path


def _follow_moods(random: np.random.Generator, t: Array) -> Array:
    """Return weights of expressions that change, and differ from left to right by up to 10 %."""
    moods, at = [_expression_weights(each) for each in _MOODS.values()], 0.5
    events = []
    while at < t[-1]:
        mood = moods[random.integers(len(moods))] * random.uniform(0.6, 1.1) * random.uniform(0.9, 1.1, len(_ARKIT))
        events.append((at, random.uniform(0.3, 0.7), mood))
        at += random.gamma(2.0, 1.2) + 0.5
    return _follow(t, events)


def _follow_speech(random: np.random.Generator, t: Array) -> Array:
    """Return weights of phrases of 6 to 24 visemes, 7 to 9 a second, with pauses."""
    visemes, at = [_expression_weights(each) for each in _VISEMES.values()], 0.3
    events = []
    while at < t[-1]:
        for _ in range(random.integers(6, 25)):
            viseme = visemes[random.integers(len(visemes))]
            viseme = viseme * random.uniform(0.5, 1.1) * random.uniform(0.9, 1.1, len(_ARKIT))
            events.append((at, random.uniform(0.09, 0.15), viseme))
            at += random.uniform(1.0 / 9.0, 1.0 / 7.0)
        events.append((at, 0.2, np.zeros(len(_ARKIT))))
        at += random.gamma(2.0, 0.4)
    return _follow(t, events)


def _blink(random: np.random.Generator, t: Array) -> Array:
    """Return by how much (n,) the eyes are closed: 80 ms to close, 20 ms shut, 150 ms to open."""
    closed, at = np.zeros(len(t)), 1.0
    while at < t[-1]:
        x = np.clip(np.minimum((t - at) / 0.08, 1.0 - (t - at - 0.1) / 0.15), 0.0, 1.0)
        closed = np.maximum(closed, x * x * (3.0 - 2.0 * x))
        at += random.gamma(3.0, 1.2) + 0.3
    return closed


def _gaze(random: np.random.Generator, t: Array) -> Array:
    """Return the weights (n, 2) of looking to the left and up, by saccades."""
    gaze, current, at = np.zeros((len(t), 2)), np.zeros(2), 0.5
    while at < t[-1]:
        following = random.normal(0.0, _SACCADE_WEIGHT, 2)
        gaze += _ease(t, at, _SACCADE_S)[:, None] * (following - current)
        current = following
        at += random.gamma(2.0, 0.5) + 0.2
    return gaze

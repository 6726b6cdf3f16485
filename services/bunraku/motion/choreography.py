"""Sanbasō, First Steps: a dance of our own for the demo, in six phrases of eight beats.

Its manner is that of Sanbasō, the dance that opens a day of puppet theatre, and of Nihon-buyō: low hips, gliding steps,
stamps that mark the beat, the hops of a crow, and held poses (mie). The steps, poses and their order are ours.
"""

from __future__ import annotations

import math
from dataclasses import replace

from bunraku.motion.performer import perform
from bunraku.motion.score import Arm, Hop, Key, Place, Pose, Score, Side, Step
from bunraku.motion.skeleton import Motion, standard_figure

TITLE = "Sanbasō, First Steps"
BEATS_PER_MINUTE = 96.0
BEATS_PER_PHRASE = 8
BEATS = 48

# Arms: wrist (out, up, forward) from the shoulder in arm lengths, where the elbow points, turn of the palm, bend of the hand.
ON_THIGH = Arm((0.10, -0.90, 0.30), (1.0, -0.2, -0.8), 10, 10)
BOWING = Arm((0.02, -0.80, 0.50), (1.0, -0.1, -0.6), 0, 10)
LOW_OPEN = Arm((0.62, -0.66, 0.28), (0.3, -0.3, -1.0), 50, -10)
LEVEL = Arm((0.95, 0.02, 0.22), (0.0, -0.6, -1.0), 70, -15)
HIGH = Arm((0.48, 0.82, 0.18), (0.9, -0.1, -0.5), 20, -15)
BEFORE_CHEST = Arm((0.02, -0.22, 0.66), (0.9, -0.6, -0.2), -10, 0)
CROSSED_OVER = Arm((-0.42, -0.02, 0.74), (0.9, -0.6, -0.1), -20, 5)
CROSSED_UNDER = Arm((-0.40, -0.44, 0.52), (0.9, -0.5, -0.1), -20, 5)
UPPER_FRONT = Arm((0.22, 0.10, 0.86), (0.8, -0.8, -0.1), 10, -10)
LOWER_FRONT = Arm((0.20, -0.48, 0.66), (0.9, -0.4, -0.3), 10, -10)
RAISED_FIST = Arm((0.60, 0.44, 0.16), (0.7, -0.7, -0.3), -30, 35)
SLEEVE_SHOWN = Arm((0.90, -0.18, 0.34), (0.0, -1.0, -0.4), 20, -30)
WING_UP = Arm((0.86, 0.46, 0.10), (0.1, -0.3, -1.0), 0, -30)
WING_DOWN = Arm((0.74, -0.52, 0.06), (0.4, 0.3, -1.0), 0, 25)
FAN_ABOVE = Arm((0.30, 0.90, 0.30), (1.0, 0.1, -0.3), 30, -25)
FAN_ASIDE = Arm((0.90, 0.22, 0.30), (0.0, -0.8, -0.7), 80, -25)
AT_HIP = Arm((0.34, -0.58, 0.10), (1.0, 0.0, -0.5), 0, 30)
TRAILING = Arm((0.84, -0.42, 0.26), (0.2, -0.6, -1.0), 30, -30)

STAND = Pose(ON_THIGH, ON_THIGH, depth=0.03)
NOD_OF_GREETING = Pose(BOWING, BOWING, depth=0.035, bow=28, nod=14)
DEEP_BOW = Pose(BOWING, BOWING, depth=0.05, bow=52, nod=18)
OPENING = Pose(LOW_OPEN, LOW_OPEN, depth=0.07, bow=4, nod=-4)
GATHERED = Pose(BEFORE_CHEST, BEFORE_CHEST, depth=0.08, bow=6, nod=6)
SWEEP_LEFT = Pose(LEVEL, BEFORE_CHEST, depth=0.08, bow=4, lean=6, twist=18, look=42, tilt=-4)
SWEEP_RIGHT = SWEEP_LEFT.mirrored()
SLEEVES_WIDE = Pose(LEVEL, LEVEL, depth=0.06, bow=-3, nod=-5)
KNEE_RAISED = Pose(HIGH, AT_HIP, depth=0.05, bow=2, twist=-8, look=-20)
MIE_RIGHT = Pose(SLEEVE_SHOWN, RAISED_FIST, depth=0.20, bow=6, lean=6, twist=-14, look=-48, nod=-2, tilt=4)
MIE_ROLL = replace(MIE_RIGHT, look=-6, nod=14, tilt=14)
MIE_FRONT = replace(MIE_RIGHT, look=8, nod=-6, tilt=-5, depth=0.215)
BEFORE_CROSSING = Pose(UPPER_FRONT, LOWER_FRONT, depth=0.12, bow=8, nod=4)
CROSSED = Pose(CROSSED_OVER, CROSSED_UNDER, depth=0.10, bow=12, nod=12)
FANS = Pose(HIGH, HIGH, depth=0.05, bow=-5, nod=-12)
TURN_FAN = Pose(FAN_ASIDE, FAN_ABOVE, depth=0.07, lean=5, twist=10, look=12, tilt=4)
TURN_LOW = Pose(FAN_ABOVE, FAN_ASIDE, depth=0.08, lean=-5, twist=8, look=10, nod=6)
CROUCHED = Pose(WING_DOWN, WING_DOWN, depth=0.10, bow=12, nod=-4)
WINGS = Pose(WING_UP, WING_UP, depth=0.07, bow=6, nod=-6)
CIRCLING = Pose(SLEEVE_SHOWN, FAN_ABOVE, depth=0.08, bow=4, lean=-6, twist=-8, look=-12)
CIRCLING_WIDE = Pose(LEVEL, FAN_ASIDE, depth=0.09, bow=5, lean=-4, twist=-10, look=-10, nod=4)
LAST_KNEE = Pose(LEVEL, HIGH, depth=0.05, bow=2, twist=8, look=20)
LAST_MIE = Pose(FAN_ABOVE, TRAILING, depth=0.20, bow=5, lean=-8, twist=12, look=48, nod=-2, tilt=-4)
LAST_MIE_FRONT = replace(LAST_MIE, look=4, nod=-6, tilt=-8)

HOME_LEFT, HOME_RIGHT = Place(0.08, 0.0, 8), Place(-0.08, 0.0, -8)

KEYS = (
    # 1 greeting, and the sleeves open
    Key(2.0, NOD_OF_GREETING, 1.5, even=True),
    Key(3.75, STAND, 1.5, even=True),
    Key(5.5, OPENING, 1.75, even=True),
    Key(6.75, SLEEVES_WIDE, 1.75),
    Key(8.0, GATHERED, 1.0),
    # 2 gliding left and right, the sleeves sweep
    Key(10.75, SWEEP_LEFT, 2.5, even=True),
    Key(13.0, GATHERED, 1.25),
    Key(15.0, SWEEP_RIGHT, 2.0, even=True),
    Key(16.25, GATHERED, 1.0),
    # 3 the first mie, hands crossed and fanned out
    Key(17.5, KNEE_RAISED, 1.1),
    Key(18.15, MIE_RIGHT, 0.7),
    Key(19.0, MIE_ROLL, 0.7),
    Key(19.7, MIE_FRONT, 0.5),
    Key(21.0, BEFORE_CROSSING, 1.1),
    Key(22.0, CROSSED, 1.0),
    Key(24.0, FANS, 1.75),
    # 4 a slow turn under the fan
    Key(26.0, TURN_FAN, 2.0, even=True),
    Key(29.5, TURN_LOW, 3.0, even=True),
    Key(32.0, CROUCHED, 2.0),
    # 5 the crow's hops, and a circle round the stage
    Key(32.8, WINGS, 0.7),
    Key(33.3, CROUCHED, 0.7),
    Key(33.8, WINGS, 0.7),
    Key(34.3, CROUCHED, 0.7),
    Key(34.8, WINGS, 0.7),
    Key(35.3, CROUCHED, 0.7),
    Key(37.0, CIRCLING, 1.75),
    Key(40.0, CIRCLING_WIDE, 3.0, even=True),
    # 6 the last mie, and the bow
    Key(42.4, LAST_KNEE, 1.75),
    Key(43.15, LAST_MIE, 0.75),
    Key(44.0, LAST_MIE_FRONT, 0.5),
    Key(45.5, STAND, 1.25, even=True),
    Key(46.5, DEEP_BOW, 1.25),
    Key(47.75, STAND, 1.2, even=True),
)


def glide(beat: float, foot: Side, x: float, z: float, turn: float = 0.0) -> Step:
    """A suriashi step: the sole skims the floor for half a beat."""
    return Step(beat, foot, Place(x, z, turn))


def stamp(beat: float, foot: Side, x: float, z: float, turn: float = 0.0) -> Step:
    """A hyōshi: the foot is lifted and comes down hard on the beat."""
    return Step(beat, foot, Place(x, z, turn), swing=0.6, lift=0.10, fall=0.25, stamp=True)


def raised(beat: float, foot: Side, x: float, z: float, turn: float = 0.0) -> Step:
    """A knee raised high and held before the stamp that begins a mie."""
    return Step(beat, foot, Place(x, z, turn), swing=1.25, lift=0.26, fall=0.3, stamp=True)


def standing(x: float, z: float, turn: float, apart: float = 0.08, open_by: float = 8.0) -> dict[Side, Place]:
    """Both feet about a point (x, z) of the stage, facing `turn`, each `apart` metres from it, toes out by `open_by`."""
    out = math.radians(turn)
    sides: dict[Side, Place] = {}
    for side, sign in (("left", 1.0), ("right", -1.0)):
        across = sign * apart
        sides["left" if side == "left" else "right"] = Place(
            x + across * math.cos(out), z - across * math.sin(out), turn + sign * open_by
        )
    return sides


def turn_in_place() -> list[Step]:
    """A whole turn to the left on the spot: the left foot opens, the right follows."""
    steps = []
    # the facing to which each step brings its foot
    for beat, foot, turn in (
        (25.0, "left", 66.0),
        (26.0, "right", 88.0),
        (27.0, "left", 156.0),
        (28.0, "right", 178.0),
        (29.0, "left", 246.0),
        (30.0, "right", 268.0),
        (31.0, "left", 334.0),
        (31.5, "right", 360.0),
        (32.0, "left", 360.0),
    ):
        side: Side = "left" if foot == "left" else "right"
        steps.append(Step(beat, side, standing(0.0, 0.0, turn, 0.10 if beat < 31.5 else 0.08)[side], swing=0.5 if beat < 31.0 else 0.28))
    return steps


def circle() -> list[Step]:
    """A whole turn to the right while walking round a small circle, two quick steps to the beat; the last one closes."""
    radius = 0.2
    steps = []
    for index in range(11):
        heading = 360.0 - min(36.0 * (index + 1), 360.0)
        out = math.radians(heading)
        side: Side = "right" if index % 2 == 0 else "left"
        place = standing(radius * (math.cos(out) - 1.0), -radius * math.sin(out), heading, open_by=8 if index > 8 else 4)
        steps.append(Step(36.0 + 0.5 * index, side, place[side], swing=0.28))
    return steps


def hop(beat: float, x: float, z: float, turn: float) -> Hop:
    """A hop of the crow (karasu-tobi) that lands with both feet about (x, z)."""
    places = standing(x, z, turn)
    return Hop(beat, places["left"], places["right"])


STEPS = (
    glide(4.5, "left", 0.10, 0.10, 10),
    glide(5.5, "right", -0.08, 0.12, -10),
    stamp(7.0, "left", 0.09, 0.12, 8),
    stamp(8.0, "right", -0.08, 0.12, -8),
    glide(9.0, "left", 0.24, 0.10, 20),
    glide(10.0, "right", 0.08, 0.08, 10),
    glide(11.0, "left", 0.32, 0.08, 28),
    stamp(12.0, "right", 0.14, 0.06, 0),
    glide(13.0, "right", 0.0, 0.04, -14),
    glide(14.0, "left", 0.16, 0.02, -4),
    glide(15.0, "right", -0.10, 0.04, -24),
    stamp(16.0, "left", 0.16, 0.02, 26),
    raised(18.0, "right", -0.30, 0.06, -44),
    glide(21.0, "right", -0.08, 0.0, -8),
    stamp(23.0, "left", 0.08, 0.0, 8),
    stamp(24.0, "right", -0.08, 0.0, -8),
    *turn_in_place(),
    *circle(),
    raised(43.0, "left", 0.36, 0.06, 44),
    glide(45.5, "left", 0.08, 0.0, 8),
)
HOPS = (hop(33.0, -0.15, 0.02, 374.0), hop(34.0, 0.10, 0.04, 346.0), hop(35.0, 0.0, 0.0, 360.0))

SCORE = Score(BEATS_PER_MINUTE, BEATS, STAND, HOME_LEFT, HOME_RIGHT, KEYS, STEPS, HOPS)


def step_times() -> list[float]:
    """Seconds at which a foot lands, stamps and hops included, in order."""
    return [footfall.beat * SCORE.seconds_per_beat for footfall in SCORE.footfalls()]


def stamp_times() -> list[float]:
    """Seconds of the stamps (hyōshi), which are heard, in order."""
    return [step.beat * SCORE.seconds_per_beat for step in SCORE.steps if step.stamp]


def dance(fps: float = 60.0) -> Motion:
    """The whole dance on the standard figure, 30 s, at `fps` frames a second; its end leads on to its beginning."""
    return perform(SCORE, standard_figure(), fps)

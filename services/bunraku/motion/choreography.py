"""Sanbasō, First Steps: a dance of our own for the demo, in six phrases of eight beats.

Its manner is that of Sanbasō, the dance that opens a day of puppet theatre, and of Nihon-buyō: low hips, gliding steps,
stamps that mark the beat, the hops of a crow, and held poses (mie). The steps, poses and their order are ours.
"""

from __future__ import annotations

import math

from bunraku.motion import poses
from bunraku.motion.performer import perform
from bunraku.motion.score import Hop, Key, Place, Score, Side, Step
from bunraku.motion.skeleton import Motion, standard_figure

TITLE = "Sanbasō, First Steps"
BEATS_PER_MINUTE = 96.0
BEATS_PER_PHRASE = 8
BEATS = 48

QUICK = 0.26
"""Beats in the air of a step that takes half a beat."""
HOME_LEFT, HOME_RIGHT = Place(0.08, 0.0, 8), Place(-0.08, 0.0, -8)

KEYS = (
    # 1 greeting, and the sleeves open
    Key(2.0, poses.NOD_OF_GREETING, 1.5, even=True),
    Key(3.75, poses.STAND, 1.5, even=True),
    Key(5.5, poses.OPENING, 1.75, even=True),
    Key(6.75, poses.SLEEVES_WIDE, 1.75),
    Key(8.0, poses.GATHERED, 1.0),
    # 2 gliding left and right, the sleeves sweep
    Key(10.75, poses.SWEEP_LEFT, 2.5, even=True),
    Key(12.1, poses.SWEEP_LEFT_NOD, 0.6),
    Key(13.0, poses.GATHERED, 1.25),
    Key(15.0, poses.SWEEP_RIGHT, 2.0, even=True),
    Key(16.25, poses.GATHERED, 1.0),
    # 3 the first mie, hands crossed and fanned out
    Key(17.5, poses.KNEE_RAISED, 1.1),
    Key(18.15, poses.MIE_RIGHT, 0.85),
    Key(19.0, poses.MIE_ROLL, 0.7),
    Key(19.7, poses.MIE_FRONT, 0.5),
    Key(21.0, poses.BEFORE_CROSSING, 1.1),
    Key(22.0, poses.CROSSED, 1.0),
    Key(24.0, poses.FANS, 1.75),
    # 4 a slow turn under the fan
    Key(26.0, poses.TURN_FAN, 2.0, even=True),
    Key(29.5, poses.TURN_LOW, 3.0, even=True),
    Key(32.0, poses.CROUCHED, 2.0),
    # 5 the crow's hops, and a circle round the stage
    Key(32.8, poses.WINGS, 0.7),
    Key(33.3, poses.CROUCHED, 0.7),
    Key(33.8, poses.WINGS, 0.7),
    Key(34.3, poses.CROUCHED, 0.7),
    Key(34.8, poses.WINGS, 0.7),
    Key(35.3, poses.CROUCHED, 0.7),
    Key(37.0, poses.CIRCLING, 1.75),
    Key(40.0, poses.CIRCLING_WIDE, 3.0, even=True),
    # 6 the last mie, and the bow
    Key(42.4, poses.LAST_KNEE, 1.75),
    Key(43.15, poses.LAST_MIE, 0.75),
    Key(44.0, poses.LAST_MIE_FRONT, 0.5),
    Key(45.5, poses.STAND, 1.25, even=True),
    Key(46.5, poses.DEEP_BOW, 1.25),
    Key(47.75, poses.STAND, 1.2, even=True),
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
    """Both feet about a point (x, z), facing `turn`, each `apart` metres from it, its toes out by `open_by` degrees."""
    across, down = apart * math.cos(math.radians(turn)), apart * math.sin(math.radians(turn))
    return {"left": Place(x + across, z - down, turn + open_by), "right": Place(x - across, z + down, turn - open_by)}


def turn_in_place() -> list[Step]:
    """A whole turn to the left on the spot: the left foot opens, the right follows; slow, and quick at the end."""
    facings: tuple[tuple[float, Side, float], ...] = (
        (25.0, "left", 66.0),
        (26.0, "right", 88.0),
        (27.0, "left", 156.0),
        (28.0, "right", 178.0),
        (29.0, "left", 246.0),
        (30.0, "right", 268.0),
    )
    steps = [Step(beat, foot, standing(0.0, 0.0, turn, apart=0.10)[foot]) for beat, foot, turn in facings]
    home = standing(0.0, 0.0, 360.0)
    return [
        *steps,
        Step(31.0, "left", standing(0.0, 0.0, 334.0, apart=0.10)["left"], swing=QUICK),
        Step(31.5, "right", home["right"], swing=QUICK),
        Step(32.0, "left", home["left"], swing=QUICK),
    ]


def circle() -> list[Step]:
    """A whole turn to the right, walking round a small circle in two quick steps to the beat; the last one closes."""
    radius = 0.2
    steps = []
    for index in range(11):
        heading = 360.0 - min(36.0 * (index + 1), 360.0)
        out = math.radians(heading)
        side: Side = "right" if index % 2 == 0 else "left"
        x, z = radius * (math.cos(out) - 1.0), -radius * math.sin(out)
        # narrow and straight while it turns, open again at home
        place = standing(x, z, heading) if index > 8 else standing(x, z, heading, apart=0.066, open_by=4.0)
        steps.append(Step(36.0 + 0.5 * index, side, place[side], swing=QUICK))
    return steps


def hop(beat: float, x: float, z: float, turn: float) -> Hop:
    """A hop of the crow (karasu-tobi) that lands with both feet about (x, z), facing `turn`."""
    feet = standing(x, z, turn)
    return Hop(beat, feet["left"], feet["right"])


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
    glide(15.0, "right", -0.07, 0.04, -24),
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

SCORE = Score(BEATS_PER_MINUTE, BEATS, poses.STAND, HOME_LEFT, HOME_RIGHT, KEYS, STEPS, HOPS)


def step_times() -> list[float]:
    """Seconds at which a foot lands, stamps and hops included, in order."""
    return [footfall.beat * SCORE.seconds_per_beat for footfall in SCORE.footfalls()]


def stamp_times() -> list[float]:
    """Seconds of the stamps (hyōshi), which are heard, in order."""
    return [step.beat * SCORE.seconds_per_beat for step in SCORE.steps if step.stamp]


def dance(fps: float = 60.0) -> Motion:
    """The whole dance on the standard figure, 30 s, at `fps` frames a second; its end leads on to its beginning."""
    return perform(SCORE, standard_figure(), fps)

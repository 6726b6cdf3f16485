"""Sanbasō, First Steps: original choreography of the demo, six phrases of eight beats.

Its manner is that of Sanbasō, the dance that opens a day of puppet theatre, and of Nihon-buyō: low hips, gliding steps,
stamps that mark the beat, the hops of a crow, and held poses (mie). The steps, poses and their order are original.
"""

from __future__ import annotations

import math

from bunraku.demo import poses
from bunraku.demo.animation import animate
from bunraku.demo.score import FootPlacement, Hop, PoseKey, Score, Side, Step
from bunraku.motion.skeleton import Motion, standard_figure

TITLE = "Sanbasō, First Steps"
BEATS_PER_MINUTE = 96.0
BEATS_PER_PHRASE = 8
BEAT_COUNT = 48

QUICK_SWING_BEATS = 0.26
"""Swing duration of a step that takes half a beat."""
LEFT_FOOT_START, RIGHT_FOOT_START = FootPlacement(0.08, 0.0, 8), FootPlacement(-0.08, 0.0, -8)

KEYS = (
    # 1 greeting, and the sleeves open
    PoseKey(2.0, poses.NOD_OF_GREETING, 1.5, is_smooth=True),
    PoseKey(3.75, poses.STAND, 1.5, is_smooth=True),
    PoseKey(5.5, poses.OPENING, 1.75, is_smooth=True),
    PoseKey(6.75, poses.SLEEVES_WIDE, 1.75),
    PoseKey(8.0, poses.GATHERED, 1.0),
    # 2 gliding left and right, the sleeves sweep
    PoseKey(10.75, poses.SWEEP_LEFT, 2.5, is_smooth=True),
    PoseKey(12.1, poses.SWEEP_LEFT_NOD, 0.6),
    PoseKey(13.0, poses.GATHERED, 1.25),
    PoseKey(15.0, poses.SWEEP_RIGHT, 2.0, is_smooth=True),
    PoseKey(16.25, poses.GATHERED, 1.0),
    # 3 the first mie, hands crossed and fanned out
    PoseKey(17.5, poses.KNEE_RAISED, 1.1),
    PoseKey(18.15, poses.MIE_RIGHT, 0.85),
    PoseKey(19.0, poses.MIE_ROLL, 0.7),
    PoseKey(19.7, poses.MIE_FRONT, 0.5),
    PoseKey(21.0, poses.BEFORE_CROSSING, 1.1),
    PoseKey(22.0, poses.CROSSED, 1.0),
    PoseKey(24.0, poses.FANS, 1.75),
    # 4 a slow turn under the fan
    PoseKey(26.0, poses.TURN_FAN, 2.0, is_smooth=True),
    PoseKey(29.5, poses.TURN_LOW, 3.0, is_smooth=True),
    PoseKey(32.0, poses.CROUCHED, 2.0),
    # 5 the crow's hops, and a circle round the stage
    PoseKey(32.8, poses.WINGS, 0.7),
    PoseKey(33.3, poses.CROUCHED, 0.7),
    PoseKey(33.8, poses.WINGS, 0.7),
    PoseKey(34.3, poses.CROUCHED, 0.7),
    PoseKey(34.8, poses.WINGS, 0.7),
    PoseKey(35.3, poses.CROUCHED, 0.7),
    PoseKey(37.0, poses.CIRCLING, 1.75),
    PoseKey(40.0, poses.CIRCLING_WIDE, 3.0, is_smooth=True),
    # 6 the last mie, and the bow
    PoseKey(42.4, poses.LAST_KNEE, 1.75),
    PoseKey(43.15, poses.LAST_MIE, 0.75),
    PoseKey(44.0, poses.LAST_MIE_FRONT, 0.5),
    PoseKey(45.5, poses.STAND, 1.25, is_smooth=True),
    PoseKey(46.5, poses.DEEP_BOW, 1.25),
    PoseKey(47.75, poses.STAND, 1.2, is_smooth=True),
)


def glide_step(beat: float, foot: Side, x: float, z: float, turn: float = 0.0) -> Step:
    """Return a suriashi step: the sole skims the floor for half a beat."""
    return Step(beat, foot, FootPlacement(x, z, turn))


def stamp_step(beat: float, foot: Side, x: float, z: float, turn: float = 0.0) -> Step:
    """Return a hyōshi: the foot is lifted and stamps on the beat."""
    return Step(beat, foot, FootPlacement(x, z, turn), swing_beats=0.6, lift=0.10, fall_beats=0.25, is_stamp=True)


def raised_knee_stamp(beat: float, foot: Side, x: float, z: float, turn: float = 0.0) -> Step:
    """Return a stamp with the knee raised high and held before it, which starts a mie."""
    return Step(beat, foot, FootPlacement(x, z, turn), swing_beats=1.25, lift=0.26, fall_beats=0.3, is_stamp=True)


def feet_around(
    x: float, z: float, turn: float, half_width: float = 0.08, toe_out_deg: float = 8.0
) -> dict[Side, FootPlacement]:
    """Return both feet around (x, z), facing `turn`, each `half_width` metres from it, toes out by `toe_out_deg`."""
    across, down = half_width * math.cos(math.radians(turn)), half_width * math.sin(math.radians(turn))
    return {
        "left": FootPlacement(x + across, z - down, turn + toe_out_deg),
        "right": FootPlacement(x - across, z + down, turn - toe_out_deg),
    }


def turning_steps() -> list[Step]:
    """Return the steps of a full turn to the left on the spot, slow at first and quick at the end."""
    facings: tuple[tuple[float, Side, float], ...] = (
        (25.0, "left", 66.0),
        (26.0, "right", 88.0),
        (27.0, "left", 156.0),
        (28.0, "right", 178.0),
        (29.0, "left", 246.0),
        (30.0, "right", 268.0),
    )
    steps = [Step(beat, foot, feet_around(0.0, 0.0, turn, half_width=0.10)[foot]) for beat, foot, turn in facings]
    home = feet_around(0.0, 0.0, 360.0)
    return [
        *steps,
        Step(31.0, "left", feet_around(0.0, 0.0, 334.0, half_width=0.10)["left"], swing_beats=QUICK_SWING_BEATS),
        Step(31.5, "right", home["right"], swing_beats=QUICK_SWING_BEATS),
        Step(32.0, "left", home["left"], swing_beats=QUICK_SWING_BEATS),
    ]


def circling_steps() -> list[Step]:
    """Return the steps of a full turn to the right around a small circle, two per beat; the last one closes."""
    radius = 0.2
    steps = []
    for index in range(11):
        heading = 360.0 - min(36.0 * (index + 1), 360.0)
        out = math.radians(heading)
        side: Side = "right" if index % 2 == 0 else "left"
        x, z = radius * (math.cos(out) - 1.0), -radius * math.sin(out)
        # narrow and straight during the turn, open again at the end
        place = (
            feet_around(x, z, heading) if index > 8 else feet_around(x, z, heading, half_width=0.066, toe_out_deg=4.0)
        )
        steps.append(Step(36.0 + 0.5 * index, side, place[side], swing_beats=QUICK_SWING_BEATS))
    return steps


def crow_hop(beat: float, x: float, z: float, turn: float) -> Hop:
    """Return a crow's hop (karasu-tobi) that lands with both feet around (x, z), facing `turn`."""
    feet = feet_around(x, z, turn)
    return Hop(beat, feet["left"], feet["right"])


STEPS = (
    glide_step(4.5, "left", 0.10, 0.10, 10),
    glide_step(5.5, "right", -0.08, 0.12, -10),
    stamp_step(7.0, "left", 0.09, 0.12, 8),
    stamp_step(8.0, "right", -0.08, 0.12, -8),
    glide_step(9.0, "left", 0.24, 0.10, 20),
    glide_step(10.0, "right", 0.08, 0.08, 10),
    glide_step(11.0, "left", 0.32, 0.08, 28),
    stamp_step(12.0, "right", 0.14, 0.06, 0),
    glide_step(13.0, "right", 0.0, 0.04, -14),
    glide_step(14.0, "left", 0.16, 0.02, -4),
    glide_step(15.0, "right", -0.07, 0.04, -24),
    stamp_step(16.0, "left", 0.16, 0.02, 26),
    raised_knee_stamp(18.0, "right", -0.30, 0.06, -44),
    glide_step(21.0, "right", -0.08, 0.0, -8),
    stamp_step(23.0, "left", 0.08, 0.0, 8),
    stamp_step(24.0, "right", -0.08, 0.0, -8),
    *turning_steps(),
    *circling_steps(),
    raised_knee_stamp(43.0, "left", 0.36, 0.06, 44),
    glide_step(45.5, "left", 0.08, 0.0, 8),
)
HOPS = (crow_hop(33.0, -0.15, 0.02, 374.0), crow_hop(34.0, 0.10, 0.04, 346.0), crow_hop(35.0, 0.0, 0.0, 360.0))

SCORE = Score(BEATS_PER_MINUTE, BEAT_COUNT, poses.STAND, LEFT_FOOT_START, RIGHT_FOOT_START, KEYS, STEPS, HOPS)


def footfall_times() -> list[float]:
    """Return the times in seconds at which a foot lands, stamps and hops included, ascending."""
    return [footfall.beat * SCORE.seconds_per_beat for footfall in SCORE.list_footfalls()]


def stamp_times() -> list[float]:
    """Return the times in seconds of the audible stamps (hyōshi), ascending."""
    return [step.beat * SCORE.seconds_per_beat for step in SCORE.steps if step.is_stamp]


def animate_dance(fps: float = 60.0) -> Motion:
    """Return the motion on the standard figure, 30 s, at `fps` frames per second; its end leads to its start."""
    return animate(SCORE, standard_figure(), fps)

"""OSC messages with the lights and limbs of a stage.

| address | arguments |
|---|---|
| `/bunraku/time` | float: seconds since the first frame |
| `/bunraku/light/N/position` | three floats |
| `/bunraku/light/N/colour` | three floats: linear red, green, blue |
| `/bunraku/light/N/intensity` | float |
| `/bunraku/performer/K/LIMB/position` | three floats: the tip of the hand, or of the toes |

N and K count from 0; LIMB is `left_hand`, `right_hand`, `left_leg` or `right_leg`. Positions are metres in the stage's
frame: right-handed, y up, z towards the audience, x to the left of a performer who faces the audience.
"""

from __future__ import annotations

from pythonosc.osc_message import OscMessage

from bunraku.motion.rotation import Array
from bunraku.motion.skeleton import JOINT_COUNT, JOINT_INDEX, TIP_JOINTS, Figure, joint_and_tip_positions
from bunraku.output.osc import make_message
from bunraku.wire.limbs import LIMBS

_LIMB_JOINTS = dict(zip(LIMBS, ("l_wrist", "r_wrist", "l_midtarsal", "r_midtarsal"), strict=True))
_LIMB_POINTS = {limb: JOINT_COUNT + TIP_JOINTS.index(JOINT_INDEX[joint]) for limb, joint in _LIMB_JOINTS.items()}


def make_time(seconds: float) -> OscMessage:
    """Return the message with the time of a frame."""
    return make_message("/bunraku/time", float(seconds))


def make_light(number: int, values: Array) -> list[OscMessage]:
    """Return the messages of a light with the values (7,) of a scene track: position, colour, intensity."""
    numbers = values.tolist()
    address = f"/bunraku/light/{number}"
    return [
        make_message(f"{address}/position", *numbers[:3]),
        make_message(f"{address}/colour", *numbers[3:6]),
        make_message(f"{address}/intensity", numbers[6]),
    ]


def make_limbs(performer: int, figure: Figure, root: Array, rotations: Array) -> list[OscMessage]:
    """Return the messages of a performer's limbs for a pose: root (3,) in metres and joint rotations (18, 4)."""
    points = joint_and_tip_positions(figure, root, rotations)
    return [
        make_message(f"/bunraku/performer/{performer}/{limb}/position", *points[point].tolist())
        for limb, point in _LIMB_POINTS.items()
    ]

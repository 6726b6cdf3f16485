from __future__ import annotations

import numpy as np

from bunraku.motion import rotation
from bunraku.motion.skeleton import JOINT_INDEX, standard_figure
from bunraku.output.osc import pack_bundle
from bunraku.output.stage_messages import make_light, make_limbs, make_time
from tests.output.bone_angles import tip_positions
from tests.output.vmc_receiver import parse_packet


def test_light_has_position_colour_and_intensity() -> None:
    values = np.array([1.0, 2.0, 3.0, 0.25, 0.5, 0.75, 4.0])
    assert parse_packet(pack_bundle([make_time(1.5), *make_light(2, values)])) == [
        ("/bunraku/time", [1.5]),
        ("/bunraku/light/2/position", [1.0, 2.0, 3.0]),
        ("/bunraku/light/2/colour", [0.25, 0.5, 0.75]),
        ("/bunraku/light/2/intensity", [4.0]),
    ]


def test_limbs_are_the_tips_of_hands_and_toes() -> None:
    figure = standard_figure()
    rotations = np.tile(rotation.IDENTITY, (18, 1))
    rotations[JOINT_INDEX["l_shoulder"]] = rotation.from_coordinate_axis(2, np.array(np.pi / 2))
    messages = parse_packet(pack_bundle(make_limbs(1, figure, figure.offsets[0], rotations)))
    received = {address: [float(number) for number in numbers] for address, numbers in messages}
    tips = tip_positions(figure, figure.offsets[0], rotations)
    limbs = {"left_hand": "l_wrist", "right_hand": "r_wrist", "left_leg": "l_midtarsal", "right_leg": "r_midtarsal"}
    assert list(received) == [f"/bunraku/performer/1/{limb}/position" for limb in limbs]
    for limb, joint in limbs.items():
        np.testing.assert_allclose(received[f"/bunraku/performer/1/{limb}/position"], tips[joint], atol=1e-6)
    # the raised left arm points to the left of the figure, its x
    assert received["/bunraku/performer/1/left_hand/position"][0] > 0.8

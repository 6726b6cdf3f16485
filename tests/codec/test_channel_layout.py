from __future__ import annotations

import numpy as np
import pytest

from bunraku.codec.channel_layout import MOTION_LAYOUT, NONE, SCENE_LAYOUT, ChannelLayout, create_layout
from bunraku.motion.skeleton import JOINTS


@pytest.mark.parametrize("layout", [MOTION_LAYOUT, SCENE_LAYOUT])
def test_relatives_are_earlier_channels(layout: ChannelLayout) -> None:
    assert (np.arange(len(layout.axes)) > layout.relatives).all()


def test_mirrors_of_a_motion_are_on_the_left() -> None:
    channel = {name: index + 1 for index, name in enumerate(JOINTS)}
    parent, mirror, grandparent = MOTION_LAYOUT.relatives
    assert parent[channel["l_knee"]] == channel["l_hip"]
    assert mirror[channel["r_elbow"]] == channel["l_elbow"]
    assert mirror[channel["vl5"]] == channel["r_midtarsal"]
    assert grandparent[channel["l_wrist"]] == channel["l_shoulder"]


def test_layout_has_grandparents_and_three_axes() -> None:
    layout = create_layout([11, 12, 13], [NONE, 0, 1], [NONE, NONE, 1])
    assert layout.relatives[2].tolist() == [NONE, NONE, 0]
    assert layout.axes.tolist() == [3, 3, 3]
    assert not layout.heading

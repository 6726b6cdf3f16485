"""Layouts of blocks: which channels a block has, and how the context model relates them (proto/codec.md, 2.10)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from bunraku.codec.prior import IntArray
from bunraku.motion.skeleton import CHANNEL_COUNT, JOINTS, PARENTS

PARENT, MIRROR, GRANDPARENT = range(3)
"""Rows of `relatives`."""
NONE = -1
"""Relative of a channel that has none."""


class ChannelLayout(NamedTuple):
    """Channels of a block, in the order in which they are coded.

    `prior_channels` (C,) are the channels whose biases the prior applies, `relatives` (3, C) each channel's parent,
    mirror and grandparent among the earlier channels, or NONE, and `axes` (C,) how many axes are coded. `scale_offsets`
    (C, 3) are added to the predicted scales, log2 in 1/256. The block of a layout with a `heading` has one in its
    header, and may have only the root's two channels.
    """

    prior_channels: IntArray
    relatives: IntArray
    axes: IntArray
    scale_offsets: IntArray
    heading: bool = False


def create_layout(
    prior_channels: Sequence[int],
    parents: Sequence[int],
    mirrors: Sequence[int],
    axes: Sequence[int] | None = None,
    heading: bool = False,
    scale_offsets: IntArray | None = None,
) -> ChannelLayout:
    """Return the layout of channels with these parents and mirrors; by default, of three axes without offsets."""
    grandparents = [parents[parent] if parent >= 0 else NONE for parent in parents]
    return ChannelLayout(
        np.array(prior_channels, dtype=np.int64),
        np.array([parents, mirrors, grandparents], dtype=np.int64),
        np.array(axes or [3] * len(parents), dtype=np.int64),
        np.zeros((len(parents), 3), dtype=np.int64) if scale_offsets is None else scale_offsets,
        heading,
    )


# a joint of the right side mirrors one of the left, any other the joint before it
_MIRRORS = [JOINTS.index("l" + name[1:]) + 1 if name.startswith("r_") else k for k, name in enumerate(JOINTS)]

MOTION_LAYOUT = create_layout(
    range(CHANNEL_COUNT), [NONE, 0, *(p + 1 for p in PARENTS[1:])], [NONE, NONE, *_MIRRORS[1:]], heading=True
)
"""The 19 channels of a performer."""
SCENE_LAYOUT = create_layout(range(3), [NONE, 0, 1], [NONE, NONE, 1], axes=(3, 3, 1))
"""The seven values of a camera or light, in three channels."""

"""Job that draws the small picture of a motion."""

from __future__ import annotations

from collections.abc import Sequence

from bunraku.codec import motion_decoder
from bunraku.codec.container import PerformerTracks
from bunraku.codec.motion_decoder import decode_motion_block
from bunraku.motion.brush_drawing import draw_poses
from bunraku.motion.skeleton import joint_and_tip_positions
from bunraku.wire.messages import Data

motion_decoder.warm_up()


def draw_thumbnail(blocks: Sequence[tuple[PerformerTracks, bytes, float]]) -> bytes:
    """Return the picture, in SVG, of performers at an instant within one Data message of each, seen from their front.

    The front is that of the first performer on the stage.
    """
    poses = []
    for performer, packet, within in blocks:
        root, rotations = decode_motion_block(performer.track, Data.unpack(packet).block).pose_at(within)
        placed = performer.placement.apply(root[0], rotations[0])
        poses.append(joint_and_tip_positions(performer.track.figure, *placed))
    first = blocks[0][0]
    return draw_poses(poses, first.front + first.placement.turn).encode()

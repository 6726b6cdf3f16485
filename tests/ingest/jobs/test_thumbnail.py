from __future__ import annotations

import re

from bunraku.codec.container import PerformerTracks
from bunraku.ingest.jobs.thumbnail import draw_thumbnail
from bunraku.ingest.thumbnail import middle_blocks
from bunraku.motion.placement import Placement
from tests.ingest.jobs.motions import MOTIONS


def test_placement_and_front_of_the_first_performer_decide_the_view() -> None:
    (block,) = middle_blocks(MOTIONS["one"])
    performer, packet, within = block
    picture = draw_thumbnail([block])
    turned = PerformerTracks(performer.track, [], performer.front, Placement(0.0, 0.0, 1.3))
    # the viewer turns with the figure
    numbers = [re.findall(rb"-?\d+\.?\d*", each) for each in (picture, draw_thumbnail([(turned, packet, within)]))]
    assert len(numbers[0]) == len(numbers[1])
    differences = [abs(float(one) - float(other)) for one, other in zip(*numbers, strict=True)]
    assert max(differences) < 3

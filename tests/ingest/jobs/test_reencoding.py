from __future__ import annotations

from bunraku.codec.container import StoredMotion, add_performers, pack_motion, stored_ladders, unpack_motion
from bunraku.codec.motion_encoder import EncodedMotion, encode_motion
from bunraku.codec.scene_encoder import encode_scene
from bunraku.ingest.jobs.encoding import encode_foot_contacts
from bunraku.ingest.jobs.reencoding import reencode_motion
from bunraku.motion.placement import Placement
from tests.motion.synthetic_motion import stepping_motion
from tests.vectors.blocks import random_motion
from tests.vectors.scene import sample_camera


def encode(seed: int) -> EncodedMotion:
    return encode_motion(random_motion(2.0, 30.0, seed), grade="live", first_seconds=0.5)


def two_performers() -> StoredMotion:
    """Return a motion of two performers, with a camera and contacts, as an encoder without refinement stores it."""
    stepping = stepping_motion()
    encoded = encode_motion(stepping, grade="live")
    contacts = encode_foot_contacts([stepping], [encoded])
    assert contacts
    one = unpack_motion("one", pack_motion("one", encoded, [encode_scene(sample_camera(2.0, 30.0))], (), contacts))
    other = unpack_motion("other", pack_motion("other", encode(4)))
    return unpack_motion("both", add_performers("both", one, [other], [Placement(-1.0), Placement(1.0, 0.5)])[0])


def test_both_performers_get_smaller_and_all_else_stays() -> None:
    stored, progress = two_performers(), list[float]()
    result = reencode_motion(stored, progress.append)
    after = unpack_motion(stored.id, result.packed)
    assert after.total_bytes < stored.total_bytes
    assert [type(track) for track in after.tracks] == [type(track) for track in stored.tracks]
    assert after.packets[2:] == stored.packets[2:]
    assert [performer.placement for performer in after.performers] == [one.placement for one in stored.performers]
    for number in range(2):
        assert after.packets[number][-1] == stored.packets[number][-1]
        assert after.bitrates_kbps[number] < stored.bitrates_kbps[number]
    assert result.description["ladders"] == [[level.describe() for level in one] for one in stored_ladders(after)]
    assert progress == sorted(progress)
    assert progress[-1] == 1.0

import numpy as np
import pytest

from bunraku.codec import motion_decoder
from bunraku.codec.container import StoredMotion, unpack_motion
from bunraku.codec.motion_decoder import decode_motion_block
from bunraku.motion.placement import Placement
from bunraku.motion.skeleton import standard_figure
from bunraku.session.live.cast import EMPTY_CAST, Cast, CastMember, pack_cast_motion, pack_rest_motion
from bunraku.wire.messages import Data
from tests.session.joined_stage import stored_motion

AIKO = CastMember("s-1", "Aiko", 60.0, None, "aiko")
YUKI = CastMember("s-2", "Yuki", 30.0, (2.0, 1.0, 0.5))


def rest_motion(member: CastMember) -> StoredMotion:
    return unpack_motion(member.rest_motion, pack_rest_motion(member.rest_motion, standard_figure()))


def test_figure_of_a_rest_motion_stands_still() -> None:
    motion_decoder.warm_up()
    (performer,) = rest_motion(AIKO).performers
    roots, rotations = decode_motion_block(performer.track, Data.unpack(performer.packets[0][0]).block).pose_at(
        np.array([0.0, 3.0])
    )
    assert roots == pytest.approx(np.tile([0.0, standard_figure().offsets[0, 1], 0.0], (2, 1)), abs=2e-3)
    assert np.abs(rotations[..., 0]).min() > 0.9999


def test_members_follow_the_performers_of_the_base_on_free_places() -> None:
    base = stored_motion("base", 3)
    cast = Cast("base", (AIKO, YUKI))
    packed = pack_cast_motion(cast, base, [rest_motion(AIKO), rest_motion(YUKI)])
    performers = unpack_motion(cast.motion, packed).performers
    assert [one.placement for one in performers] == [Placement(), Placement(1.6), Placement(2.0, 1.0, 0.5)]
    alone = Cast("", (AIKO,))
    (performer,) = unpack_motion(alone.motion, pack_cast_motion(alone, None, [rest_motion(AIKO)])).performers
    assert performer.placement == Placement()


def test_too_many_performers_are_refused() -> None:
    members = tuple(CastMember(f"s-{k}", "", 60.0, None) for k in range(5))
    with pytest.raises(ValueError, match="at most 4 performers"):
        pack_cast_motion(Cast("", members), None, [rest_motion(member) for member in members])


def test_cast_survives_its_record_and_names_its_motion() -> None:
    cast = Cast("base", (AIKO, YUKI))
    assert Cast.from_values(cast.to_values()) == cast
    later = [*cast.to_values(), "more"]
    later[1] = [[*member, "more"] for member in later[1]]
    assert Cast.from_values(later) == cast
    assert Cast("base").motion == "base"
    assert EMPTY_CAST.motion == ""
    motions = {cast.motion, cast.without("s-1").motion, cast.without("s-2").motion, Cast("other", cast.members).motion}
    assert len(motions) == 4
    assert cast.find("s-2") == YUKI
    assert cast.without("s-2").find("s-2") is None
    assert Cast("base", (CastMember("s-2", "Other name", 60.0, YUKI.place), AIKO)).motion != cast.motion

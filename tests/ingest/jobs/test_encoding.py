from dataclasses import replace

import numpy as np
import pytest

from bunraku.codec.extension.contact import decode_contact_block
from bunraku.ingest.jobs import encoding
from bunraku.ingest.jobs.encoding import describe_encoding, encode_foot_contacts, encode_motions
from bunraku.motion.contact.foot_contact import detect_contacts
from tests.motion.synthetic_motion import smooth_motion, stepping_motion
from tests.vectors.blocks import random_motion


def test_progress_is_the_share_of_all_motions() -> None:
    shares: list[float] = []
    motions = [random_motion(1.2, 30.0, seed) for seed in (1, 2)]
    encoded = list(encode_motions(motions, shares.append))
    assert shares == sorted(shares)
    assert max(shares) == pytest.approx(1.0)
    assert [describe_encoding(*pair)["frames"] for pair in zip(motions, encoded, strict=True)] == [36, 36]


def test_long_motions_are_encoded_in_one_pass(monkeypatch: pytest.MonkeyPatch) -> None:
    motion = random_motion(1.2, 30.0, 1)
    (best,) = encode_motions([motion], lambda _: None)
    monkeypatch.setattr(encoding, "MAX_BEST_GRADE_FRAMES", 35)
    (live,) = encode_motions([motion], lambda _: None)
    assert describe_encoding(motion, live)["rates"][-1]["kbps"] > describe_encoding(motion, best)["rates"][-1]["kbps"]


def test_performers_with_planted_feet_have_contacts() -> None:
    stepping = stepping_motion(60)
    flying = replace(smooth_motion(60), root=np.linspace(0.0, 9.0, 60)[:, None] * [1.0, 1.0, 0.0])
    motions = [flying, stepping]
    (contacts,) = encode_foot_contacts(motions, list(encode_motions(motions, lambda _: None)))
    assert (contacts.track.performer, contacts.track.frames) == (1, 60)
    blocks = [
        decode_contact_block(block, contacts.track.frames_in(index)).planted
        for index, block in enumerate(contacts.ladder[0].blocks)
    ]
    np.testing.assert_array_equal(np.concatenate(blocks), detect_contacts(stepping))

from __future__ import annotations

import json

import numpy as np
import pytest

from bunraku.codec.errors import DamagedBlock
from bunraku.codec.extension.contact import decode_contact_block, pack_contact_block
from bunraku.playout.block_store import ContactBlockStore
from tests.vectors import contacts
from tests.vectors.test_golden import committed

OURS = committed("contacts.json")
TRACKS = [contacts.load_track(track) for track in OURS["tracks"]]


def test_golden_blocks_decode_as_recorded_and_encode_to_the_same_bytes() -> None:
    for vector in OURS["valid"]:
        data, planted = contacts.unpack(vector), np.array([vector["left"], vector["right"]], dtype=bool).T
        decoded = decode_contact_block(data, TRACKS[vector["track"]].frames_in(vector["index"]))
        np.testing.assert_array_equal(decoded.planted, planted)
        assert pack_contact_block(planted) == data


def test_golden_positions_have_the_recorded_contacts() -> None:
    stores = [ContactBlockStore(track) for track in TRACKS]
    for vector in OURS["valid"]:
        stores[vector["track"]].put_encoded(vector["index"], 0, contacts.unpack(vector))
    for vector in OURS["positions"]:
        found = stores[vector["track"]].contacts_at(vector["position"])
        assert found is not None
        assert found.astype(int).tolist() == vector["planted"]


def test_invalid_blocks_and_tracks_are_refused() -> None:
    for invalid in OURS["invalid"]:
        with pytest.raises(DamagedBlock):
            decode_contact_block(contacts.unpack(invalid), TRACKS[0].frames_in(invalid["index"]))
    for invalid in OURS["invalid_tracks"]:
        with pytest.raises(DamagedBlock):
            contacts.load_track(invalid["track"])


def test_vectors_are_made_by_their_generator() -> None:
    assert json.loads(json.dumps(contacts.make_vectors())) == OURS

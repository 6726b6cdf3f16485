from __future__ import annotations

import asyncio

import msgpack
import pytest

from bunraku.marionette.crowd.pulls import PULL_LIFETIME_US
from bunraku.marionette.crowd.summary import CrowdSummary
from bunraku.stream.crowd_relay import CrowdRelay
from bunraku.wire.messages import CrowdTurn, Presence, Pull
from tests.time_limit import HANG_TIMEOUT_S

OPEN = Presence(0, [], [None] * 4, crowd=[{"limb": 1, "policy": "median", "pulls": 0}])


class Owner:
    """Owner of a session, to which one relay publishes."""

    def __init__(self) -> None:
        self.now = 0
        self.received: list[tuple[int, CrowdSummary]] = []
        self._more = asyncio.Event()
        self.relay: CrowdRelay[str | int] = CrowdRelay("r", lambda: self.now, self._receive)
        self.relay.set_presence(OPEN)

    async def find_turn(self) -> bytes:
        """Return the message by which the owner gives the turn to the member that the next summary proposes."""
        turn = (await self.wait_for_summary()).turn
        assert turn is not None
        packed: bytes = msgpack.packb([1, -turn.negative_turn, turn.rank])
        return packed

    def _receive(self, message: bytes) -> None:
        replica, limb, sent_us, packed = msgpack.unpackb(message)
        assert (replica, sent_us) == ("r", self.now)
        self.received.append((limb, CrowdSummary.unpack(packed)))
        self._more.set()

    async def wait_for_summary(self) -> CrowdSummary:
        async with asyncio.timeout(HANG_TIMEOUT_S):
            self._more.clear()
            await self._more.wait()
        return self.received[-1][1]


async def test_pulls_are_summarised_until_nobody_pulls() -> None:
    owner = Owner()
    for member in range(5):
        owner.relay.pull(member, Pull(1, [0.1 * member, 0.0, 0.0]))
    assert (await owner.wait_for_summary()).count == 5
    owner.relay.leave(3)
    assert (await owner.wait_for_summary()).count == 4
    owner.now += PULL_LIFETIME_US + 1
    assert (await owner.wait_for_summary()).count == 0
    assert owner.relay._timer is None
    owner.relay.close()


async def test_limb_that_is_not_open_cannot_be_pulled() -> None:
    owner = Owner()
    owner.relay.pull("a", Pull(0, [0.1, 0.0, 0.0]))
    assert owner.relay._timer is None
    owner.relay.pull("a", Pull(1, [0.1, 0.0, 0.0]))
    owner.relay.set_presence(Presence(0, [], [None] * 4))
    owner.relay._publish_summaries()
    assert owner.received == []
    owner.relay.close()


@pytest.mark.parametrize("place", [[1e300, -1e300, 0.0], [0.0, 0.0, 0.0], [-0.0, 1e-300, 1.0]])
async def test_any_finite_place_can_be_summarised(place: list[float]) -> None:
    owner = Owner()
    owner.relay.pull("a", Pull(1, place))
    assert (await owner.wait_for_summary()).count == 1
    owner.relay.close()


async def test_members_learn_when_their_turn_begins_and_ends() -> None:
    owner = Owner()
    owner.relay.pull("ada", Pull(1, [0.1, 0.0, 0.0]))
    ada = await owner.find_turn()
    assert owner.relay.receive_turn(ada) == [("ada", CrowdTurn(1, True))]
    assert owner.relay.receive_turn(ada) == []
    owner.now += PULL_LIFETIME_US + 1
    owner.relay.pull("bo", Pull(1, [0.2, 0.0, 0.0]))
    bo = await owner.find_turn()
    assert owner.relay.receive_turn(bo) == [("ada", CrowdTurn(1, False)), ("bo", CrowdTurn(1, True))]
    assert owner.relay.receive_turn(msgpack.packb([1, 0, None])) == [("bo", CrowdTurn(1, False))]
    assert owner.relay.receive_turn(msgpack.packb([1, 7, 12_345])) == []
    owner.relay.receive_turn(bo)
    owner.relay.leave("bo")
    assert owner.relay.receive_turn(msgpack.packb([1, 0, None])) == []
    owner.relay.close()

"""Limbs of a stage that are open to the crowd: the crowd claims, moves and releases them as a puppeteer does.

Stream replicas publish summaries of their viewers' pulls (`bunraku.stream.crowd_relay`). The crowd holds an open limb
while anybody pulls it, under the id `CROWD`; its merged target is an input of the limb, so that ownership, hand-over,
log and recordings are those of any holder. A limb that a puppeteer holds is not taken from them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import msgpack

from bunraku.marionette.crowd.crowd_limb import CrowdLimb
from bunraku.marionette.crowd.policy import CrowdPolicy, to_target
from bunraku.marionette.crowd.summary import UNITS, CrowdSummary
from bunraku.marionette.limb_target import InputKind
from bunraku.marionette.ownership import LimbGrant, LimbInput, Ownership
from bunraku.wire.limbs import MAX_LIMBS
from bunraku.wire.messages import CrowdPulls

CROWD = "crowd"
"""Holder's id of a limb that the crowd moves; ids of puppeteers are random and of another form."""
PULLS_INTERVAL_US = 200_000
"""Interval between two CrowdPulls messages of a limb."""
COUNT_INTERVAL_US = 1_000_000
"""Interval between two changes of the number of pulls in the presence."""


class CrowdControl:
    """Open limbs of one stage, by number. Times are clock time in µs."""

    def __init__(self, ownership: Ownership, publish: Callable[[str, bytes], None]) -> None:
        """`publish` sends a message on `pulls` or `turn`, subjects of the session (proto/bus.md)."""
        self._ownership = ownership
        self._publish = publish
        self._limbs: dict[int, CrowdLimb] = {}
        self._grants: dict[int, tuple[int, int]] = {}
        self._counts: dict[int, int] = {}
        self._counted_at = 0
        self._shown_at: dict[int, int] = {}
        self._turns: dict[int, tuple[int, int]] = {}

    @property
    def policies(self) -> dict[int, str]:
        """Policy of each open limb, by number."""
        return {limb: crowd.policy.value for limb, crowd in sorted(self._limbs.items())}

    def presence(self) -> list[dict[str, Any]]:
        """Return the open limbs of the performers on the stage, as in a Presence message."""
        return [
            {"limb": limb, "policy": policy, "pulls": self._counts.get(limb, 0)}
            for limb, policy in self.policies.items()
            if limb < len(self._ownership)
        ]

    def set_policies(self, policies: Mapping[int, str], now: int) -> bool:
        """Open these limbs and close all others; return whether that changes any. Raises ValueError for a policy."""
        if dict(policies) == self.policies:
            return False
        wanted = {limb: CrowdPolicy(policy) for limb, policy in policies.items() if 0 <= limb < MAX_LIMBS}
        for limb in tuple(self._limbs):
            if limb not in wanted:
                self._release(limb, now)
                self._set_turn(limb, None)
                del self._limbs[limb]
                self._counts.pop(limb, None)
                if self._shown_at.pop(limb, None) is not None:
                    self._publish("pulls", CrowdPulls(limb, 0, []).pack())
        for limb, policy in wanted.items():
            if limb not in self._limbs or self._limbs[limb].policy is not policy:
                self._set_turn(limb, None)
                self._limbs[limb] = CrowdLimb(limb, policy)
                self._counts.setdefault(limb, 0)
        return True

    def receive(self, message: bytes, now: int) -> bool:
        """Keep the summary of a stream replica; return whether the limb is free and somebody pulls it.

        Raises `MalformedMessage` for a malformed summary.
        """
        replica, limb, sent_us, packed = msgpack.unpackb(message)[:4]
        crowd = self._limbs.get(limb)
        if crowd is None or limb >= len(self._ownership):
            return False
        summary = CrowdSummary.unpack(packed)
        return (
            crowd.receive(replica, sent_us, summary, now)
            and summary.count > 0
            and self._ownership.holders()[limb] is None
        )

    def apply(self, now: int) -> bool:
        """Claim, move and release the open limbs; return whether the presence has changed."""
        if not self._limbs:
            return False
        has_changes, holders = False, self._ownership.holders()
        counts = dict.fromkeys(self._limbs, 0)
        for limb, crowd in self._limbs.items():
            if limb >= len(holders):
                continue
            merged = crowd.merge(now)
            counts[limb] = merged.count
            target = crowd.target(merged, now)
            if target is None:
                has_changes |= self._release(limb, now)
            elif holders[limb] in (None, CROWD):
                has_changes |= self._claim(limb, now)
                epoch, sequence = self._grants[limb]
                self._grants[limb] = epoch, sequence + 1
                self._ownership.apply_input(CROWD, LimbInput(limb, InputKind.TARGET, epoch, sequence, now, target), now)
            self._set_turn(limb, crowd.turn(merged))
            self._show(limb, merged, now)
        is_urgent = any(bool(count) != bool(self._counts.get(limb)) for limb, count in counts.items())
        if counts != self._counts and (is_urgent or now - self._counted_at >= COUNT_INTERVAL_US):
            self._counts, self._counted_at, has_changes = counts, now, True
        return has_changes

    def _claim(self, limb: int, now: int) -> bool:
        if self._ownership.holders()[limb] == CROWD:
            return False
        grant = self._ownership.claim(limb, CROWD, now)
        assert isinstance(grant, LimbGrant)
        self._grants[limb] = grant.epoch, 0
        return True

    def _release(self, limb: int, now: int) -> bool:
        epoch, _ = self._grants.pop(limb, (0, 0))
        return self._ownership.release(limb, CROWD, epoch, now)

    def _set_turn(self, limb: int, turn: tuple[int, int] | None) -> None:
        """Publish number and rank of a turn that begins; None ends the present one."""
        if turn == self._turns.get(limb):
            return
        if turn is None:
            del self._turns[limb]
        else:
            self._turns[limb] = turn
        self._publish("turn", msgpack.packb([limb, *(turn or (0, None))]))

    def _show(self, limb: int, merged: CrowdSummary, now: int) -> None:
        """Send a sample of the pulls at most every `PULLS_INTERVAL_US`, and an empty one after the last."""
        shown_at = self._shown_at.get(limb)
        if (merged.count == 0 and shown_at is None) or now - (shown_at or 0) < PULLS_INTERVAL_US:
            return
        if merged.count:
            self._shown_at[limb] = now
        else:
            del self._shown_at[limb]
        places = [list(to_target(limb, (x / UNITS, y / UNITS, z / UNITS))) for _, (x, y, z) in merged.sample]
        self._publish("pulls", CrowdPulls(limb, merged.count, places, self._limbs[limb].votes(merged)).pack())

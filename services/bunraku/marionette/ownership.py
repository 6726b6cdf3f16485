"""Who holds which limb: claims, asks, epochs, inputs, and what happens when a puppeteer falls silent.

A limb has at most one holder. Every grant has a new epoch, and inputs of another epoch move nothing, so that what a
former holder sent late is harmless. A held limb can be asked for; nothing is taken by force, but who asked first gets
it when it becomes free. Times are clock time in µs and come in as arguments.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import Enum
from typing import Literal

from bunraku.marionette.limb_rig import ALL_LIMBS, Limb
from bunraku.marionette.limb_target import InputKind, LateInput, LimbTarget
from bunraku.marionette.vector import Vector

INPUT_TIMEOUT_US = 500_000
"""Without a word from its holder for this many µs a limb returns to the dance."""
ASK_LIFETIME_US = 20_000_000
"""An ask is forgotten after this many µs."""


@dataclass(frozen=True, slots=True)
class LimbGrant:
    """`limb` is the claimant's; its inputs must carry `epoch`."""

    limb: int
    epoch: int


@dataclass(frozen=True, slots=True)
class LimbRefusal:
    """`limb` is not the puppeteer's: `holder` has it (`held`), there is no such limb (`unknown`), or it was the
    puppeteer's and went back to the dance for want of a word (`lost`)."""

    limb: int
    holder: str | None
    reason: Literal["held", "lost", "unknown"]


@dataclass(frozen=True, slots=True)
class LimbInput:
    """One sample of a controller, as message 70 of the contract.

    `values` of a hand: arm lengths on the axes of vl5 from the shoulder, or as velocity -1..1 of full speed; of a leg
    the first is the thigh's angle in radians, or -1..1 of full speed. `sampled` is in µs, on the sender's clock.
    """

    limb: int
    kind: int
    epoch: int
    sequence: int
    sampled_us: int
    values: Vector


class InputOutcome(Enum):
    """What became of an input."""

    ACCEPTED = "taken"
    """It counts."""
    CLAMPED = "reach"
    """It counts, brought within reach."""
    NOT_OWNER = "owner"
    """It moves nothing: the limb is another's, or nobody's."""
    LATE = "late"
    """It moves nothing: of an epoch before, a duplicate, or too late."""


@dataclass(slots=True)
class _LimbState:
    holder: str | None = None
    epoch: int = 0
    target: LimbTarget | None = None
    asks: dict[str, int] = field(default_factory=dict)

    def release(self, now: int) -> None:
        self.holder = None
        if self.target is not None:
            self.target.stop(now)


class Ownership:
    """The four limbs of one puppet and their holders."""

    def __init__(self, epochs: Sequence[int] = (0, 0, 0, 0)) -> None:
        # by the limb's number: they are asked for at the stage's rate
        self._limbs = [_LimbState(epoch=epoch) for epoch in epochs]

    def holders(self) -> tuple[str | None, ...]:
        """The holder's id of each limb, or None."""
        return tuple([hold.holder for hold in self._limbs])

    def asks(self) -> tuple[tuple[str, ...], ...]:
        """Of each limb the ids of those who ask for it, first come first."""
        return tuple(tuple(hold.asks) for hold in self._limbs)

    @property
    def is_at_rest(self) -> bool:
        """Whether nobody holds a limb, and all are the dance's again."""
        return all(hold.target is None for hold in self._limbs)

    def epoch(self, limb: Limb) -> int:
        """The epoch of the limb's last grant; 0 before the first."""
        return self._limbs[limb].epoch

    def target(self, limb: Limb) -> LimbTarget | None:
        """What the holder asks of the limb; after a release the last that was asked; None before the first grant."""
        return self._limbs[limb].target

    def claim(self, limb: int, puppeteer: str, now: int) -> LimbGrant | LimbRefusal:
        """Grants a free limb, or again the claimant's own with a new epoch."""
        if not 0 <= limb < len(self._limbs):
            return LimbRefusal(limb, None, "unknown")
        hold = self._limbs[limb]
        if hold.holder not in (None, puppeteer):
            return LimbRefusal(limb, hold.holder, "held")
        hold.asks.pop(puppeteer, None)
        hold.holder = puppeteer
        hold.epoch += 1
        hold.target = LimbTarget(Limb(limb).is_hand, now)
        return LimbGrant(Limb(limb), hold.epoch)

    def ask(self, limb: int, puppeteer: str, wanted: bool, now: int) -> bool:
        """Asks for a limb that another holds, or no longer; whether the asks have changed."""
        if not 0 <= limb < len(self._limbs):
            return False
        hold = self._limbs[limb]
        if not wanted:
            return hold.asks.pop(puppeteer, None) is not None
        if hold.holder in (None, puppeteer):
            return False
        new = puppeteer not in hold.asks
        hold.asks[puppeteer] = now + ASK_LIFETIME_US
        return new

    def grant_free_limbs(self, now: int) -> tuple[list[tuple[str, LimbGrant]], bool]:
        """Grants free limbs to those who asked first: whose and what, and whether any asks have changed. Asks that are
        too old are forgotten."""
        grants: list[tuple[str, LimbGrant]] = []
        changed = False
        for limb, hold in zip(ALL_LIMBS, self._limbs, strict=True):
            for old in [who for who, until in hold.asks.items() if until <= now]:
                del hold.asks[old]
                changed = True
            if hold.holder is None and hold.asks:
                first = next(iter(hold.asks))
                grant = self.claim(limb, first, now)
                assert isinstance(grant, LimbGrant)
                grants.append((first, grant))
        return grants, changed or bool(grants)

    def release(self, limb: int, puppeteer: str, epoch: int, now: int) -> bool:
        """Frees a limb; False, and nothing changes, if it is not this puppeteer's at this epoch."""
        hold = self._held_by(limb, puppeteer)
        if hold is None or hold.epoch != epoch:
            return False
        hold.release(now)
        return True

    def leave(self, puppeteer: str, now: int) -> tuple[Limb, ...]:
        """Frees all that a puppeteer holds and forgets what it asked for; says which limbs became free."""
        freed = tuple(Limb(limb) for limb, hold in enumerate(self._limbs) if hold.holder == puppeteer)
        for limb in freed:
            self._limbs[limb].release(now)
        for hold in self._limbs:
            hold.asks.pop(puppeteer, None)
        return freed

    def keep_alive(self, puppeteer: str, limbs: list[int], now: int) -> None:
        """The puppeteer still holds `limbs`, without a new input; those it does not hold are passed over."""
        for limb in limbs:
            hold = self._held_by(limb, puppeteer)
            if hold is not None and hold.target is not None:
                hold.target.keep_alive(now)

    def apply_input(self, puppeteer: str, limb_input: LimbInput, now: int) -> InputOutcome:
        """Takes an input, or says why not. Raises `ValueError` for numbers that are not finite or an unknown kind."""
        kind = InputKind(limb_input.kind)
        hold = self._held_by(limb_input.limb, puppeteer)
        if hold is None or hold.target is None:
            return InputOutcome.NOT_OWNER
        if hold.epoch != limb_input.epoch:
            return InputOutcome.LATE
        try:
            within = hold.target.add_input(kind, limb_input.values, limb_input.sequence, limb_input.sampled_us, now)
        except LateInput:
            return InputOutcome.LATE
        return InputOutcome.ACCEPTED if within else InputOutcome.CLAMPED

    def expire(self, now: int) -> list[tuple[Limb, str]]:
        """Frees the limbs whose holders have been silent for `LOST_AFTER`; says which, and whose they were."""
        lost: list[tuple[Limb, str]] = []
        for limb, hold in zip(ALL_LIMBS, self._limbs, strict=True):
            if hold.holder is not None and hold.target and now - hold.target.last_heard_us >= INPUT_TIMEOUT_US:
                lost.append((limb, hold.holder))
                hold.release(now)
        return lost

    def clear_target(self, limb: Limb) -> None:
        """The limb is wholly the dance's again: the next to hold it starts from there."""
        hold = self._limbs[limb]
        if hold.holder is None:
            hold.target = None

    def _held_by(self, limb: int, puppeteer: str) -> _LimbState | None:
        if not 0 <= limb < len(self._limbs):
            return None
        hold = self._limbs[limb]
        return hold if hold.holder == puppeteer else None

"""Ownership of limbs: claims, requests, epochs, inputs and timeouts.

A limb has at most one holder. Every grant has a new epoch, and inputs of another epoch are ignored, so that late inputs
of an earlier holder have no effect. A puppeteer may ask for a held limb. No limb is taken by force; the first who asked
gets it when it becomes free. Times are clock time in µs and come in as arguments.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from enum import Enum
from typing import Literal

from bunraku.marionette.limb_rig import ALL_LIMBS, Limb
from bunraku.marionette.limb_target import InputKind, LateInput, LimbTarget
from bunraku.marionette.solver.vector import Vector
from bunraku.wire.limbs import MAX_LIMBS

INPUT_TIMEOUT_US = 500_000
"""Silence of its holder after which a limb returns to the motion."""
ASK_LIFETIME_US = 20_000_000
LIMBS_PER_PERFORMER = len(ALL_LIMBS)
INITIAL_EPOCHS = (0,) * MAX_LIMBS
"""Epochs of a stage on which no limb was ever granted."""


@dataclass(frozen=True, slots=True)
class LimbGrant:
    """Grant of a limb; inputs for it must carry `epoch`."""

    limb: int
    epoch: int


@dataclass(frozen=True, slots=True)
class LimbRefusal:
    """Refusal of a limb.

    Reasons: `held` by `holder`; `unknown`, there is no such limb; `lost`, the puppeteer held it and was silent for too
    long.
    """

    limb: int
    holder: str | None
    reason: Literal["held", "lost", "unknown"]


@dataclass(frozen=True, slots=True)
class LimbInput:
    """One sample of a controller, as message 70 of the contract.

    For a hand, `values` are arm lengths on the axes of vl5 from the shoulder, or velocities as -1..1 of full speed. For
    a leg, the first value is the thigh angle in radians, or -1..1 of full speed. `sampled_us` is on the sender's clock.
    """

    limb: int
    kind: int
    epoch: int
    sequence: int
    sampled_us: int
    values: Vector


LimbPair = tuple[int, int]
"""Two bonded hands, the lower number first."""
BondEndReason = Literal["released", "lost", "apart"]
"""Why a bond ended: a hand was released, its holder was lost, or the shoulders are too far apart."""
BondRefusal = Literal["unknown", "leg", "owner", "held", "bonded"]
"""Why two limbs are not bonded: there is no such limb, one is a leg, the puppeteer holds neither, another puppeteer
holds one, or one is in another bond."""


@dataclass(frozen=True, slots=True)
class EndedBond:
    """Bond that has ended, and the puppeteers who held its hands until then."""

    limbs: LimbPair
    holders: frozenset[str]


class InputOutcome(Enum):
    """Result of an input; the values are the labels of the metric and of notices."""

    ACCEPTED = "taken"
    """Applied."""
    CLAMPED = "reach"
    """Applied, with the target moved into reach."""
    NOT_OWNER = "owner"
    """Ignored: another puppeteer holds the limb, or none does."""
    LATE = "late"
    """Ignored: of an earlier epoch, a duplicate, or too late."""


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
    """Limbs of a stage and their holders: the only interface for actions of puppeteers.

    Limb l of performer k has the number 4 k + l.
    """

    def __init__(self, limb_count: int = LIMBS_PER_PERFORMER, epochs: Sequence[int] = INITIAL_EPOCHS) -> None:
        """`epochs` are those of the last grants, by limb."""
        # of all limbs that a stage can have, so that a limb that is removed and added again never repeats an epoch
        self._epochs = [*epochs, *INITIAL_EPOCHS[len(epochs) :]]
        self._limbs: list[_LimbState] = []
        self._bonds: list[LimbPair] = []
        self._ended_bonds: list[tuple[EndedBond, BondEndReason]] = []
        self.wake_count = 0
        """Number of claims while all limbs were at rest."""
        self.set_limb_count(limb_count)

    def __len__(self) -> int:
        return len(self._limbs)

    def set_limb_count(self, count: int) -> list[tuple[int, str]]:
        """Add free limbs or remove the last ones; return the removed limbs that were held, and their holders."""
        self._epochs = list(self.epochs)
        removed = [
            (limb, state.holder) for limb, state in enumerate(self._limbs) if limb >= count and state.holder is not None
        ]
        for limb in range(count, len(self._limbs)):
            self._end_bond_of(limb, "lost")
        current = len(self._limbs)
        self._limbs = [*self._limbs[:count], *(_LimbState(epoch=epoch) for epoch in self._epochs[current:count])]
        return removed

    def holders(self) -> tuple[str | None, ...]:
        """Return the holder's id of each limb, or None."""
        return tuple([state.holder for state in self._limbs])

    def asks(self) -> tuple[tuple[str, ...], ...]:
        """Return for each limb the ids of the puppeteers who ask for it, in order."""
        return tuple(tuple(state.asks) for state in self._limbs)

    @property
    def epochs(self) -> tuple[int, ...]:
        """Epoch of the last grant of every limb that a stage can have; 0 before the first."""
        return (*(state.epoch for state in self._limbs), *self._epochs[len(self._limbs) :])

    @property
    def is_at_rest(self) -> bool:
        """True if no limb is held and all are back in the motion."""
        return all(state.target is None for state in self._limbs)

    def target(self, limb: int) -> LimbTarget | None:
        """Return the limb's target: the holder's, after a release the last one, None before the first grant."""
        return self._limbs[limb].target

    def claim(self, limb: int, puppeteer: str, now: int) -> LimbGrant | LimbRefusal:
        """Grant a limb that is free, or the claimant's own again with a new epoch."""
        if not self._has_limb(limb):
            return LimbRefusal(limb, None, "unknown")
        if self.is_at_rest:
            self.wake_count += 1
        return self._grant(limb, puppeteer, now)

    def release(self, limb: int, puppeteer: str, epoch: int, now: int) -> bool:
        """Free a limb; return False, without effect, if the puppeteer does not hold it at this epoch."""
        state = self._held_by(limb, puppeteer)
        if state is None or state.epoch != epoch:
            return False
        self._end_bond_of(limb, "released")
        state.release(now)
        return True

    def leave(self, puppeteer: str, now: int) -> tuple[int, ...]:
        """Free all limbs of a puppeteer, drop the puppeteer's requests, and return the freed limbs."""
        freed = tuple(limb for limb, state in enumerate(self._limbs) if state.holder == puppeteer)
        for limb in freed:
            self._end_bond_of(limb, "lost")
            self._limbs[limb].release(now)
        for state in self._limbs:
            state.asks.pop(puppeteer, None)
        return freed

    @property
    def bonds(self) -> tuple[LimbPair, ...]:
        """Bonded pairs, in the order in which they were bonded."""
        return tuple(self._bonds)

    def bond(self, first: int, second: int, puppeteer: str, now: int) -> BondRefusal | None:
        """Bond two hands, of which the puppeteer holds one; the other is the puppeteer's own or free.

        Returns the reason of a refusal. A hand that is free stays free: it is led, and can be claimed.
        """
        pair = _ordered(first, second)
        if first == second or not (self._has_limb(first) and self._has_limb(second)):
            return "unknown"
        if not all(Limb(limb % LIMBS_PER_PERFORMER).is_hand for limb in pair):
            return "leg"
        holders = {self._limbs[limb].holder for limb in pair}
        if puppeteer not in holders:
            return "owner"
        if holders - {puppeteer, None}:
            return "held"
        if pair in self._bonds:
            return None
        if any(limb in bond for limb in pair for bond in self._bonds):
            return "bonded"
        for limb in pair:
            # a hand that is led differs from the motion until it is back
            self._limbs[limb].target = self._limbs[limb].target or LimbTarget(is_hand=True, now=now)
        self._bonds.append(pair)
        return None

    def unbond(self, first: int, second: int, puppeteer: str) -> bool:
        """End a bond; return False, without effect, if there is none or the puppeteer holds neither hand."""
        pair = _ordered(first, second)
        if pair not in self._bonds or puppeteer not in {self._limbs[limb].holder for limb in pair}:
            return False
        self.end_bond(pair, "released")
        return True

    def end_bond(self, pair: LimbPair, reason: BondEndReason) -> None:
        """End a bond; `take_ended_bonds` returns it with the reason."""
        self._bonds.remove(pair)
        holders = (self._limbs[limb].holder for limb in pair)
        self._ended_bonds.append((EndedBond(pair, frozenset(filter(None, holders))), reason))

    def take_ended_bonds(self) -> list[tuple[EndedBond, BondEndReason]]:
        """Return the bonds that have ended since the last call, with the reasons."""
        ended, self._ended_bonds = self._ended_bonds, []
        return ended

    def is_bonded(self, limb: int) -> bool:
        """Return whether a limb is in a bond."""
        return any(limb in pair for pair in self._bonds)

    def keep_alive(self, puppeteer: str, limbs: Iterable[int], now: int) -> None:
        """Record that the puppeteer still holds `limbs` without a new input; limbs of others are ignored."""
        for limb in {limb for limb in limbs if self._has_limb(limb)}:
            state = self._held_by(limb, puppeteer)
            if state is not None and state.target is not None:
                state.target.keep_alive(now)

    def ask(self, limb: int, puppeteer: str, wanted: bool, now: int) -> bool:
        """Ask for a limb that another puppeteer holds, or no longer; return whether the requests have changed."""
        if not self._has_limb(limb):
            return False
        state = self._limbs[limb]
        if not wanted:
            return state.asks.pop(puppeteer, None) is not None
        if state.holder in (None, puppeteer):
            return False
        is_new = puppeteer not in state.asks
        state.asks[puppeteer] = now + ASK_LIFETIME_US
        return is_new

    def apply_input(self, puppeteer: str, limb_input: LimbInput, now: int) -> InputOutcome:
        """Apply an input and return its outcome.

        Raises ValueError for an input that no controller sends: an unknown kind, or values that are not finite.
        """
        if not self._has_limb(limb_input.limb):
            return InputOutcome.NOT_OWNER
        kind = InputKind(limb_input.kind)
        state = self._held_by(limb_input.limb, puppeteer)
        if state is None or state.target is None:
            return InputOutcome.NOT_OWNER
        if state.epoch != limb_input.epoch:
            return InputOutcome.LATE
        try:
            is_within_reach = state.target.add_input(
                kind, limb_input.values, limb_input.sequence, limb_input.sampled_us, now
            )
        except LateInput:
            return InputOutcome.LATE
        return InputOutcome.ACCEPTED if is_within_reach else InputOutcome.CLAMPED

    def grant_free_limbs(self, now: int) -> tuple[list[tuple[str, LimbGrant]], bool]:
        """Grant free limbs to the first who asked, and drop requests that are too old.

        Returns the grants with their puppeteers, and whether any requests have changed.
        """
        grants: list[tuple[str, LimbGrant]] = []
        changed = False
        for limb, state in enumerate(self._limbs):
            for expired in [puppeteer for puppeteer, until in state.asks.items() if until <= now]:
                del state.asks[expired]
                changed = True
            if state.holder is None and state.asks:
                first = next(iter(state.asks))
                grant = self._grant(limb, first, now)
                assert isinstance(grant, LimbGrant)
                grants.append((first, grant))
        return grants, changed or bool(grants)

    def expire(self, now: int) -> list[tuple[int, str]]:
        """Free the limbs whose holders were silent for `INPUT_TIMEOUT_US`; return them with their holders."""
        lost: list[tuple[int, str]] = []
        for limb, state in enumerate(self._limbs):
            if state.holder is not None and state.target and now - state.target.last_heard_us >= INPUT_TIMEOUT_US:
                lost.append((limb, state.holder))
                self._end_bond_of(limb, "lost")
                state.release(now)
        return lost

    def clear_target(self, limb: int) -> None:
        """Forget the target of a free limb that is back in the motion."""
        state = self._limbs[limb]
        if state.holder is None:
            state.target = None

    def _grant(self, limb: int, puppeteer: str, now: int) -> LimbGrant | LimbRefusal:
        state = self._limbs[limb]
        if state.holder not in (None, puppeteer):
            return LimbRefusal(limb, state.holder, "held")
        state.asks.pop(puppeteer, None)
        state.holder = puppeteer
        state.epoch += 1
        state.target = LimbTarget(Limb(limb % LIMBS_PER_PERFORMER).is_hand, now)
        return LimbGrant(limb, state.epoch)

    def _end_bond_of(self, limb: int, reason: BondEndReason) -> None:
        for pair in self.bonds:
            if limb in pair:
                self.end_bond(pair, reason)

    def _has_limb(self, limb: int) -> bool:
        return 0 <= limb < len(self._limbs)

    def _held_by(self, limb: int, puppeteer: str) -> _LimbState | None:
        if not self._has_limb(limb):
            return None
        state = self._limbs[limb]
        return state if state.holder == puppeteer else None


def _ordered(first: int, second: int) -> LimbPair:
    return (first, second) if first < second else (second, first)

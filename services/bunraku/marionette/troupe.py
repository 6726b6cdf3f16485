"""The puppets of one stage: limb l of performer k is 4 k + l, and each puppet is as if it were alone (paper 5).

What is done to a limb is done to its puppet; `now` is as of `marionette.merge.Marionette`.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

from bunraku.marionette.limbs import LIMBS, Joints
from bunraku.marionette.merge import Marionette
from bunraku.marionette.ownership import Grant, Input, Outcome, Refusal
from bunraku.motion.rotation import Array
from bunraku.motion.skeleton import Figure
from bunraku.wire.limbs import MOST_LIMBS, MOST_PERFORMERS

EACH = len(LIMBS)
NEW = (0,) * MOST_LIMBS
"""The epochs of a stage on which nothing was ever held."""

Laid = dict[int, Joints]
"""What lies over the dances: of each pulled limb the local rotations of its joints."""


class Troupe:
    """One to four puppets."""

    def __init__(self, figures: Sequence[Figure], epochs: Sequence[int] = NEW) -> None:
        """As `set_figures`; `epochs` are those of a troupe at rest, to go on from."""
        self._epochs = list(epochs)
        self._puppets: list[Marionette] = []
        self.set_figures(figures)

    def set_figures(self, figures: Sequence[Figure]) -> list[tuple[int, str]]:
        """Others on the stage: limbs of a puppet that was there stay in the hands they are in. Says which limbs went
        with puppets that are there no more, and whose they were.

        Takes its time as `Marionette.set_figure`. Raises `ProportionsError` for a figure whose arms are too short to
        hang, ValueError for none or more than four of them, and changes nothing.
        """
        if not 1 <= len(figures) <= MOST_PERFORMERS:
            raise ValueError(f"a stage has 1 to {MOST_PERFORMERS} performers, not {len(figures)}")
        here = len(self._puppets)
        # all that may be refused is refused before anything is changed
        made = [Marionette(figure, self._epochs[EACH * nth : EACH * (nth + 1)]) for nth, figure in enumerate(figures)]
        for puppet, figure in zip(self._puppets, figures, strict=False):
            puppet.set_figure(figure)
        gone = [
            (limb, holder)
            for limb, holder in enumerate(self.holders())
            if holder is not None and limb >= EACH * len(figures)
        ]
        self._epochs = list(self.epochs)
        self._puppets = [*self._puppets[: len(figures)], *made[here:]]
        return gone

    def __len__(self) -> int:
        """How many limbs there are."""
        return EACH * len(self._puppets)

    def begin_anew(self) -> None:
        """As `Marionette.begin_anew`, of all."""
        for puppet in self._puppets:
            puppet.begin_anew()

    def holders(self) -> tuple[str | None, ...]:
        """The holder's id of each limb, or None."""
        return tuple(holder for puppet in self._puppets for holder in puppet.holders())

    def asks(self) -> tuple[tuple[str, ...], ...]:
        """Of each limb the ids of those who ask for it, first come first."""
        return tuple(limb for puppet in self._puppets for limb in puppet.asks())

    def claim(self, limb: int, puppeteer: str, now: int) -> Grant | Refusal:
        """As `Marionette.claim`."""
        if not 0 <= limb < len(self):
            return Refusal(limb, None, "unknown")
        return replace(self._puppets[limb // EACH].claim(limb % EACH, puppeteer, now), limb=limb)

    def release(self, limb: int, puppeteer: str, epoch: int, now: int) -> bool:
        """As `Marionette.release`."""
        return 0 <= limb < len(self) and self._puppets[limb // EACH].release(limb % EACH, puppeteer, epoch, now)

    def leave(self, puppeteer: str, now: int) -> tuple[int, ...]:
        """As `Marionette.leave`."""
        return tuple(
            EACH * nth + limb for nth, puppet in enumerate(self._puppets) for limb in puppet.leave(puppeteer, now)
        )

    def alive(self, puppeteer: str, limbs: Iterable[int], now: int) -> None:
        """As `Marionette.alive`."""
        for limb in limbs:
            if 0 <= limb < len(self):
                self._puppets[limb // EACH].alive(puppeteer, (limb % EACH,), now)

    def ask(self, limb: int, puppeteer: str, wanted: bool, now: int) -> bool:
        """As `Marionette.ask`."""
        return 0 <= limb < len(self) and self._puppets[limb // EACH].ask(limb % EACH, puppeteer, wanted, now)

    def settle(self, now: int) -> tuple[list[tuple[str, Grant]], bool]:
        """As `Marionette.settle`."""
        grants: list[tuple[str, Grant]] = []
        changed = False
        for nth, puppet in enumerate(self._puppets):
            given, otherwise = puppet.settle(now)
            grants += [(who, replace(grant, limb=EACH * nth + grant.limb)) for who, grant in given]
            changed = changed or otherwise
        return grants, changed

    def input(self, puppeteer: str, given: Input, now: int) -> Outcome:
        """As `Marionette.input`."""
        if not 0 <= given.limb < len(self):
            return Outcome.OWNER
        return self._puppets[given.limb // EACH].input(puppeteer, replace(given, limb=given.limb % EACH), now)

    def expire(self, now: int) -> list[tuple[int, str]]:
        """As `Marionette.expire`."""
        return [
            (EACH * nth + limb, who) for nth, puppet in enumerate(self._puppets) for limb, who in puppet.expire(now)
        ]

    @property
    def at_rest(self) -> bool:
        """Whether the dances are alone: nobody holds a limb, and all are back."""
        return all(puppet.at_rest for puppet in self._puppets)

    @property
    def lively(self) -> bool:
        """As `Marionette.lively`, of any."""
        return any(puppet.lively for puppet in self._puppets)

    @property
    def epochs(self) -> tuple[int, ...]:
        """Of every limb that there can be the epoch of its last grant."""
        here = [epoch for puppet in self._puppets for epoch in puppet.epochs]
        return (*here, *self._epochs[len(here) :])

    def see(self, poses: Sequence[Array], now: int) -> None:
        """As `Marionette.see`, the rotations (18, 4) of each."""
        for puppet, rotations in zip(self._puppets, poses, strict=False):
            puppet.see(rotations, now)

    def overlay(self, poses: Sequence[Array], now: int) -> Laid:
        """As `Marionette.overlay`, over the rotations (18, 4) of each; empty if no limb is pulled."""
        laid: Laid = {}
        for nth, (puppet, rotations) in enumerate(zip(self._puppets, poses, strict=False)):
            if (over := puppet.overlay(rotations, now)) is not None:
                laid |= {EACH * nth + limb: joints for limb, joints in zip(over.limbs, over.joints, strict=True)}
        return laid

"""The puppets of one stage: limb l of performer k is 4 k + l, and each puppet is as if it were alone (paper 5).

What is done to a limb is done to its puppet; `now` is as of `marionette.merge.Marionette`.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

from bunraku.marionette.limb_rig import ALL_LIMBS, JointRotations
from bunraku.marionette.merge import Marionette
from bunraku.marionette.ownership import InputOutcome, LimbGrant, LimbInput, LimbRefusal
from bunraku.motion.rotation import Array
from bunraku.motion.skeleton import Figure
from bunraku.wire.limbs import MAX_LIMBS, MAX_PERFORMERS

LIMBS_PER_PERFORMER = len(ALL_LIMBS)
INITIAL_EPOCHS = (0,) * MAX_LIMBS
"""The epochs of a stage on which nothing was ever held."""

OverlayJoints = dict[int, JointRotations]
"""What lies over the dances: of each pulled limb the local rotations of its joints."""


class Marionettes:
    """One to four puppets."""

    def __init__(self, figures: Sequence[Figure], epochs: Sequence[int] = INITIAL_EPOCHS) -> None:
        """As `set_figures`; `epochs` are those of a troupe at rest, to go on from."""
        self._epochs = list(epochs)
        self._marionettes: list[Marionette] = []
        self.set_figures(figures)

    def set_figures(self, figures: Sequence[Figure]) -> list[tuple[int, str]]:
        """Others on the stage: limbs of a puppet that was there stay in the hands they are in. Says which limbs went
        with puppets that are there no more, and whose they were.

        Takes its time as `Marionette.set_figure`. Raises `ProportionsError` for a figure whose arms are too short to
        hang, ValueError for none or more than four of them, and changes nothing.
        """
        if not 1 <= len(figures) <= MAX_PERFORMERS:
            raise ValueError(f"a stage has 1 to {MAX_PERFORMERS} performers, not {len(figures)}")
        here = len(self._marionettes)
        # all that may be refused is refused before anything is changed
        made = [
            Marionette(figure, self._epochs[LIMBS_PER_PERFORMER * nth : LIMBS_PER_PERFORMER * (nth + 1)])
            for nth, figure in enumerate(figures)
        ]
        for puppet, figure in zip(self._marionettes, figures, strict=False):
            puppet.set_figure(figure)
        gone = [
            (limb, holder)
            for limb, holder in enumerate(self.holders())
            if holder is not None and limb >= LIMBS_PER_PERFORMER * len(figures)
        ]
        self._epochs = list(self.epochs)
        self._marionettes = [*self._marionettes[: len(figures)], *made[here:]]
        return gone

    def __len__(self) -> int:
        """How many limbs there are."""
        return LIMBS_PER_PERFORMER * len(self._marionettes)

    def reset(self) -> None:
        """As `Marionette.begin_anew`, of all."""
        for puppet in self._marionettes:
            puppet.reset()

    def holders(self) -> tuple[str | None, ...]:
        """The holder's id of each limb, or None."""
        return tuple(holder for puppet in self._marionettes for holder in puppet.holders())

    def asks(self) -> tuple[tuple[str, ...], ...]:
        """Of each limb the ids of those who ask for it, first come first."""
        return tuple(limb for puppet in self._marionettes for limb in puppet.asks())

    def claim(self, limb: int, puppeteer: str, now: int) -> LimbGrant | LimbRefusal:
        """As `Marionette.claim`."""
        if not 0 <= limb < len(self):
            return LimbRefusal(limb, None, "unknown")
        return replace(
            self._marionettes[limb // LIMBS_PER_PERFORMER].claim(limb % LIMBS_PER_PERFORMER, puppeteer, now), limb=limb
        )

    def release(self, limb: int, puppeteer: str, epoch: int, now: int) -> bool:
        """As `Marionette.release`."""
        return 0 <= limb < len(self) and self._marionettes[limb // LIMBS_PER_PERFORMER].release(
            limb % LIMBS_PER_PERFORMER, puppeteer, epoch, now
        )

    def leave(self, puppeteer: str, now: int) -> tuple[int, ...]:
        """As `Marionette.leave`."""
        return tuple(
            LIMBS_PER_PERFORMER * nth + limb
            for nth, puppet in enumerate(self._marionettes)
            for limb in puppet.leave(puppeteer, now)
        )

    def keep_alive(self, puppeteer: str, limbs: Iterable[int], now: int) -> None:
        """As `Marionette.alive`."""
        for limb in limbs:
            if 0 <= limb < len(self):
                self._marionettes[limb // LIMBS_PER_PERFORMER].keep_alive(puppeteer, (limb % LIMBS_PER_PERFORMER,), now)

    def ask(self, limb: int, puppeteer: str, wanted: bool, now: int) -> bool:
        """As `Marionette.ask`."""
        return 0 <= limb < len(self) and self._marionettes[limb // LIMBS_PER_PERFORMER].ask(
            limb % LIMBS_PER_PERFORMER, puppeteer, wanted, now
        )

    def grant_free_limbs(self, now: int) -> tuple[list[tuple[str, LimbGrant]], bool]:
        """As `Marionette.settle`."""
        grants: list[tuple[str, LimbGrant]] = []
        changed = False
        for nth, puppet in enumerate(self._marionettes):
            given, otherwise = puppet.grant_free_limbs(now)
            grants += [(who, replace(grant, limb=LIMBS_PER_PERFORMER * nth + grant.limb)) for who, grant in given]
            changed = changed or otherwise
        return grants, changed

    def apply_input(self, puppeteer: str, limb_input: LimbInput, now: int) -> InputOutcome:
        """As `Marionette.input`."""
        if not 0 <= limb_input.limb < len(self):
            return InputOutcome.NOT_OWNER
        return self._marionettes[limb_input.limb // LIMBS_PER_PERFORMER].apply_input(
            puppeteer, replace(limb_input, limb=limb_input.limb % LIMBS_PER_PERFORMER), now
        )

    def expire(self, now: int) -> list[tuple[int, str]]:
        """As `Marionette.expire`."""
        return [
            (LIMBS_PER_PERFORMER * nth + limb, who)
            for nth, puppet in enumerate(self._marionettes)
            for limb, who in puppet.expire(now)
        ]

    @property
    def is_at_rest(self) -> bool:
        """Whether the dances are alone: nobody holds a limb, and all are back."""
        return all(puppet.is_at_rest for puppet in self._marionettes)

    @property
    def needs_full_rate(self) -> bool:
        """As `Marionette.lively`, of any."""
        return any(puppet.needs_full_rate for puppet in self._marionettes)

    @property
    def epochs(self) -> tuple[int, ...]:
        """Of every limb that there can be the epoch of its last grant."""
        here = [epoch for puppet in self._marionettes for epoch in puppet.epochs]
        return (*here, *self._epochs[len(here) :])

    def observe_poses(self, poses: Sequence[Array], now: int) -> None:
        """As `Marionette.see`, the rotations (18, 4) of each."""
        for puppet, rotations in zip(self._marionettes, poses, strict=False):
            puppet.observe_pose(rotations, now)

    def compute_overlay(self, poses: Sequence[Array], now: int) -> OverlayJoints:
        """As `Marionette.overlay`, over the rotations (18, 4) of each; empty if no limb is pulled."""
        laid: OverlayJoints = {}
        for nth, (puppet, rotations) in enumerate(zip(self._marionettes, poses, strict=False)):
            if (over := puppet.compute_overlay(rotations, now)) is not None:
                laid |= {
                    LIMBS_PER_PERFORMER * nth + limb: joints
                    for limb, joints in zip(over.limbs, over.joints, strict=True)
                }
        return laid

"""Props of a stage, and who may put them where (proto/server.md, 6.3).

A prop that lies on the floor, or is in a hand that nobody holds, is free: any puppeteer may put it into a hand of their
own or a free one, or lay it down. One that is in a held hand belongs to the holder, who may also pass it to the hand of
another. A hand holds one prop.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from enum import StrEnum

from bunraku.motion.placement import Placement
from bunraku.wire.limbs import is_hand
from bunraku.wire.prop import MAX_PROPS, Prop, PropState


class PropRefusalReason(StrEnum):
    """Reason for which a prop stays where it is (proto/messages.md, 3.7)."""

    HELD = "held"
    FULL = "full"
    UNKNOWN = "unknown"
    LEG = "leg"


class StageProps:
    """Props of one stage, by number."""

    def __init__(self, props: Mapping[int, Prop]) -> None:
        self._props = {number: props[number] for number in sorted(props) if 0 <= number < MAX_PROPS}

    @property
    def all(self) -> dict[int, Prop]:
        """Props by number, in ascending order."""
        return dict(self._props)

    def bring(self, props: Mapping[int, Prop]) -> bool:
        """Have these props, by number; return whether that changes any. One of the same kind stays where it is."""
        before = self._props
        self._props = {
            number: before[number] if number in before and before[number].kind == props[number].kind else props[number]
            for number in sorted(props)
        }
        return self._props != before

    def put_in_hand(
        self, number: int, limb: int, puppeteer: str, holders: Sequence[str | None]
    ) -> PropRefusalReason | None:
        """Put a prop into the hand of number `limb`; return the reason if it stays where it is.

        `holders` has the holder's id of each limb on the stage, or None.
        """
        refusal = self._refusal(number, puppeteer, holders)
        if refusal is not None:
            return refusal
        if limb >= len(holders):
            return PropRefusalReason.UNKNOWN
        if not is_hand(limb):
            return PropRefusalReason.LEG
        if any(other != number and prop.state.limb == limb for other, prop in self._props.items()):
            return PropRefusalReason.FULL
        prop = self._props[number]
        is_passed = prop.state.limb is not None and holders[prop.state.limb] == puppeteer
        if holders[limb] not in (None, puppeteer) and not is_passed:
            return PropRefusalReason.HELD
        self._props[number] = prop._replace(state=prop.state._replace(limb=limb))
        return None

    def lay_down(
        self, number: int, place: Placement, puppeteer: str, holders: Sequence[str | None]
    ) -> PropRefusalReason | None:
        """Lay a prop on the floor; return the reason if it stays where it is."""
        refusal = self._refusal(number, puppeteer, holders)
        if refusal is None:
            self._props[number] = self._props[number]._replace(state=PropState(None, place))
        return refusal

    def drop_beyond(self, limb_count: int) -> bool:
        """Let the props in hands that have left the stage lie where they lay before; return whether there were any."""
        gone = [n for n, prop in self._props.items() if prop.state.limb is not None and prop.state.limb >= limb_count]
        for number in gone:
            prop = self._props[number]
            self._props[number] = prop._replace(state=prop.state._replace(limb=None))
        return bool(gone)

    def _refusal(self, number: int, puppeteer: str, holders: Sequence[str | None]) -> PropRefusalReason | None:
        prop = self._props.get(number)
        if prop is None:
            return PropRefusalReason.UNKNOWN
        limb = prop.state.limb
        if limb is not None and limb < len(holders) and holders[limb] not in (None, puppeteer):
            return PropRefusalReason.HELD
        return None

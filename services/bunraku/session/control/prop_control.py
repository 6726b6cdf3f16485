"""Props of a stage at the request of its puppeteers, and the messages about them (proto/server.md, 6.3)."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from bunraku.marionette.props import StageProps
from bunraku.motion.placement import Placement
from bunraku.session.puppeteer_roster import Puppeteer
from bunraku.wire.messages import PropRefusal, Put
from bunraku.wire.prop import MAX_PROPS, Prop, PropState

ROW_DISTANCE_M, ROW_GAP_M = 1.0, 0.6
"""Distance of the row of new props before the first performer, and the gap between two of them."""


class PropControl:
    """Props that the puppeteers of one stage move."""

    def __init__(self, props: Mapping[int, Prop]) -> None:
        self._props = StageProps(props)
        self.has_unsaved_moves = False
        """True if a puppeteer has moved a prop since the stage was saved."""

    @property
    def all(self) -> dict[int, Prop]:
        """Props by number, in ascending order."""
        return self._props.all

    @property
    def kinds(self) -> dict[int, str]:
        """Kind of each prop, by number."""
        return {number: prop.kind for number, prop in self._props.all.items()}

    def plan(self, kinds: Mapping[int, str], front: Placement) -> dict[int, Prop]:
        """Return the props of these kinds, by number: the present ones, and new ones in a row before `front`."""
        present = self._props.all
        return {
            number: present[number]
            if number in present and present[number].kind == kind
            else Prop(kind, PropState(None, _place_in_row(number, front)))
            for number, kind in sorted(kinds.items())
        }

    def bring(self, props: Mapping[int, Prop]) -> bool:
        """Have these props; return whether that changes any. One that is here stays where it is now."""
        return self._props.bring(props)

    def receive(self, puppeteer: Puppeteer, message: Put, holders: Sequence[str | None]) -> bool:
        """Apply a request; return whether a prop has moved. A refused one is answered with the reason."""
        if message.place is not None:
            x, z, turn = message.place
            place = Placement(x, z, math.remainder(turn, math.tau))
            refusal = self._props.lay_down(message.prop, place, puppeteer.id, holders)
        else:
            assert message.limb is not None
            refusal = self._props.put_in_hand(message.prop, message.limb, puppeteer.id, holders)
        if refusal is not None:
            puppeteer.send(PropRefusal(message.prop, refusal.value).pack())
            return False
        self.has_unsaved_moves = True
        return True

    def drop_beyond(self, limb_count: int) -> None:
        """Let the props in hands that have left the stage lie where they lay before."""
        self.has_unsaved_moves |= self._props.drop_beyond(limb_count)

    def presence(self) -> list[dict[str, Any]]:
        """Return the props as in a Presence message."""
        return [
            {"prop": number, "kind": prop.kind, "limb": prop.state.limb, "place": list(prop.state.place)}
            for number, prop in self._props.all.items()
        ]


def _place_in_row(number: int, front: Placement) -> Placement:
    """Return the place of a new prop, right to left as the first performer sees the row."""
    x, z = ROW_GAP_M * (number - (MAX_PROPS - 1) / 2), ROW_DISTANCE_M
    sine, cosine = math.sin(front.turn), math.cos(front.turn)
    return Placement(front.x + cosine * x + sine * z, front.z + cosine * z - sine * x, front.turn)

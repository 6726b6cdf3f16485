"""The links of an arm turn about themselves at a bounded speed.

Where a link lies says nothing about how far it is turned about itself. An arm that is all but straight may have any
plane, and an elbow in it turns that plane, and with it the whole upper arm about itself, with a movement that is hardly
seen; a wrist that bends a little more may turn the palm over. So each link remembers how it was turned, and what is
asked of it beyond `FASTEST` it makes up for later: shoulder, elbow and wrist trade that turn, and no place changes.
"""

from __future__ import annotations

from math import atan2, copysign, pi

from bunraku.marionette import vector
from bunraku.marionette.vector import Quaternion, Vector

FASTEST = 5.0 * pi
"""Radians per second that a link turns about itself at most."""
FARTHEST = 1.5 * pi
"""Radians that a link is behind at most; beyond, it takes the other way round."""


class Spin:
    """One link. `link` is its direction where its orientation is the identity, any length."""

    def __init__(self, link: Vector) -> None:
        self._link = vector.unit(link, (0.0, -1.0, 0.0))
        self._shown: Quaternion | None = None
        self.behind = 0.0
        """Radians about the link from what was wanted last to what was shown, within `FARTHEST` either way."""

    def follow(self, wanted: Quaternion, share: float, seconds: float) -> Quaternion:
        """The orientation nearest to `wanted` that the link is shown in, `seconds` after the last.

        It lies where `wanted` has it, and is turned about itself by no more than `share` (0..1) of `FARTHEST` from it.
        The first time, and where the link keeps up, it is `wanted`.
        """
        along = vector.rotate(wanted, self._link)
        if self._shown is not None:
            carried = vector.multiply(vector.between(vector.rotate(self._shown, self._link), along), self._shown)
            w, x, y, z = vector.multiply(carried, vector.conjugate(wanted))
            behind = 2.0 * atan2(vector.dot((x, y, z), along), w)
            # the way round that it took, unless that is much the longer by now
            behind += 2.0 * pi * round((self.behind - behind) / (2.0 * pi))
            if abs(behind) > FARTHEST:
                behind -= 2.0 * pi * round(behind / (2.0 * pi))
            most = min(max(abs(behind) - FASTEST * seconds, 0.0), FARTHEST * share)
            self.behind = copysign(most, behind)
        turned = vector.multiply(vector.about(along, self.behind), wanted) if self.behind else wanted
        self._shown = shown = vector.normalise(turned)
        return shown

"""DMX512 levels of a stage's lights (ANSI E1.11), and when a source sends them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    # the command line reads the bounds below without loading NumPy
    from bunraku.motion.rotation import Array

SLOT_COUNT = 512
"""Slots of a universe."""
MAX_FPS = 44.0
"""Refresh rate of a full universe, which a source must not exceed (ANSI E1.31, 6.6.1)."""
KEEP_ALIVE_INTERVAL_US = 900_000
"""Interval between packets with unchanged levels: 800 to 1000 ms (ANSI E1.31, 6.6.2; recommended for Art-Net too)."""
REPEATED_PACKETS = 3
"""Packets with unchanged levels that are sent at once, in case one is lost (ANSI E1.31, 6.6.2)."""
LAYOUT_SLOTS = "drgb"
"""Slots that a layout may have: dimmer, red, green, blue."""


def parse_layout(layout: str) -> str:
    """Return a valid layout of one light's slots, such as `drgb`, `rgb` or `rgbd`; raise ValueError if it is not."""
    if not layout or any(slot not in LAYOUT_SLOTS or layout.count(slot) > 1 for slot in layout):
        raise ValueError(
            f"a layout names the slots of a light in their order, each once, by the letters d (dimmer), r, g, b; "
            f"{layout!r} does not"
        )
    return layout


def light_levels(values: Array, full: float, layout: str) -> bytes:
    """Return the levels of a light with the values (7,) of a scene track, one byte for each slot of `layout`.

    The dimmer is the intensity as a share of `full`. Without a dimmer in the layout the colours are multiplied by it.
    Levels are linear, as the duty cycle of an LED; colours above 1 are limited.
    """
    *_, red, green, blue, intensity = values.tolist()
    dimmer = _limit(intensity / full) if full > 0.0 else 0.0
    factor = 1.0 if "d" in layout else dimmer
    shares = {"d": dimmer, "r": factor * _limit(red), "g": factor * _limit(green), "b": factor * _limit(blue)}
    return bytes(round(255 * shares[slot]) for slot in layout)


def _limit(share: float) -> float:
    return min(max(share, 0.0), 1.0)


class Universe:
    """Levels of one universe, with the slots of consecutive lights from `address` (1..512) on in a `layout`."""

    def __init__(self, address: int, layout: str) -> None:
        self.levels = bytes(SLOT_COUNT)
        self._address = address
        self._layout = parse_layout(layout)
        self._sent: bytes | None = None
        self._sent_at = 0
        self._repeats = 0

    @property
    def capacity(self) -> int:
        """Number of lights for which there are slots."""
        return (SLOT_COUNT + 1 - self._address) // len(self._layout)

    def set_lights(self, lights: Sequence[Array | None], full: float) -> None:
        """Set the lights, each with the values (7,) of a scene track; None keeps its levels. Other slots become 0.

        `full` is the intensity of a fully open dimmer. Lights beyond the `capacity` have no slots.
        """
        width = len(self._layout)
        levels = bytearray(SLOT_COUNT)
        for nth, values in enumerate(lights[: self.capacity]):
            at = self._address - 1 + nth * width
            levels[at : at + width] = (
                self.levels[at : at + width] if values is None else light_levels(values, full, self._layout)
            )
        self.levels = bytes(levels)

    def take_due(self, now: int) -> bytes | None:
        """Return the levels (512) if they are to be sent at time `now` (microseconds), else None.

        Changed levels are sent at once and repeated; then unchanged ones only at the keep-alive interval.
        """
        if self.levels != self._sent:
            self._repeats = 0
        elif self._repeats < REPEATED_PACKETS:
            self._repeats += 1
        elif 0 <= now - self._sent_at < KEEP_ALIVE_INTERVAL_US:
            # a clock that was set back does not delay the next packet
            return None
        self._sent, self._sent_at = self.levels, now
        return self.levels

"""Merge of inputs over a link that loses, duplicates and reorders them, compared with the reference merge."""

from __future__ import annotations

import os
from collections.abc import Callable

import numpy as np
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from bunraku.marionette.limb_rig import Limb
from bunraku.marionette.merge import Marionette
from bunraku.marionette.ownership import LimbGrant, LimbInput
from bunraku.motion.skeleton import standard_figure
from tests.marionette.fixtures import random_motion
from tests.marionette.reference_merge import ReceivedInput, ReferenceMarionette

FIGURE = standard_figure()
FRAME_INTERVAL_US = 16_667
HOUR_US = 3_600_000_000
FRAMES = 150
POSES = random_motion(FRAMES, seed=21)
STEPS = int(os.environ.get("BUNRAKU_MERGE_STEPS", "10000"))
"""Number of inputs and frames; a million in the nightly profile (`make test-nightly`)."""
FAULT_COUNTS = {"steps": 0, "lost": 0, "late": 0, "duplicated": 0}

EXAMPLES = max(1, STEPS // 200)


class LossyLink:
    """Link of one puppeteer: loses 5 % of the inputs, delays 10 % by up to 80 ms, duplicates 5 %."""

    def __init__(self, random: np.random.Generator, skew: int) -> None:
        self._random, self._skew = random, skew
        self._in_flight: list[tuple[int, int, int, int, tuple[float, float, float], Limb]] = []
        self.sequence = 0

    def send(self, now: int, limb: Limb, epoch: int, kind: int, values: tuple[float, float, float]) -> None:
        self.sequence += 1
        if self._random.random() < 0.05:
            FAULT_COUNTS["lost"] += 1
            return
        copies = 1 + (self._random.random() < 0.05)
        FAULT_COUNTS["duplicated"] += copies - 1
        for _ in range(copies):
            delay = int(self._random.integers(2_000, 8_000))
            if self._random.random() < 0.10:
                delay += int(self._random.integers(20_000, 80_000))
                FAULT_COUNTS["late"] += 1
            item = (now + delay, self.sequence, epoch, kind, values, limb)
            self._in_flight.append(item)

    def receive(self, until: int) -> list[tuple[ReceivedInput, int, Limb]]:
        """Return the inputs received until a time, in the order of arrival."""
        arrived = sorted(received for received in self._in_flight if received[0] <= until)
        self._in_flight = [received for received in self._in_flight if received[0] > until]
        return [
            (ReceivedInput(received_us, self._sampled(sequence) + self._skew, sequence, kind, values), epoch, limb)
            for received_us, sequence, epoch, kind, values, limb in arrived
        ]

    def _sampled(self, sequence: int) -> int:
        return sequence * FRAME_INTERVAL_US


@settings(max_examples=EXAMPLES, deadline=None, suppress_health_check=list(HealthCheck))
@given(
    st.integers(0, 2**32 - 1),
    st.sampled_from((0, HOUR_US, -HOUR_US)),
    st.lists(st.sampled_from(list(Limb)), min_size=2, max_size=2),
)
def test_merged_motion_over_a_lossy_link_equals_the_reference(seed: int, skew: int, requested: list[Limb]) -> None:
    random = np.random.default_rng(seed)
    marionette, model = Marionette(FIGURE), ReferenceMarionette(FIGURE)
    puppeteers = ("ada", "bo")
    links = {"ada": LossyLink(random, skew), "bo": LossyLink(random, -skew)}
    epochs: dict[str, tuple[Limb, int]] = {}
    origin = 10**15
    silence_begins = {puppeteer: int(random.integers(40, FRAMES)) for puppeteer in puppeteers}
    for frame in range(FRAMES):
        now = origin + frame * FRAME_INTERVAL_US
        for puppeteer, limb in zip(puppeteers, requested, strict=True):
            if puppeteer not in epochs and frame % 20 == 0:
                # both claim at once, perhaps the same limb
                answer, expected = marionette.ownership.claim(limb, puppeteer, now), model.claim(limb, puppeteer, now)
                assert (answer.epoch if isinstance(answer, LimbGrant) else None) == expected
                if expected is not None:
                    epochs[puppeteer] = limb, expected
                    links[puppeteer].sequence = frame
            elif puppeteer in epochs and not silence_begins[puppeteer] <= frame < silence_begins[puppeteer] + 25:
                limb, epoch = epochs[puppeteer]
                kind = int(random.random() < 0.7)
                x, y, z = np.round(random.uniform(-0.9, 0.9, 3), 3).tolist()
                links[puppeteer].send(now, limb, epoch, kind, (x, y, z))
                if random.random() < 0.01:
                    marionette.ownership.release(limb, puppeteer, epoch, now)
                    model.release(limb, puppeteer, epoch)
                    del epochs[puppeteer]
        for puppeteer, link in links.items():
            for received, epoch, limb in link.receive(now + FRAME_INTERVAL_US):
                limb_input = LimbInput(
                    limb, received.kind, epoch, received.sequence, received.sampled_us, received.values
                )
                marionette.ownership.apply_input(puppeteer, limb_input, received.received_us)
                model.apply_input(limb, puppeteer, epoch, received)
                FAULT_COUNTS["steps"] += 1
        after = now + FRAME_INTERVAL_US
        for lost_limb, puppeteer in marionette.ownership.expire(after):
            if epochs.get(puppeteer, (None,))[0] == lost_limb:
                del epochs[puppeteer]
        model.expire(after)
        overlay = marionette.compute_overlay(POSES[frame], after)
        shown = model.solve_frame(POSES[frame].tolist(), after, 0.0 if frame == 0 else FRAME_INTERVAL_US * 1e-6)
        FAULT_COUNTS["steps"] += 1
        assert (overlay.limbs if overlay else ()) == tuple(shown)
        if overlay:
            np.testing.assert_allclose(overlay.rotations, np.array(list(shown.values())), atol=1e-12)


def test_number_of_compared_steps_reaches_the_setting(tally: Callable[[str], None]) -> None:
    assert FAULT_COUNTS["steps"] >= STEPS
    tally(
        "merge compared with the reference: " + ", ".join(f"{count:,} {kind}" for kind, count in FAULT_COUNTS.items())
    )

"""The merge over a line that loses, doubles and mixes up, beside a model that plays all that came from the
beginning."""

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
"""Inputs and frames in all; a million in the nightly profile (`make test-nightly`)."""
FAULT_COUNTS = {"steps": 0, "lost": 0, "late": 0, "doubled": 0}

EXAMPLES = max(1, STEPS // 200)


class LossyLink:
    """Of one puppeteer: what it sends, 5 % lost, 10 % late by up to 80 ms so that others overtake it, 5 % doubled."""

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
        FAULT_COUNTS["doubled"] += copies - 1
        for _ in range(copies):
            delay = int(self._random.integers(2_000, 8_000))
            if self._random.random() < 0.10:
                delay += int(self._random.integers(20_000, 80_000))
                FAULT_COUNTS["late"] += 1
            item = (now + delay, self.sequence, epoch, kind, values, limb)
            self._in_flight.append(item)

    def receive(self, until: int) -> list[tuple[ReceivedInput, int, Limb]]:
        """What comes up to a time, in the order in which it comes."""
        here = sorted(one for one in self._in_flight if one[0] <= until)
        self._in_flight = [one for one in self._in_flight if one[0] > until]
        return [
            (ReceivedInput(came, self._sampled(sequence) + self._skew, sequence, kind, values), epoch, limb)
            for came, sequence, epoch, kind, values, limb in here
        ]

    def _sampled(self, sequence: int) -> int:
        return sequence * FRAME_INTERVAL_US


@settings(max_examples=EXAMPLES, deadline=None, suppress_health_check=list(HealthCheck))
@given(
    st.integers(0, 2**32 - 1),
    st.sampled_from((0, HOUR_US, -HOUR_US)),
    st.lists(st.sampled_from(list(Limb)), min_size=2, max_size=2),
)
def test_the_merged_motion_is_that_of_an_in_order_model(seed: int, skew: int, wished: list[Limb]) -> None:
    random = np.random.default_rng(seed)
    puppet, model = Marionette(FIGURE), ReferenceMarionette(FIGURE)
    people = ("ada", "bo")
    lines = {"ada": LossyLink(random, skew), "bo": LossyLink(random, -skew)}
    epochs: dict[str, tuple[Limb, int]] = {}
    origin = 10**15
    quiet = {who: int(random.integers(40, FRAMES)) for who in people}
    for frame in range(FRAMES):
        now = origin + frame * FRAME_INTERVAL_US
        for who, limb in zip(people, wished, strict=True):
            if who not in epochs and frame % 20 == 0:
                # both at once, and perhaps the same limb
                answer, expected = puppet.ownership.claim(limb, who, now), model.claim(limb, who, now)
                assert (answer.epoch if isinstance(answer, LimbGrant) else None) == expected
                if expected is not None:
                    epochs[who] = limb, expected
                    lines[who].sequence = frame
            elif who in epochs and not quiet[who] <= frame < quiet[who] + 25:
                limb, epoch = epochs[who]
                kind = int(random.random() < 0.7)
                x, y, z = np.round(random.uniform(-0.9, 0.9, 3), 3).tolist()
                lines[who].send(now, limb, epoch, kind, (x, y, z))
                if random.random() < 0.01:
                    puppet.ownership.release(limb, who, epoch, now)
                    model.release(limb, who, epoch)
                    del epochs[who]
        for who, line in lines.items():
            for one, epoch, limb in line.receive(now + FRAME_INTERVAL_US):
                given_ = LimbInput(limb, one.kind, epoch, one.sequence, one.sampled_us, one.values)
                puppet.ownership.apply_input(who, given_, one.received_us)
                model.apply_input(limb, who, epoch, one)
                FAULT_COUNTS["steps"] += 1
        after = now + FRAME_INTERVAL_US
        for lost, who in puppet.ownership.expire(after):
            if epochs.get(who, (None,))[0] == lost:
                del epochs[who]
        model.expire(after)
        overlay = puppet.compute_overlay(POSES[frame], after)
        shown = model.solve_frame(POSES[frame].tolist(), after, 0.0 if frame == 0 else FRAME_INTERVAL_US * 1e-6)
        FAULT_COUNTS["steps"] += 1
        assert (overlay.limbs if overlay else ()) == tuple(shown)
        if overlay:
            np.testing.assert_allclose(overlay.rotations, np.array(list(shown.values())), atol=1e-12)


def test_so_many_steps_were_compared(tally: Callable[[str], None]) -> None:
    assert FAULT_COUNTS["steps"] >= STEPS
    tally("merge beside its model: " + ", ".join(f"{count:,} {what}" for what, count in FAULT_COUNTS.items()))

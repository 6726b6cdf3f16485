from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from unittest import mock

import numpy as np
import pytest

from bunraku.codec import motion_decoder
from bunraku.codec.container import StoredMotion
from bunraku.codec.live import LiveTrack
from bunraku.messaging.bus import MemoryBus
from bunraku.motion import rotation
from bunraku.motion.easing import minimum_jerk
from bunraku.motion.rotation import Array
from bunraku.motion.skeleton import JOINT_COUNT
from bunraku.playout import timeline
from bunraku.playout.live_buffer import LiveBuffer
from bunraku.playout.performance import FADE_US, HOLD_US
from bunraku.runtime.clock import clock
from bunraku.session.live.cast import Cast, CastMember
from bunraku.session.session_start import SessionStart
from bunraku.session.stage import OVERLAY_LEAD_US, Stage
from bunraku.wire.live import Live, Sample
from bunraku.wire.messages import Claim, Input
from bunraku.wire.overlay import Overlay
from tests.session.joined_stage import StageMessages, join_stage, keep_holding, last_grant, stored_motion

SAMPLE_INTERVAL_US = 16_667


def vectors_at(sampled: int) -> Array:
    """Rotation vectors (18, 3) of a slow movement at a clock time."""
    vectors: Array = 0.3 * np.sin(sampled * 1e-6 + np.arange(JOINT_COUNT * 3)).reshape(JOINT_COUNT, 3)
    return vectors


def sample_at(sampled: int, sequence: int = 0) -> Sample:
    units = np.round(vectors_at(sampled) * 32_767 / np.pi).astype(int).ravel()
    return Sample(sequence, sampled, (0.1, 0.9, 0.2), tuple(units.tolist()))


class Opened:
    """A stage of one stored motion, whose performer is live."""

    def __init__(self, stage: Stage, motion: StoredMotion, bus: MemoryBus) -> None:
        self.stage = stage
        self.audience = StageMessages(bus)
        self.buffer = LiveBuffer(LiveTrack(motion.first_track.skeleton))

    @asynccontextmanager
    async def performing(self) -> AsyncIterator[None]:
        """Send samples until the context ends."""

        async def send_samples() -> None:
            number = 0
            while True:
                number += 1
                assert self.stage.receive_sample("p", sample_at(clock(), number)) is not None
                await asyncio.sleep(SAMPLE_INTERVAL_US * 1e-6)

        task = asyncio.create_task(send_samples())
        try:
            yield
        finally:
            task.cancel()


@pytest.fixture
async def opened() -> AsyncIterator[Opened]:
    await asyncio.to_thread(motion_decoder.warm_up)
    bus = MemoryBus()
    # a stored motion in the place of one at rest
    cast = Cast("", (CastMember("p", "Aiko", 60.0, None),))
    motion = stored_motion(cast.motion, 5)
    state = timeline.start(motion.id, motion.first_track.duration_us, clock())
    stage = Stage(SessionStart("s", motion, state, state.clock, cast=cast), bus, clock)
    yield Opened(stage, motion, bus)
    await stage.close()


async def test_samples_are_published_and_due_after_the_lead_and_the_delay(opened: Opened) -> None:
    async with opened.performing():
        messages = await opened.audience.wait_for(40, Live)
    performance = opened.stage.live.find("p")
    assert performance is not None
    lives = [message for message in messages if isinstance(message, Live)]
    assert all(set(message.blocks) == {0} for message in lives)
    dues = [message.due for message in lives]
    assert all(gap % Live.FRAME_INTERVAL_US == 0 for gap in np.diff(dues))
    for message in lives:
        opened.buffer.put(message.due, message.frames, message.blocks[0].data)
    # the delay changes slowly: the pose due now is that of one lead and about one delay before
    lag = OVERLAY_LEAD_US + performance.performance.delay_us(clock())
    pose = opened.buffer.pose_at(dues[-1])
    assert pose is not None
    best = min(_angle(pose[1], vectors_at(dues[-1] - lag + shift)) for shift in range(-200_000, 200_001, 10_000))
    assert best < 0.1
    assert np.linalg.norm(pose[0] - [0.1, 0.9, 0.2]) < 0.01


@pytest.mark.parametrize("phase_us", range(0, Live.FRAME_INTERVAL_US, Live.FRAME_INTERVAL_US // 8))
async def test_performer_is_shown_at_any_phase_of_samples_and_frames(phase_us: int) -> None:
    await asyncio.to_thread(motion_decoder.warm_up)
    bus = MemoryBus()
    cast = Cast("", (CastMember("p", "Aiko", 60.0, None),))
    motion = stored_motion(cast.motion, 5)
    state = timeline.start(motion.id, motion.first_track.duration_us, clock())
    with mock.patch("secrets.randbelow", return_value=phase_us):
        stage = Stage(SessionStart("s", motion, state, state.clock, cast=cast), bus, clock)
    audience = StageMessages(bus)
    # samples in step with the frames, as from a tool whose rate is exact
    frame = clock() // Live.FRAME_INTERVAL_US + 1
    for number in range(30):
        sampled = (frame + number) * Live.FRAME_INTERVAL_US
        await asyncio.sleep((sampled - clock()) * 1e-6)
        assert stage.receive_sample("p", sample_at(sampled, number)) is not None
    await stage.close()
    assert any(isinstance(message, Live) for message in audience.messages)


def _angle(rotations: Array, vectors: Array) -> float:
    turn = rotation.multiply(rotation.conjugate(rotations), rotation.from_rotation_vector(vectors))
    return float(np.linalg.norm(rotation.to_rotation_vector(turn), axis=-1).max())


async def test_without_limbs_no_overlay_is_published(opened: Opened) -> None:
    async with opened.performing():
        await opened.audience.wait_for(10, Live)
    assert not any(isinstance(message, Overlay) for message in opened.audience.messages)


async def test_limb_of_a_live_performer_is_held_on_its_live_body(opened: Opened) -> None:
    stage = opened.stage
    aiko = join_stage(stage, "Aiko")
    async with opened.performing():
        await opened.audience.wait_for(10, Live)
        stage.receive(aiko.puppeteer, Claim(0))
        epoch = last_grant(aiko).epoch
        async with keep_holding(stage, aiko, 0):
            stage.receive(aiko.puppeteer, Input(0, Input.TARGET, epoch, 1, 0, (0.3, 0.2, 0.4)))
            overlays = await opened.audience.wait_for(20, Overlay)
    held = [one for one in overlays if isinstance(one, Overlay) and one.limbs]
    assert {tuple(one.limbs) for one in held} == {(0,)}
    lives = {one.due for one in opened.audience.messages if isinstance(one, Live)}
    assert {one.due for one in held[1:]} <= lives


async def test_silent_performer_rests_and_then_sends_nothing(opened: Opened) -> None:
    async with opened.performing():
        await opened.audience.wait_for(10, Live)
    count = 0
    messages = await opened.audience.wait_for(1, Live)
    while messages[-1].blocks:  # type: ignore[attr-defined]
        count = len(messages)
        messages = await opened.audience.wait_for(count + 1, Live)
    last_shown = messages[-2]
    assert isinstance(last_shown, Live)
    first_shown = next(m for m in messages if isinstance(m, Live))
    assert last_shown.due - first_shown.due >= HOLD_US + FADE_US - 100_000
    opened.buffer.put(last_shown.due, last_shown.frames, last_shown.blocks[0].data)
    pose = opened.buffer.pose_at(last_shown.due)
    assert pose is not None
    # a stage that was held up skips frames: the last one may then be earlier in the fade
    skipped = (messages[-1].due - last_shown.due - 2 * Live.FRAME_INTERVAL_US) / FADE_US  # type: ignore[attr-defined]
    unfaded = 1.0 - float(minimum_jerk(np.array(1.0 - min(max(skipped, 0.0), 1.0))))
    assert _angle(pose[1], np.zeros((JOINT_COUNT, 3))) < 0.05 + unfaded
    # samples wake it again
    async with opened.performing():
        shown = await opened.audience.wait_for(len(messages) + 2, Live)
    assert shown[-1].blocks  # type: ignore[attr-defined]


async def test_sample_of_an_unknown_performer_is_not_applied(opened: Opened) -> None:
    assert opened.stage.receive_sample("q", sample_at(clock())) is None

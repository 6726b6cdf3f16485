"""Viewer that watches for a duration which does not depend on the speed of the machine."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Any

import pytest

from bunraku import client
from bunraku.client import Viewer
from bunraku.playout.block_store import Pose
from tests.time_limit import HANG_TIMEOUT_S


class PatientViewer(Viewer):
    """Viewer whose time to watch begins when it knows the time and has a pose to show, and sound if there is any."""

    async def _render(self, *arguments: Any) -> None:
        async with asyncio.timeout(HANG_TIMEOUT_S):
            while not self._is_ready:  # noqa: ASYNC110
                await asyncio.sleep(0.005)
        await super()._render(*arguments)

    @property
    def _is_ready(self) -> bool:
        local = self._local_clock()
        if not self.clock.is_synchronised or self.pose_at(self.clock.at(local) - round(self._delay.at(local))) is None:
            return False
        return self.audio is None or self.statistics.audio_blocks > 0


def use_patient_viewers(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let the commands of the CLI watch with a `PatientViewer`."""
    monkeypatch.setattr(client, "Viewer", PatientViewer)


async def watch_until(
    viewer: Viewer, is_reached: Callable[[], bool], on_frame: Callable[[int, Pose], None] | None = None
) -> None:
    """Watch until a condition, which is checked after each frame, is met."""
    reached = asyncio.Event()

    def see(reference: int, pose: Pose) -> None:
        if on_frame is not None:
            on_frame(reference, pose)
        if is_reached():
            reached.set()

    watching = asyncio.create_task(viewer.watch(2 * HANG_TIMEOUT_S, see))
    reaching = asyncio.create_task(reached.wait())
    try:
        async with asyncio.timeout(HANG_TIMEOUT_S):
            await asyncio.wait((watching, reaching), return_when=asyncio.FIRST_COMPLETED)
        if watching.done():
            watching.result()
        assert reached.is_set()
    finally:
        watching.cancel()
        reaching.cancel()
        await asyncio.gather(watching, reaching, return_exceptions=True)

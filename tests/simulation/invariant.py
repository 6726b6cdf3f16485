"""Invariants: those that hold at every step, and those that hold once all faults are over."""

from __future__ import annotations

import asyncio
from typing import Any

import numpy as np

from bunraku.messaging.key_value import SESSION_KEY_PREFIX
from bunraku.playout import timeline
from bunraku.playout.block_store import MotionBlockStore, Pose
from bunraku.playout.overlay_buffer import OverlayBuffer
from bunraku.session.puppeteer_connection import MAX_QUEUED_MESSAGES, PuppeteerConnection
from bunraku.session.stage import Stage
from bunraku.storage.record import CatalogueEntry
from bunraku.stream.send_queue import MAX_CONTROL_MESSAGES, MAX_PENDING_PINGS
from bunraku.wire.messages import Data, unpack
from bunraku.wire.overlay import Overlay
from tests.simulation.fault import Faults
from tests.simulation.model import Model, SessionState
from tests.simulation.replica import SessionReplica
from tests.simulation.viewer import SimulatedViewer
from tests.simulation.world import Violation, World

MAX_PENDING_REQUESTS = 200
MAX_UNSENT_BYTES = 1 << 20
CHECK_INTERVAL_US = 10_000
QUEUE_CHECK_INTERVAL_US = 100_000
"""Virtual time between two checks, beside those after each event of the trace."""
POSE_AGE_US = 150_000
"""Age of the compared pose: its overlays have arrived everywhere."""
POSE_CHECK_INTERVAL_US = 50_000
"""Virtual time between two comparisons of a pose."""
MAX_CLOCK_ERROR_US = 45_000
"""Error of a viewer's reference clock: half of the longest round trip, and the skew between servers."""
POSE_TOLERANCE = 1e-9
OVERLAY_TOLERANCE = 0.05
"""Difference of quaternions: a viewer on a constrained link interpolates between every second frame of an overlay."""


class Invariants:
    """Checks of one simulation."""

    def __init__(self, world: World, model: Model, faults: Faults) -> None:
        self._world = world
        self._model = model
        self._faults = faults
        self._checked_lines = 0
        self._checked_us = self._queues_checked_us = -QUEUE_CHECK_INTERVAL_US

    # at every step

    def check_step(self) -> None:
        """Check what holds at every step; raise `Violation`."""
        loop = self._world.loop
        if loop.unhandled:
            raise Violation(f"unhandled: {loop.unhandled[0]}")
        if loop.now_us - self._checked_us < CHECK_INTERVAL_US and self._checked_lines == len(self._world.trace):
            return
        self._checked_us, self._checked_lines = loop.now_us, len(self._world.trace)
        self._check_owners()
        self._check_motions()
        if loop.now_us - self._queues_checked_us >= QUEUE_CHECK_INTERVAL_US:
            self._queues_checked_us = loop.now_us
            self._check_queues()

    def _check_owners(self) -> None:
        owners: dict[str, list[SessionReplica]] = {}
        for replica in self._world.sessions:
            # a server that stops waits for its requests first, which is not simulated
            if replica.is_up:
                for stage in replica.sessions.stages:
                    if not self._faults.was_cut_off(replica):
                        owners.setdefault(stage.id, []).append(replica)
        for session, replicas in owners.items():
            names = ", ".join(replica.node.name for replica in replicas)
            if len(replicas) > 1:
                holders = [
                    stage.holders for replica in replicas for stage in replica.sessions.stages if stage.id == session
                ]
                raise Violation(f"session {session} has two owners: {names}; the holders of its limbs are {holders}")
            if self._model.sessions.get(session) is SessionState.ENDED:
                raise Violation(f"session {session} was deleted with 204 and exists on {names}")

    def _check_motions(self) -> None:
        for motion_id, motion in self._model.motions.items():
            if motion.is_promised and f"motions/{motion_id}.bunraku" not in self._world.disk.objects:
                raise Violation(f"the object of motion {motion_id}, whose upload was acknowledged, is gone")

    def _check_queues(self) -> None:
        for replica in self._world.replicas:
            if len(replica.bus.pending) > MAX_PENDING_REQUESTS:
                raise Violation(f"{replica.node.name} has {len(replica.bus.pending)} requests without an answer")
        for connections in (
            *(replica.connections for replica in self._world.sessions),
            *(replica.connections for replica in self._world.streams),
        ):
            for connection in connections:
                self._check_connection(connection)

    def _check_connection(self, connection: Any) -> None:
        listener = connection._listener
        if isinstance(listener, PuppeteerConnection):
            excess = len(listener._queued) > MAX_QUEUED_MESSAGES
        else:
            queue = listener._queue
            excess = len(queue._control) > MAX_CONTROL_MESSAGES or len(queue._pings) > MAX_PENDING_PINGS
        if excess or connection.buffered_bytes > MAX_UNSENT_BYTES:
            raise Violation(f"too much waits for a client: {connection.buffered_bytes} bytes and {listener}")

    # after the faults

    async def check_end(self, converged_us: int) -> None:
        """Check what holds once all faults are over, and what viewers show at `converged_us`; raise `Violation`."""
        stages = self._stages()
        for session in self._model.open_sessions():
            if session not in stages:
                raise Violation(f"session {session} is open, but runs nowhere")
        self._check_holders(stages)
        self._check_ended()
        await self._check_catalogue()
        viewers = [
            viewer
            for viewer in self._model.viewers
            if viewer.session in stages and self._model.sessions[viewer.session] is SessionState.OPEN
        ]
        # a viewer is sent nothing during a quiet period
        while viewers := [viewer for viewer in viewers if not self._has_converged(viewer, stages, converged_us)]:  # noqa: ASYNC110
            await asyncio.sleep(POSE_CHECK_INTERVAL_US * 1e-6)

    def _has_converged(self, viewer: SimulatedViewer, stages: dict[str, Stage], converged_us: int) -> bool:
        """Return whether a viewer shows what its stage does; raise `Violation` if it does not at `converged_us`."""
        try:
            self._check_viewer(viewer, stages[viewer.session])
        except Violation:
            if self._world.loop.now_us >= converged_us:
                raise
            return False
        return True

    def _stages(self) -> dict[str, Stage]:
        return {stage.id: stage for replica in self._world.sessions for stage in replica.sessions.stages}

    def _check_holders(self, stages: dict[str, Stage]) -> None:
        for puppeteer in self._model.puppeteers:
            stage = stages.get(puppeteer.session)
            for limb in puppeteer.epochs:
                if stage is not None and stage.holders[limb] != puppeteer.id:
                    raise Violation(
                        f"{puppeteer.node.name} believes to hold limb {limb}, which belongs to {stage.holders[limb]}"
                    )

    def _check_ended(self) -> None:
        registered = self._world.broker.store.watch().entries
        for session, state in self._model.sessions.items():
            if state is SessionState.ENDED and f"{SESSION_KEY_PREFIX}.{session}" in registered:
                raise Violation(f"session {session} was deleted with 204, but its record exists")

    async def _check_catalogue(self) -> None:
        for motion_id, motion in self._model.motions.items():
            entry = await self._get_entry(motion_id)
            has_object = f"motions/{motion_id}.bunraku" in self._world.disk.objects
            if entry is not None and not has_object:
                raise Violation(f"motion {motion_id} is in the catalogue, but its object is gone")
            if motion.is_promised and entry is None:
                raise Violation(f"motion {motion_id}, whose upload was acknowledged, is not in the catalogue")

    async def _get_entry(self, motion_id: str) -> CatalogueEntry | None:
        replica = self._world.ingests[0]

        async def query() -> CatalogueEntry | None:
            return await replica.context.catalogue.get_motion(motion_id)

        return await replica.node.start(query(), "query")

    def _check_viewer(self, viewer: SimulatedViewer, stage: Stage) -> None:
        name, client = viewer.node.name, viewer.viewer
        replica = viewer.replica
        newest = client.timeline_history.newest
        if not viewer.is_connected or replica is None or newest is None:
            raise Violation(f"{name} is not connected to session {stage.id}")
        if newest != stage.timeline:
            raise Violation(f"{name} has the timeline {newest}, its session has {stage.timeline}")
        error = client.clock.at(viewer.node.clock()) - replica.node.clock()
        if abs(error) > MAX_CLOCK_ERROR_US:
            raise Violation(f"the reference clock of {name} is wrong by {error} us")
        at = replica.node.clock() - POSE_AGE_US
        pose, expected = client.pose_at(at), self._expected_pose(viewer, stage, at)
        if pose is None:
            raise Violation(f"{name} has no pose {POSE_AGE_US} us ago")
        difference = np.abs(pose[1] - expected[1]).max(axis=1)
        if np.abs(pose[0] - expected[0]).max() > POSE_TOLERANCE or difference.max() > OVERLAY_TOLERANCE:
            raise Violation(
                f"{name} shows another pose than the stage; joints differ by {difference.round(3).tolist()}"
            )

    def _expected_pose(self, viewer: SimulatedViewer, stage: Stage, at: int) -> Pose:
        """Return the pose of the stage at `at`, from blocks of the levels that the viewer has."""
        library, state = self._world.library, stage.timeline
        performer = library.motions[state.motion].performers[0]
        store = viewer.viewer._blocks
        assert store is not None
        own = MotionBlockStore(performer.track)
        for index in range(performer.track.block_count):
            if (level := store.level(index)) >= 0:
                block = Data.unpack(performer.packets[level][index]).block
                own.put(index, level, library.blocks[block])
        pose = own.pose_at(timeline.position_at(state, at), state.loop, state.duration)
        if pose is None:
            raise Violation(f"{viewer.node.name} lacks a block")
        return pose[0], self._overlays(stage).apply(pose[1], at)

    def _overlays(self, stage: Stage) -> OverlayBuffer:
        """Return the overlays that the stage has published."""
        buffer = OverlayBuffer()
        for message in self._world.published.get(stage.id, ()):
            overlay = unpack(message)
            assert isinstance(overlay, Overlay)
            buffer.put(overlay)
        return buffer

"""Outputs of a viewer's frames to other tools: VMC, OSC and DMX.

An output has `on_frame` for `Viewer.watch` and calls `send` with each datagram. Times are the reference clock's.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from bunraku.client.viewer import Viewer
from bunraku.motion.rotation import Array
from bunraku.output import artnet, sacn, stage_messages, vmc
from bunraku.output.dmx import Universe
from bunraku.output.osc import pack_datagrams
from bunraku.playout.block_store import Pose
from bunraku.wire.limbs import LIMBS

Send = Callable[[bytes], None]
PackLevels = Callable[[int, bytes, bool], bytes]
"""Function of a sequence number, levels, and whether the stream ends, that returns a packet."""


class PerformerMissing(Exception):
    """Performer that is not on the stage; the message has their number."""


class StageOutput(Protocol):
    """Output that sends frames of a stage."""

    frames: int
    """Frames sent."""

    def on_frame(self, reference: int, pose: Pose) -> None:
        """Send the frame at clock time `reference`, microseconds, with the first performer's pose."""

    def finish(self) -> None:
        """Send the end of the stream, if the format has one."""


class VmcOutput:
    """Pose of one performer, with controlled limbs, in the VMC protocol.

    `performer` counts from 0. A frame is one bundle, or one datagram for each message if `single`; `scale` and
    `root_motion` are those of `output.vmc.make_frame`. `on_frame` raises `PerformerMissing` if the stage does not have
    the performer from the start; later frames without it are skipped.
    """

    def __init__(
        self,
        viewer: Viewer,
        send: Send,
        *,
        performer: int = 0,
        single: bool = False,
        scale: float = 1.0,
        root_motion: bool = False,
    ) -> None:
        self.frames = 0
        self._viewer = viewer
        self._send = send
        self._performer = performer
        self._single = single
        self._scale = scale
        self._root_motion = root_motion
        self._started_at: int | None = None

    def on_frame(self, reference: int, pose: Pose) -> None:
        found = pose if self._performer == 0 else self._viewer.pose_at(reference, self._performer)
        if found is None:
            self._check_performer()
            return
        track = self._viewer.performers[self._performer]
        assert track is not None, "a performer with a pose has a track"
        self._started_at = reference if self._started_at is None else self._started_at
        seconds = (reference - self._started_at) / 1e6
        extension = self._viewer.extension_of(self._performer)
        extended = self._viewer.extended_pose_at(reference, self._performer)
        messages = vmc.make_frame(
            track.figure,
            *found,
            seconds,
            extended=(extension, extended) if extension is not None and extended is not None else None,
            fingers=self._viewer.fingers_at(reference, self._performer),
            expressions=self._viewer.expressions_at(reference, self._performer),
            scale=self._scale,
            root_motion=self._root_motion,
        )
        for datagram in pack_datagrams(messages, self._single):
            self._send(datagram)
        self.frames += 1

    def finish(self) -> None:
        """Do nothing: receivers keep the last pose."""

    def _check_performer(self) -> None:
        # tracks may be described after the first frames, but the number of limbs is known at once
        presence = self._viewer.presence
        if self.frames == 0 and presence is not None and self._performer >= len(presence.limbs) // len(LIMBS):
            count = len(presence.limbs) // len(LIMBS)
            raise PerformerMissing(f"the stage has {count} performer{'s' * (count != 1)}, counted from 0")


class OscOutput:
    """Lights and limbs of a stage as the messages of `output.stage_messages`, bundled as those of `VmcOutput`."""

    def __init__(self, viewer: Viewer, send: Send, *, single: bool = False) -> None:
        self.frames = 0
        self._viewer = viewer
        self._send = send
        self._single = single
        self._started_at: int | None = None

    def on_frame(self, reference: int, pose: Pose) -> None:
        self._started_at = reference if self._started_at is None else self._started_at
        messages = [stage_messages.make_time((reference - self._started_at) / 1e6)]
        for number, values in enumerate(find_lights(self._viewer, reference)[0]):
            messages += stage_messages.make_light(number, values) if values is not None else []
        for performer, track in enumerate(self._viewer.performers):
            found = pose if performer == 0 else self._viewer.pose_at(reference, performer)
            if track is not None and found is not None:
                messages += stage_messages.make_limbs(performer, track.figure, *found)
        for datagram in pack_datagrams(messages, self._single):
            self._send(datagram)
        self.frames += 1

    def finish(self) -> None:
        """Do nothing: OSC has no end of a stream."""


class DmxOutput:
    """Levels of a stage's lights in a DMX universe.

    `pack` makes a packet of the network protocol (`pack_artnet`, `pack_sacn`). Unchanged levels are sent about once
    per second.
    """

    def __init__(self, viewer: Viewer, send: Send, universe: Universe, pack: PackLevels, *, final_packets: int) -> None:
        self.frames = 0
        self._viewer = viewer
        self._send = send
        self._universe = universe
        self._pack = pack
        self._final_packets = final_packets
        self._sequence = 0

    def on_frame(self, reference: int, pose: Pose) -> None:  # noqa: ARG002 - lights only
        self._universe.set_lights(*find_lights(self._viewer, reference))
        if (levels := self._universe.take_due(reference)) is not None:
            self._send_packet(levels, ends=False)
            self.frames += 1

    def finish(self) -> None:
        for _ in range(self._final_packets if self.frames else 0):
            self._send_packet(self._universe.levels, ends=True)

    def _send_packet(self, levels: bytes, ends: bool) -> None:
        self._send(self._pack(self._sequence, levels, ends))
        self._sequence += 1


def find_lights(viewer: Viewer, reference: int) -> tuple[list[Array | None], float]:
    """Return the values (7,) of each light at clock time `reference`, None if its block is missing, and the largest
    intensity of all lights (1 without lights)."""
    numbers = [number for number, track in enumerate(viewer.scenes) if track.kind == "light"]
    full = max((viewer.scenes[number].full for number in numbers), default=1.0)
    return [viewer.scene_at(reference, number) for number in numbers], full


def pack_artnet(universe: int) -> PackLevels:
    """Return the function that packs levels for an Art-Net universe."""
    return lambda sequence, levels, _: artnet.pack_artdmx(universe, sequence, levels)


def pack_sacn(universe: int, priority: int, cid: bytes) -> PackLevels:
    """Return the function that packs levels for an sACN universe, from a source with this priority and identifier."""
    return lambda sequence, levels, ends: sacn.pack_data(
        universe, sequence, levels, cid=cid, source="Bunraku", priority=priority, terminated=ends
    )

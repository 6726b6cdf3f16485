"""Recording of a live capture: receives the packets of a capture tool, shows progress, and saves a take as BVH."""

from __future__ import annotations

import asyncio
import contextlib
import os
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import typer
from rich.status import Status
from rich.text import Text

from bunraku.capture.errors import UnreadableCapture
from bunraku.capture.frame import FrameAssembler
from bunraku.capture.session import CaptureSession, TimedPose
from bunraku.capture.take import MAX_TAKE_POSES, make_motion
from bunraku.motion.bvh_writer import write_bvh
from bunraku.terminal import call_when_stopped, err, print_statistics

POLL_INTERVAL_S = 0.02
"""Interval at which poses that wait for a missing one are looked at."""
STATUS_INTERVAL_S = 0.25


class CaptureReceiver(asyncio.DatagramProtocol):
    """Endpoint of a capture tool: keeps the poses of the take. Invalid packets are counted, and change nothing."""

    def __init__(self, assembler: FrameAssembler, clock: Callable[[], float] = time.monotonic) -> None:
        """`clock` returns seconds."""
        self.session = CaptureSession(assembler)
        self.poses: list[TimedPose] = []
        self.datagrams = self.invalid = 0
        self.problem: str | None = None
        """Reason for the last invalid packet."""
        self._clock = clock

    @property
    def is_full(self) -> bool:
        """True if the take has reached its maximum."""
        return len(self.poses) >= MAX_TAKE_POSES

    def datagram_received(self, data: bytes, addr: tuple[Any, ...]) -> None:  # noqa: ARG002
        """Add the poses that a packet completes."""
        self.datagrams += 1
        self._add(lambda: self.session.receive(data, self._clock()))

    def poll(self) -> None:
        """Add the poses that have waited for a missing one."""
        self._add(lambda: self.session.poll(self._clock()))

    def _add(self, advance: Callable[[], list[TimedPose]]) -> None:
        try:
            poses = advance()
        except UnreadableCapture as error:
            self.invalid += 1
            self.problem = str(error)
        else:
            self.poses += poses[: MAX_TAKE_POSES - len(self.poses)]


def record_take(
    assembler: FrameAssembler,
    name: str,
    address: tuple[str, int],
    path: Path,
    *,
    fps: float,
    seconds: float | None,
    as_json: bool,
) -> None:
    """Receive packets at `address` until Ctrl-C or for `seconds`, save the take at `path`, and print statistics.

    Args:
        assembler: Parser of the protocol.
        name: Name of the protocol, for the status line.
        address: Host and port to listen at.
        path: New BVH file.
        fps: Frames per second of the file.
        seconds: Duration from the first pose; None: until Ctrl-C.
        as_json: Print JSON, and no status line.
    """
    if path.exists():
        raise typer.BadParameter(f"{path} exists already; give another name", param_hint="FILE")
    if not path.parent.is_dir():
        raise typer.BadParameter(f"there is no folder {path.parent}", param_hint="FILE")
    receiver = CaptureReceiver(assembler)
    # Ctrl-C ends the take, which is saved
    with contextlib.suppress(KeyboardInterrupt):
        asyncio.run(_receive(receiver, name, address, seconds, is_quiet=as_json or not err.is_terminal))
    calibration = receiver.session.calibration
    if calibration is None or not receiver.poses:
        err.print(explain_empty_take(receiver, name, address), markup=False)
        raise typer.Exit(1)
    motion = make_motion(calibration.figure, receiver.poses, fps)
    _write_new_file(path, write_bvh(motion))
    counts = receiver.session.statistics
    print_statistics(
        {
            "file": str(path),
            "seconds": round(motion.duration, 3),
            "frames": motion.frame_count,
            "received": counts.released,
            "duplicates": counts.duplicates,
            "late": counts.late,
            "invalid": receiver.invalid,
            "problem": receiver.problem,
            "assumptions": calibration.assumptions,
        },
        as_json,
    )


async def _receive(
    receiver: CaptureReceiver, name: str, address: tuple[str, int], seconds: float | None, *, is_quiet: bool
) -> None:
    host, port = address
    stopped = asyncio.Event()
    call_when_stopped(stopped.set)
    try:
        transport, _ = await asyncio.get_running_loop().create_datagram_endpoint(
            lambda: receiver, local_addr=(host, port)
        )
    except OSError as error:
        raise typer.BadParameter(f"cannot listen at {host}, port {port}: {error.strerror}") from None
    bound_port = transport.get_extra_info("sockname")[1]
    err.print(f"Listening for {name} at {host}, port {bound_port}. Ctrl-C ends the take.", markup=False)
    status = None if is_quiet else err.status(Text("waiting for the first packet"))
    try:
        with status or contextlib.nullcontext():
            await _follow(receiver, status, seconds, stopped)
    finally:
        transport.close()


async def _follow(
    receiver: CaptureReceiver, status: Status | None, seconds: float | None, stopped: asyncio.Event
) -> None:
    """Poll the receiver and show its state until the take is over."""
    shown_at, shown_poses = time.monotonic(), 0
    while not (receiver.is_full or stopped.is_set()):
        poses = receiver.poses
        if seconds is not None and poses and poses[-1].time_s - poses[0].time_s >= seconds:
            return
        await asyncio.sleep(POLL_INTERVAL_S)
        receiver.poll()
        now = time.monotonic()
        if status is not None and now - shown_at >= STATUS_INTERVAL_S:
            rate = (len(poses) - shown_poses) / (now - shown_at)
            status.update(Text(_describe(receiver, rate)))
            shown_at, shown_poses = now, len(poses)


def _describe(receiver: CaptureReceiver, rate: float) -> str:
    problem = f"; {receiver.invalid} invalid packets: {receiver.problem}" if receiver.invalid else ""
    if not receiver.datagrams:
        return "waiting for the first packet"
    if receiver.session.calibration is None:
        return f"calibrating: stand upright{problem}"
    poses = receiver.poses
    seconds = poses[-1].time_s - poses[0].time_s if poses else 0.0
    return f"{seconds:.1f} s, {rate:.0f} poses/s{problem}"


def explain_empty_take(receiver: CaptureReceiver, name: str, address: tuple[str, int]) -> str:
    """Return the reason for which a take has no pose, and what to do."""
    host, port = address
    if not receiver.datagrams:
        return (
            f"No packet arrived at {host}, port {port}. Check address and port in the capture tool; "
            "for a tool on another machine, listen with --host 0.0.0.0."
        )
    if receiver.problem is not None:
        return f"No packet could be read as {name}: {receiver.problem}"
    return "The take is too short: the first second calibrates, and poses follow it."


def _write_new_file(path: Path, data: bytes) -> None:
    """Write a file completely or not at all; raise `typer.Exit` if that is not possible."""
    partial = path.with_name(f"{path.stem}.{os.getpid()}.part{path.suffix}")
    try:
        with partial.open("wb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        if path.exists():
            err.print(f"{path} has appeared during the take, which is in {partial}", markup=False)
            raise typer.Exit(1)
        partial.rename(path)
    except OSError as error:
        partial.unlink(missing_ok=True)
        err.print(f"Cannot write {path}: {error.strerror}", markup=False)
        raise typer.Exit(1) from None

"""Live capture: receives the packets of a capture tool, shows progress, saves a take as BVH, and streams the poses."""

from __future__ import annotations

import asyncio
import contextlib
import os
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import typer
from rich.status import Status
from rich.text import Text

from bunraku.capture.errors import UnreadableCapture
from bunraku.capture.frame import FrameAssembler
from bunraku.capture.session import CaptureSession, TimedPose
from bunraku.capture.take import MAX_TAKE_POSES, make_motion
from bunraku.motion.bvh_writer import write_bvh
from bunraku.motion.skeleton import Figure
from bunraku.terminal import call_at_input, call_when_stopped, err, print_statistics, run_request

if TYPE_CHECKING:
    from bunraku.capture_stream import PerformanceStream, StreamOptions

POLL_INTERVAL_S = 0.005
"""Interval at which poses that wait for a missing one are looked at."""
STATUS_INTERVAL_S = 0.25


class CaptureOptions(NamedTuple):
    """Options of a capture: at least one of `file` and `stream` is given."""

    file: Path | None
    """New BVH file."""
    stream: StreamOptions | None
    address: tuple[str, int]
    """Host and port to listen at."""
    fps: float
    """Frames per second of the file."""
    seconds: float | None
    """Duration from the first pose; None: until Ctrl-C."""
    as_json: bool
    """Print JSON, and no status line."""


class CaptureReceiver(asyncio.DatagramProtocol):
    """Endpoint of a capture tool: passes its poses on, and keeps those of the take.

    Invalid packets are counted, and change nothing.
    """

    def __init__(
        self,
        assembler: FrameAssembler,
        clock: Callable[[], float] = time.monotonic,
        *,
        keeps_poses: bool = True,
        on_poses: Callable[[Sequence[TimedPose]], object] = lambda _: None,
    ) -> None:
        """`clock` returns seconds."""
        self.session = CaptureSession(assembler)
        self.figure: Figure | None = None
        """Figure of the first calibration, which later ones keep."""
        self.poses: list[TimedPose] = []
        """Poses of the take."""
        self.first_s = self.last_s = 0.0
        """Times of the first and the last pose."""
        self.datagrams = self.invalid = self.pose_count = 0
        self.problem: str | None = None
        """Reason for the last invalid packet."""
        self._clock = clock
        self._keeps_poses = keeps_poses
        self._on_poses = on_poses

    @property
    def is_full(self) -> bool:
        """True if the take has reached its maximum."""
        return len(self.poses) >= MAX_TAKE_POSES

    @property
    def duration_s(self) -> float:
        """Time from the first to the last pose."""
        return self.last_s - self.first_s

    def datagram_received(self, data: bytes, addr: tuple[Any, ...]) -> None:  # noqa: ARG002
        """Add the poses that a packet completes."""
        self.datagrams += 1
        self._add(lambda: self.session.receive(data, self._clock()))

    def poll(self) -> None:
        """Add the poses that have waited for a missing one."""
        self._add(lambda: self.session.poll(self._clock()))

    def recalibrate(self) -> None:
        """Begin another calibration. Poses continue meanwhile, and the figure stays."""
        self.session.recalibrate()

    def _add(self, advance: Callable[[], list[TimedPose]]) -> None:
        try:
            poses = advance()
        except UnreadableCapture as error:
            self.invalid += 1
            self.problem = str(error)
            return
        if self.figure is None and self.session.calibration is not None:
            self.figure = self.session.calibration.figure
        if poses:
            self.first_s, self.last_s = self.first_s if self.pose_count else poses[0].time_s, poses[-1].time_s
            self.pose_count += len(poses)
            if self._keeps_poses:
                self.poses += poses[: MAX_TAKE_POSES - len(self.poses)]
            self._on_poses(poses)


def run_capture(assembler: FrameAssembler, name: str, options: CaptureOptions) -> None:
    """Receive packets until Ctrl-C or for `options.seconds`, save and stream the poses, and print statistics.

    Args:
        assembler: Parser of the protocol.
        name: Name of the protocol, for the status line.
        options: File, server, address and output of the command.
    """
    file, stream = options.file, None
    if file is not None:
        _check_new_file(file)
    if options.stream is not None:
        from bunraku.capture_stream import PerformanceStream

        stream = PerformanceStream(options.stream, print_stage_address)
        run_request(stream.check, options.stream.server)
    receiver = CaptureReceiver(
        assembler, keeps_poses=file is not None, on_poses=stream.offer if stream is not None else lambda _: None
    )
    capture = _Capture(receiver, stream, name, options)
    # Ctrl-C ends the take, which is saved
    with contextlib.suppress(KeyboardInterrupt):
        asyncio.run(capture.run())
    calibration = receiver.session.calibration
    if calibration is None or receiver.figure is None or not receiver.pose_count:
        err.print(explain_empty_take(receiver, name, options.address), markup=False)
        raise typer.Exit(1)
    counts = receiver.session.statistics
    statistics: dict[str, Any] = {}
    if file is not None:
        motion = make_motion(receiver.figure, receiver.poses, options.fps)
        _write_new_file(file, write_bvh(motion))
        statistics |= {"file": str(file), "seconds": round(motion.duration, 3), "frames": motion.frame_count}
    if stream is not None:
        statistics |= stream.statistics()
    statistics |= {
        "received": counts.released,
        "missing": counts.missing,
        "duplicates": counts.duplicates,
        "late": counts.late,
        "invalid": receiver.invalid,
        "problem": receiver.problem,
        "assumptions": calibration.assumptions,
    }
    print_statistics(statistics, options.as_json)
    if stream is not None and stream.problem is not None:
        err.print(stream.problem)
        raise typer.Exit(1)


def print_stage_address(page: str) -> None:
    """Print where a live performer is seen."""
    err.print(f"Live on the stage at {page}", markup=False, soft_wrap=True)


class _Capture:
    """Running capture."""

    def __init__(
        self, receiver: CaptureReceiver, stream: PerformanceStream | None, name: str, options: CaptureOptions
    ) -> None:
        self._receiver = receiver
        self._stream = stream
        self._name = name
        self._options = options
        self._stopped = asyncio.Event()
        self._streaming: asyncio.Task[None] | None = None
        self._shown_at, self._shown_poses = time.monotonic(), 0

    async def run(self) -> None:
        """Receive until the capture is over, then end the performance."""
        host, port = self._options.address
        call_when_stopped(self._stopped.set)
        try:
            transport, _ = await asyncio.get_running_loop().create_datagram_endpoint(
                lambda: self._receiver, local_addr=(host, port)
            )
        except OSError as error:
            raise typer.BadParameter(f"cannot listen at {host}, port {port}: {error.strerror}") from None
        bound_port = transport.get_extra_info("sockname")[1]
        err.print(
            f"Listening for {self._name} at {host}, port {bound_port}. c and Enter calibrates again, Ctrl-C ends the "
            f"{'take' if self._stream is None else 'performance'}.",
            markup=False,
            soft_wrap=True,
        )
        call_at_input(self._on_input)
        is_quiet = self._options.as_json or not err.is_terminal
        status = None if is_quiet else err.status(Text("waiting for the first packet"))
        try:
            with status or contextlib.nullcontext():
                await self._follow(status)
        finally:
            transport.close()
            if self._streaming is not None:
                self._streaming.cancel()
                await asyncio.gather(self._streaming, return_exceptions=True)

    def _on_input(self, line: str) -> None:
        if line.lower() == "c":
            self._receiver.recalibrate()

    async def _follow(self, status: Status | None) -> None:
        """Poll the receiver, stream and show the state until the capture is over."""
        receiver, seconds = self._receiver, self._options.seconds
        while not (self._stopped.is_set() or self._is_over()):
            if seconds is not None and receiver.duration_s >= seconds:
                return
            await asyncio.sleep(POLL_INTERVAL_S)
            receiver.poll()
            if self._stream is not None and self._streaming is None and receiver.figure is not None:
                self._streaming = asyncio.create_task(self._stream.run(receiver.figure), name="performance")
            if status is not None and time.monotonic() - self._shown_at >= STATUS_INTERVAL_S:
                self._show(status)

    def _is_over(self) -> bool:
        """Return whether nothing is left to do: the performance has ended, or the take is full."""
        is_streaming = self._stream is not None and not (self._streaming is not None and self._streaming.done())
        is_recording = self._options.file is not None and not self._receiver.is_full
        return not (is_streaming or is_recording)

    def _show(self, status: Status) -> None:
        now = time.monotonic()
        rate = (self._receiver.pose_count - self._shown_poses) / (now - self._shown_at)
        status.update(Text(describe_capture(self._receiver, self._stream, rate)))
        self._shown_at, self._shown_poses = now, self._receiver.pose_count


def describe_capture(receiver: CaptureReceiver, stream: PerformanceStream | None, poses_per_s: float) -> str:
    """Return the state of a capture in words."""
    problem = f"; {receiver.invalid} invalid packets: {receiver.problem}" if receiver.invalid else ""
    if not receiver.datagrams:
        return "waiting for the first packet"
    if receiver.figure is None:
        return f"calibrating: stand upright{problem}"
    counts = receiver.session.statistics
    words = [f"{receiver.duration_s:.1f} s", f"{poses_per_s:.0f} poses/s"]
    if receiver.session.is_calibrating:
        words.insert(0, "calibrating again: stand upright")
    if counts.missing or counts.late:
        words.append(f"{counts.missing} lost, {counts.late} late")
    if stream is not None:
        words.append(stream.problem or stream.describe(poses_per_s))
    return f"{', '.join(words)}{problem}"


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


def _check_new_file(path: Path) -> None:
    if path.exists():
        raise typer.BadParameter(f"{path} exists already; give another name", param_hint="FILE")
    if not path.parent.is_dir():
        raise typer.BadParameter(f"there is no folder {path.parent}", param_hint="FILE")


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

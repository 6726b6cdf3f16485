"""Sending of a session to another tool: watches it, sends each frame, and shows progress and statistics."""

from __future__ import annotations

import asyncio
import contextlib
import math
import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, NamedTuple, Self
from urllib.parse import quote

import typer
from rich.text import Text

from bunraku.terminal import call_when_stopped, err, parse_resource_address, print_statistics, run_request

if TYPE_CHECKING:
    from bunraku.client.datagram import DatagramSender
    from bunraku.client.stage_output import StageOutput
    from bunraku.client.viewer import Viewer
    from bunraku.playout.block_store import Pose

STATUS_INTERVAL_S = 0.25
"""Interval between updates of the status line."""


class SendOptions(NamedTuple):
    """Options that all formats have."""

    session: str
    """Id or address of the session."""
    fps: float
    """Frames per second."""
    seconds: float | None
    """Duration; None: until Ctrl-C."""
    server: str
    """Address of the server, if `session` is only an id."""
    token: str | None
    """Access token of the server, if it needs one."""
    as_json: bool
    """Print JSON, and no status line."""


def send_session(
    make_output: Callable[[Viewer, DatagramSender], StageOutput],
    format_name: str,
    target: tuple[str, int],
    options: SendOptions,
) -> None:
    """Watch a session and send its frames until Ctrl-C or for `options.seconds`, then print statistics.

    Args:
        make_output: Function that creates the output; it gets the viewer and the socket.
        format_name: Name of the format, for the status line.
        target: Host and port of the receiver.
        options: Session, rate and duration, server and output of the command.
    """
    from bunraku.client import Client, StreamEnded, Viewer
    from bunraku.client.datagram import AddressError, DatagramSender
    from bunraku.client.stage_output import PerformerMissing

    session, fps, seconds, server, token, as_json = options
    base, kind, session_id = parse_resource_address(session)
    if kind == "motions":
        raise typer.BadParameter("this is the address of a motion; give a session", param_hint="SESSION")
    statistics: dict[str, Any] = {}

    async def request() -> None:
        async with Client(base or server, token) as client:
            await client.session(session_id)
            viewer = Viewer(client.socket_url(f"/v1/sessions/{quote(session_id, safe='')}/stream"), token=token)
        async with DatagramSender(*target) as sender:
            output, started_at = make_output(viewer, sender), time.monotonic()
            with _StatusLine(format_name, sender, output, is_shown=err.is_terminal and not as_json) as status_line:

                def on_frame(reference: int, pose: Pose) -> None:
                    output.on_frame(reference, pose)
                    status_line.update()

                watching = asyncio.create_task(viewer.watch(seconds or math.inf, on_frame, frame_interval=1 / fps))
                call_when_stopped(watching.cancel)
                try:
                    # a stopped command still ends its output
                    await asyncio.wait((watching,))
                    if not watching.cancelled():
                        watching.result()
                finally:
                    watching.cancel()
                    output.finish()
                    statistics.update(
                        seconds=round(time.monotonic() - started_at, 3),
                        frames=output.frames,
                        datagrams=sender.sent,
                        bytes=sender.sent_bytes,
                        dropped=sender.dropped,
                        problem=sender.problem,
                        performers=len(viewer.performers),
                        lights=sum(track.kind == "light" for track in viewer.scenes),
                        reconnects=viewer.reconnects,
                    )

    try:
        with contextlib.suppress(KeyboardInterrupt):
            run_request(request, base or server)
    except StreamEnded as error:
        err.print(f"The stream ended: {error}")
        raise typer.Exit(1) from None
    except PerformerMissing as error:
        raise typer.BadParameter(str(error), param_hint="--performer") from None
    except AddressError as error:
        raise typer.BadParameter(str(error), param_hint="--to") from None
    if statistics:
        print_statistics(statistics, as_json)


class _StatusLine:
    """Line with the frame rate and the last problem, while entered and if `is_shown`."""

    def __init__(self, format_name: str, sender: DatagramSender, output: StageOutput, *, is_shown: bool) -> None:
        self._prefix = f"{format_name} to {sender.host}, port {sender.port}"
        self._sender = sender
        self._output = output
        self._status = err.status(Text(f"{self._prefix}: connecting")) if is_shown else None
        self._updated_at = time.monotonic()
        self._frames = self._dropped = 0

    def __enter__(self) -> Self:
        if self._status is not None:
            self._status.start()
        return self

    def __exit__(self, *_: object) -> None:
        if self._status is not None:
            self._status.stop()

    def update(self) -> None:
        """Update the text if the last update is `STATUS_INTERVAL_S` ago."""
        now = time.monotonic()
        if self._status is None or now - self._updated_at < STATUS_INTERVAL_S:
            return
        rate = (self._output.frames - self._frames) / (now - self._updated_at)
        problem = f"; {self._sender.problem}" if self._sender.dropped > self._dropped else ""
        self._status.update(Text(f"{self._prefix}: {rate:.0f} frames/s{problem}. Ctrl-C stops."))
        self._updated_at, self._frames, self._dropped = now, self._output.frames, self._sender.dropped

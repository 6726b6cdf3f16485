"""Fan-out to a thousand viewers: `make bench-fanout`. The last line printed is one JSON object.

Everything is on loopback, each server and each load generator in a separate process. Parts, all unless some are named:

- `rates`: CPU time of the sender per message, 600 viewers x 60 Hz x 120 bytes, for ours (the stream service as
  `bunraku up` serves it, overlays published on its bus), `send_bytes` of FastAPI, `websockets.broadcast`, Socket.IO,
  the WebSocket of nats-server, and a plain loop of `send` in C, alternating every second. Ratios are computed within
  a round; the median of the rounds is reported.
- `latency`: 1,000 viewers at 20 Hz x 3 frames: from publication to the viewer's socket.
- `blocks`: 4,000 viewers of the blocks of a playing motion, about one per second each.
- `stalled`: of 300 viewers one stops reading, another never answers: the data queued for the first, the time until the
  second is disconnected, and the latency of the others, alternating with and without a viewer that stops reading.
- `memory`: memory growth of the server's process with 2,000 viewers.
- `crowd`: a real session with a real puppeteer; 1,000 viewers join within 5 s and leave at once; measured are the
  overlays of 50 other viewers that stay throughout.
"""

from __future__ import annotations

import asyncio
import json
import re
import resource
import socket
import statistics
import sys
import tempfile
import time
from collections.abc import Callable
from contextlib import ExitStack
from importlib.util import find_spec
from itertools import pairwise
from pathlib import Path
from shutil import which
from typing import Any

from bunraku.client.api import Client
from bunraku.client.puppeteer import ControlRefused, Puppeteer
from tests.bench.arguments import parse_parts
from tests.bench.fanout_processes import LineProcess, start_c_sender
from tests.raw_client import upgrade_request

OVERLAY_LEAD_MS = 60.0
"""Lead time of overlays: from their publication until they are due, milliseconds."""
STREAM_PATH = "/v1/sessions/bench/stream"
Figures = dict[str, float | None]


def measure_send_cost(
    viewers: int = 600, size: int = 120, hertz: int = 60, rounds: int = 7, seconds: float = 1.0
) -> Figures:
    """Measure the CPU time of each sender per message, in alternation."""
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="bunraku-bench-")))
        senders: dict[str, LineProcess] = {}
        c_sender = stack.enter_context(start_c_sender(folder, viewers, size, hertz))
        if c_sender is not None:
            senders["c"] = c_sender
        else:
            print("no C compiler (cc): the ceiling is not measured")
        kinds = ["bunraku", "fastapi", "websockets"]
        if find_spec("socketio") is not None:
            kinds.append("socketio")
        else:
            print("python-socketio is not installed: Socket.IO is not measured")
        for kind in kinds:
            senders[kind] = stack.enter_context(LineProcess.start_module("fanout_senders", kind, size, hertz))
        if which("nats-server") is not None:
            senders["nats"] = stack.enter_context(LineProcess.start_module("fanout_nats", size, hertz))
        else:
            print("nats-server is not installed: its WebSocket is not measured")
        protocols = {"c": ("raw",), "bunraku": ("bunraku", STREAM_PATH), "nats": ("nats", "/")}
        protocols["socketio"] = ("socketio", "/socket.io/?EIO=4&transport=websocket")
        drains = {}
        for kind, sender in senders.items():
            protocol = protocols.get(kind, ("websocket", "/"))
            drains[kind] = stack.enter_context(
                LineProcess.start_module("fanout_drain", sender.read_line(), viewers, *protocol)
            )
            assert drains[kind].read_line() == "ready"
        found: dict[str, list[float]] = {kind: [] for kind in senders}
        for round_number in range(rounds + 1):
            for kind, sender in senders.items():
                # Socket.IO is so slow that two rounds suffice
                if kind == "socketio" and round_number > 2:
                    continue
                drains[kind].request("")
                sent = sender.request(seconds)
                time.sleep(0.1)
                received = drains[kind].request("")
                assert received["open"] == viewers, f"{kind}: {received['open']} of {viewers} connections are open"
                assert received["frames"] >= 0.95 * sent["messages"] > 0, f"{kind}: received {received} of {sent}"
                if round_number:
                    found[kind].append(sent["cpu"] / sent["messages"] * 1e6)
    figures: Figures = {f"us_{kind}": _round(statistics.median(values)) for kind, values in found.items()}

    def ratio(over: str, under: str) -> float | None:
        if over not in found:
            return None
        pairs = zip(found[over], found[under], strict=False)
        return _round(statistics.median(a / b for a, b in pairs))

    figures["times_fastapi"] = ratio("fastapi", "bunraku")
    figures["times_websockets"] = ratio("websockets", "bunraku")
    figures["times_socketio"] = ratio("socketio", "bunraku")
    figures["times_nats"] = ratio("nats", "bunraku")
    figures["share_of_c_ceiling"] = ratio("c", "bunraku")
    return figures


def measure_latency(viewers: int = 1000, hertz: int = 20, seconds: float = 8.0) -> Figures:
    """Measure the time from the publication of an overlay to its arrival at viewers."""
    with (
        LineProcess.start_module("fanout_senders", "bunraku", 66, hertz) as sender,
        _start_viewers(sender.read_line()) as crowd,
    ):
        crowd.request(f"join {viewers} 300")
        sender.request(1)
        crowd.request("count")
        sent = sender.request(seconds)
        received = crowd.request("figures")
    assert received["joined"] == viewers
    assert received["overlays"] >= 0.99 * sent["messages"]
    return {
        "latency_ms_p50": _round(received["overlay_late_ms_p50"] + OVERLAY_LEAD_MS),
        "latency_ms_p99": _round(received["overlay_p99"] + OVERLAY_LEAD_MS),
        "latency_cores": _round(sent["cpu"] / seconds),
    }


def measure_block_delivery(viewers: int = 4000, sample: int = 200, seconds: float = 12.0) -> Figures:
    """Measure the delivery of blocks of a playing motion: `sample` viewers measure latency, the others count bytes."""
    with LineProcess.start_module("fanout_senders", "playing", 66, 20) as sender:
        port = sender.read_line()
        drain = LineProcess.start_module("fanout_drain", port, viewers - sample, "bunraku", STREAM_PATH)
        with drain, _start_viewers(port) as crowd:
            assert drain.read_line() == "ready"
            crowd.request(f"join {sample} 100")
            # the initial prefetch is not counted
            time.sleep(2)
            drain.request("")
            crowd.request("count")
            before, begun = sender.processor_seconds(), time.monotonic()
            time.sleep(seconds)
            passed, cores = time.monotonic() - begun, sender.processor_seconds() - before
            received, sampled = drain.request(""), crowd.request("figures")
    # pings to the counting viewers are frames too, one in twelve seconds
    sent = received["frames"] + sampled["blocks"]
    return {
        "blocks_viewers": received["open"] + sampled["joined"],
        "blocks_per_second": _round(sent / passed),
        "blocks_cores": _round(cores / passed, 3),
        "blocks_us_each": _round(cores * 1e6 / max(sent, 1)),
        "blocks_spread_ms": _round(sampled["block_spread"]),
        "blocks_late": sampled["stalls"],
    }


def measure_stalled_viewer(viewers: int = 300, hertz: int = 60, seconds: float = 10.0, rounds: int = 7) -> Figures:
    """Measure a viewer that stops reading, one that never answers, and their effect on the others."""
    with LineProcess.start_module("fanout_senders", "bunraku", 228, hertz) as sender:
        port = sender.read_line()
        with _start_viewers(port) as crowd:
            crowd.request(f"join {viewers} 300")
            sender.request(1)

            def latency_p99_ms() -> float:
                crowd.request("count")
                sender.request(3)
                return float(crowd.request("figures")["overlay_p99"]) + OVERLAY_LEAD_MS

            without, with_stalled = [], []
            for _ in range(rounds):
                without.append(latency_p99_ms())
                one = _open_viewer(int(port), 4096)
                # until its buffers are full
                sender.request(2)
                with_stalled.append(latency_p99_ms())
                one.close()
            silent, stalled = _open_viewer(int(port)), _open_viewer(int(port), 4096)
            begun = time.monotonic()
            max_queued = 0
            while time.monotonic() - begun < seconds:
                sender.request(1)
                max_queued = max(max_queued, sender.request("waiting")["most"])
                assert not _read_available(silent, 0.0)[1]
            number = sender.request("waiting")["number"]
            data, ended = _read_available(stalled, 1.0)
            disconnected_s = None
            while disconnected_s is None and time.monotonic() - begun < 30:
                if _read_available(silent, 0.2)[1]:
                    disconnected_s = time.monotonic() - begun
    # overlays of 228 bytes: the frame header and type, then the sequence number
    found = re.finditer(rb"\x82\x7e\x00\xe4\x05.(..)", data, re.DOTALL)
    numbers = [int.from_bytes(one[1], "little") for one in found]
    assert not ended
    assert numbers[-1] == number, "the last overlay received is not the newest"
    return {
        "stalled_waiting_bytes": max_queued,
        "stalled_skipped": max(b - a for a, b in pairwise(numbers)) - 1,
        "others_p99_ms_without": _round(statistics.median(without)),
        "others_p99_ms": _round(statistics.median(with_stalled)),
        "others_p99_ratio": _round(statistics.median(b / a for a, b in zip(without, with_stalled, strict=True))),
        "half_open_gone_s": _round(disconnected_s),
    }


def measure_memory(viewers: int = 2000) -> Figures:
    """Measure the memory growth of the server's process."""
    with (
        LineProcess.start_module("fanout_senders", "playing", 66, 20) as sender,
        _start_viewers(sender.read_line()) as crowd,
    ):
        # allocations for the first viewers are not counted
        crowd.request("join 20 100")
        time.sleep(1)
        before = sender.resident_kilobytes()
        joined = crowd.request(f"join {viewers} 300")
        time.sleep(3)
        after = sender.resident_kilobytes()
    return {"memory_kb_viewer": _round((after - before) / (joined["joined"] - 20)), "memory_viewers": joined["joined"]}


def measure_join_burst(viewers: int = 1000, initial_viewers: int = 50) -> Figures:
    """Measure the overlays of other viewers while many join and leave, with a limb controlled throughout."""
    with tempfile.TemporaryDirectory(prefix="bunraku-bench-") as folder:
        bunraku = str(Path(sys.executable).parent / "bunraku")
        with LineProcess([bunraku, "up", "--demo", "--port", "0", "--data", folder]) as server:
            url = None
            while url is None:
                found = re.search(r"is at (http://\S+)/", server.read_line())
                url = found[1] if found else None
            return asyncio.run(_run_join_burst(server, url, viewers, initial_viewers))


async def _run_join_burst(server: LineProcess, url: str, viewers: int, initial_viewers: int) -> Figures:
    async with Client(url) as client:
        session = await client.first_session()
        assert session is not None
        stream = client.socket_url(f"/v1/sessions/{session}/stream")
        ended = asyncio.Event()

        async def control_limb() -> None:
            async with Puppeteer(client, session, "bench") as puppeteer:
                number = 0
                while not ended.is_set():
                    try:
                        await puppeteer.target("left_hand", 0.45, -0.2 + 0.2 * (number // 30 % 2), 0.5)
                    except ControlRefused:
                        # the limb is not claimed yet, or was lost while this process was not scheduled
                        await puppeteer.claim("left_hand")
                    number += 1
                    await asyncio.sleep(1 / 60)

        with (
            LineProcess.start_module("fanout_crowd", stream, "talk") as staying,
            LineProcess.start_module("fanout_crowd", stream) as joining,
        ):

            async def measure_during(action: Callable[[], Any], wait_s: float) -> tuple[dict[str, Any], float]:
                await asyncio.to_thread(staying.request, "count")
                before, begun = server.processor_seconds(), time.monotonic()
                await asyncio.to_thread(action)
                await asyncio.sleep(wait_s)
                cores = (server.processor_seconds() - before) / (time.monotonic() - begun)
                return await asyncio.to_thread(staying.request, "figures"), cores

            controlling = asyncio.create_task(control_limb())
            await asyncio.to_thread(staying.request, f"join {initial_viewers} 50")
            # wait until everything that loads after the start is loaded
            await asyncio.sleep(8)
            calm, _ = await measure_during(lambda: None, 6)
            burst, cores = await measure_during(lambda: joining.request(f"join {viewers} {viewers / 5}"), 1)
            joined = await asyncio.to_thread(joining.request, "figures")
            all_present, present_cores = await measure_during(lambda: None, 5)
            leaving, _ = await measure_during(lambda: joining.request(f"leave {viewers}"), 3)
            ended.set()
            await controlling
    return {
        "crowd_joined": joined["joined"],
        "crowd_join_ms_p99": joined["join_ms_p99"],
        "crowd_join_cores": _round(cores),
        "crowd_there_cores": _round(present_cores),
        "overlay_gap_ms_p99_calm": calm["overlay_gap_ms_p99"],
        "overlay_gap_ms_p99_joining": burst["overlay_gap_ms_p99"],
        "overlay_gap_ms_p99_there": all_present["overlay_gap_ms_p99"],
        "overlay_gap_ms_p99_leaving": leaving["overlay_gap_ms_p99"],
        "overlay_late_ms_p99_calm": _round(calm["overlay_p99"]),
        "overlay_late_ms_p99_joining": _round(burst["overlay_p99"]),
        "overlay_late_ms_p99_there": _round(all_present["overlay_p99"]),
        "overlay_late_ms_p99_leaving": _round(leaving["overlay_p99"]),
    }


def _start_viewers(port: str) -> LineProcess:
    return LineProcess.start_module("fanout_crowd", f"ws://127.0.0.1:{port}{STREAM_PATH}")


def _open_viewer(port: int, buffer: int | None = None) -> socket.socket:
    """Open a viewer as a plain socket; `buffer` is its SO_RCVBUF."""
    viewer = socket.socket()
    if buffer is not None:
        viewer.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, buffer)
    viewer.settimeout(20)
    viewer.connect(("127.0.0.1", port))
    viewer.sendall(upgrade_request(f"ws://127.0.0.1:{port}{STREAM_PATH}"))
    return viewer


def _read_available(viewer: socket.socket, wait: float) -> tuple[bytes, bool]:
    """Read until nothing arrives for `wait` seconds; return the data, and whether the server closed the connection."""
    viewer.settimeout(wait)
    data = b""
    try:
        while data_part := viewer.recv(1 << 16):
            data += data_part
    except (BlockingIOError, TimeoutError):
        return data, False
    except ConnectionError:
        pass
    return data, True


def _round(value: float | None, digits: int = 2) -> float | None:
    return None if value is None else round(value, digits)


BENCHMARKS: dict[str, Callable[[], Figures]] = {
    "rates": measure_send_cost,
    "latency": measure_latency,
    "blocks": measure_block_delivery,
    "stalled": measure_stalled_viewer,
    "memory": measure_memory,
    "crowd": measure_join_burst,
}


def main() -> None:
    parts = parse_parts(__doc__, BENCHMARKS)
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    if soft < 16_384:
        resource.setrlimit(resource.RLIMIT_NOFILE, (min(hard, 16_384), hard))
        if hard < 16_384:
            print(f"only {hard} files may be open (ulimit -Hn): parts with more viewers will fail")
    figures: Figures = {}
    for part in parts:
        begun = time.monotonic()
        found = BENCHMARKS[part]()
        figures |= found
        print(f"{part}, {time.monotonic() - begun:.0f} s")
        for name, value in found.items():
            print(f"  {name:<32}{'-' if value is None else value:>10}")
    print(json.dumps(figures))


if __name__ == "__main__":
    main()

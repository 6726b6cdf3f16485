"""A thousand viewers: `make bench-fanout`. The last line printed is one JSON object.

Everything is on loopback, each server and each crowd in a process of its own. Parts, all of them unless some are named:

- `rates`: processor time per message of who sends, 600 viewers x 60 Hz x 120 bytes, of ours (the stream service as
  `bunraku up` serves it, overlays published on its bus), FastAPI's `send_bytes`, `websockets.broadcast`, Socket.IO,
  nats-server's WebSocket and a bare loop of `send` in C, in turns of a second. Ratios are of one round, and the median
  of the rounds is told.
- `latency`: 1,000 viewers at 20 Hz x 3 frames: from the publishing to the viewer's socket.
- `blocks`: 4,000 viewers of a playing motion's blocks, about one a second each.
- `stalled`: of 300 viewers one stops reading, another never answers: what waits for the one, when the other is gone,
  and what the rest see of it, in turns with and without one who stops reading.
- `memory`: what the server's process grows by with 2,000 viewers.
- `crowd`: a real session with a real puppeteer; 1,000 join within 5 s and leave at once, and the overlays of 50 who
  were there before and stay are looked at.
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
"""How far ahead of their publishing overlays are due."""
STREAM_PATH = "/v1/sessions/bench/stream"
Figures = dict[str, float | None]


def measure_send_cost(
    viewers: int = 600, size: int = 120, hertz: int = 60, rounds: int = 7, seconds: float = 1.0
) -> Figures:
    """Processor time of who sends, side by side."""
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="bunraku-bench-")))
        senders: dict[str, LineProcess] = {}
        bare = stack.enter_context(start_c_sender(folder, viewers, size, hertz))
        if bare is not None:
            senders["c"] = bare
        else:
            print("no C compiler (cc): without the ceiling")
        kinds = ["bunraku", "fastapi", "websockets"]
        if find_spec("socketio") is not None:
            kinds.append("socketio")
        else:
            print("python-socketio is not installed: without Socket.IO")
        for kind in kinds:
            senders[kind] = stack.enter_context(LineProcess.start_module("fanout_senders", kind, size, hertz))
        if which("nats-server") is not None:
            senders["nats"] = stack.enter_context(LineProcess.start_module("fanout_nats", size, hertz))
        else:
            print("nats-server is not installed: without its WebSocket")
        speech = {"c": ("raw",), "bunraku": ("bunraku", STREAM_PATH), "nats": ("nats", "/")}
        speech["socketio"] = ("socketio", "/socket.io/?EIO=4&transport=websocket")
        drains = {}
        for kind, sender in senders.items():
            said = speech.get(kind, ("websocket", "/"))
            drains[kind] = stack.enter_context(
                LineProcess.start_module("fanout_drain", sender.read_line(), viewers, *said)
            )
            assert drains[kind].read_line() == "ready"
        found: dict[str, list[float]] = {kind: [] for kind in senders}
        for turn in range(rounds + 1):
            for kind, sender in senders.items():
                # what Socket.IO takes needs no seven rounds
                if kind == "socketio" and turn > 2:
                    continue
                drains[kind].request("")
                sent = sender.request(seconds)
                time.sleep(0.1)
                came = drains[kind].request("")
                assert came["open"] == viewers, f"{kind}: {came['open']} of {viewers} are still there"
                assert came["frames"] >= 0.95 * sent["messages"] > 0, f"{kind}: {came} of {sent}"
                if turn:
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
    """From the publishing of an overlay to the viewers' sockets."""
    with (
        LineProcess.start_module("fanout_senders", "bunraku", 66, hertz) as sender,
        _start_viewers(sender.read_line()) as crowd,
    ):
        crowd.request(f"join {viewers} 300")
        sender.request(1)
        crowd.request("count")
        sent = sender.request(seconds)
        came = crowd.request("figures")
    assert came["joined"] == viewers
    assert came["overlays"] >= 0.99 * sent["messages"]
    return {
        "latency_ms_p50": _round(came["overlay_late_ms_p50"] + OVERLAY_LEAD_MS),
        "latency_ms_p99": _round(came["overlay_p99"] + OVERLAY_LEAD_MS),
        "latency_cores": _round(sent["cpu"] / seconds),
    }


def measure_block_delivery(viewers: int = 4000, sample: int = 200, seconds: float = 12.0) -> Figures:
    """Blocks of a motion that plays: `sample` of the viewers are looked at, of the others what comes is counted."""
    with LineProcess.start_module("fanout_senders", "playing", 66, 20) as sender:
        port = sender.read_line()
        drain = LineProcess.start_module("fanout_drain", port, viewers - sample, "bunraku", STREAM_PATH)
        with drain, _start_viewers(port) as crowd:
            assert drain.read_line() == "ready"
            crowd.request(f"join {sample} 100")
            # what is sent ahead at first is not counted
            time.sleep(2)
            drain.request("")
            crowd.request("count")
            before, begun = sender.processor_seconds(), time.monotonic()
            time.sleep(seconds)
            passed, cores = time.monotonic() - begun, sender.processor_seconds() - before
            came, seen = drain.request(""), crowd.request("figures")
    # pings of the silent are frames too, one in twelve seconds
    sent = came["frames"] + seen["blocks"]
    return {
        "blocks_viewers": came["open"] + seen["joined"],
        "blocks_per_second": _round(sent / passed),
        "blocks_cores": _round(cores / passed, 3),
        "blocks_us_each": _round(cores * 1e6 / max(sent, 1)),
        "blocks_spread_ms": _round(seen["block_spread"]),
        "blocks_late": seen["stalls"],
    }


def measure_stalled_viewer(viewers: int = 300, hertz: int = 60, seconds: float = 10.0, rounds: int = 7) -> Figures:
    """One who stops reading, and one who never answers."""
    with LineProcess.start_module("fanout_senders", "bunraku", 228, hertz) as sender:
        port = sender.read_line()
        with _start_viewers(port) as crowd:
            crowd.request(f"join {viewers} 300")
            sender.request(1)

            def late() -> float:
                crowd.request("count")
                sender.request(3)
                return float(crowd.request("figures")["overlay_p99"]) + OVERLAY_LEAD_MS

            without, beside = [], []
            for _ in range(rounds):
                without.append(late())
                one = _open_viewer(int(port), 4096)
                # until it is full
                sender.request(2)
                beside.append(late())
                one.close()
            silent, stopped = _open_viewer(int(port)), _open_viewer(int(port), 4096)
            begun = time.monotonic()
            most = 0
            while time.monotonic() - begun < seconds:
                sender.request(1)
                most = max(most, sender.request("waiting")["most"])
                assert not _read_available(silent, 0.0)[1]
            number = sender.request("waiting")["number"]
            data, ended = _read_available(stopped, 1.0)
            gone = None
            while gone is None and time.monotonic() - begun < 30:
                if _read_available(silent, 0.2)[1]:
                    gone = time.monotonic() - begun
    # overlays of 228 bytes: their heads, then the number
    found = re.finditer(rb"\x82\x7e\x00\xe4\x05.(..)", data, re.DOTALL)
    numbers = [int.from_bytes(one[1], "little") for one in found]
    assert not ended
    assert numbers[-1] == number, "the newest is what comes last"
    return {
        "stalled_waiting_bytes": most,
        "stalled_skipped": max(b - a for a, b in pairwise(numbers)) - 1,
        "others_p99_ms_without": _round(statistics.median(without)),
        "others_p99_ms": _round(statistics.median(beside)),
        "others_p99_ratio": _round(statistics.median(b / a for a, b in zip(without, beside, strict=True))),
        "half_open_gone_s": _round(gone),
    }


def measure_memory(viewers: int = 2000) -> Figures:
    """What the server's process grows by."""
    with (
        LineProcess.start_module("fanout_senders", "playing", 66, 20) as sender,
        _start_viewers(sender.read_line()) as crowd,
    ):
        # what is made with the first viewers is not the others'
        crowd.request("join 20 100")
        time.sleep(1)
        before = sender.resident_kilobytes()
        joined = crowd.request(f"join {viewers} 300")
        time.sleep(3)
        after = sender.resident_kilobytes()
    return {"memory_kb_viewer": _round((after - before) / (joined["joined"] - 20)), "memory_viewers": joined["joined"]}


def measure_join_burst(viewers: int = 1000, initial_viewers: int = 50) -> Figures:
    """A flash crowd and its going, with a limb pulled all the while."""
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

        async def pull() -> None:
            async with Puppeteer(client, session, "bench") as puppeteer:
                number = 0
                while not ended.is_set():
                    try:
                        await puppeteer.target("left_hand", 0.45, -0.2 + 0.2 * (number // 30 % 2), 0.5)
                    except ControlRefused:
                        # not yet, or lost while this process was kept from running
                        await puppeteer.claim("left_hand")
                    number += 1
                    await asyncio.sleep(1 / 60)

        with (
            LineProcess.start_module("fanout_crowd", stream, "talk") as stay,
            LineProcess.start_module("fanout_crowd", stream) as come,
        ):

            async def during(what: Callable[[], Any], rest: float) -> tuple[dict[str, Any], float]:
                await asyncio.to_thread(stay.request, "count")
                before, begun = server.processor_seconds(), time.monotonic()
                await asyncio.to_thread(what)
                await asyncio.sleep(rest)
                cores = (server.processor_seconds() - before) / (time.monotonic() - begun)
                return await asyncio.to_thread(stay.request, "figures"), cores

            pulling = asyncio.create_task(pull())
            await asyncio.to_thread(stay.request, f"join {initial_viewers} 50")
            # what is loaded after the start is loaded
            await asyncio.sleep(8)
            calm, _ = await during(lambda: None, 6)
            flash, cores = await during(lambda: come.request(f"join {viewers} {viewers / 5}"), 1)
            joined = await asyncio.to_thread(come.request, "figures")
            many, many_cores = await during(lambda: None, 5)
            storm, _ = await during(lambda: come.request(f"leave {viewers}"), 3)
            ended.set()
            await pulling
    return {
        "crowd_joined": joined["joined"],
        "crowd_join_ms_p99": joined["join_ms_p99"],
        "crowd_join_cores": _round(cores),
        "crowd_there_cores": _round(many_cores),
        "overlay_gap_ms_p99_calm": calm["overlay_gap_ms_p99"],
        "overlay_gap_ms_p99_joining": flash["overlay_gap_ms_p99"],
        "overlay_gap_ms_p99_there": many["overlay_gap_ms_p99"],
        "overlay_gap_ms_p99_leaving": storm["overlay_gap_ms_p99"],
        "overlay_late_ms_p99_calm": _round(calm["overlay_p99"]),
        "overlay_late_ms_p99_joining": _round(flash["overlay_p99"]),
        "overlay_late_ms_p99_there": _round(many["overlay_p99"]),
        "overlay_late_ms_p99_leaving": _round(storm["overlay_p99"]),
    }


def _start_viewers(port: str) -> LineProcess:
    return LineProcess.start_module("fanout_crowd", f"ws://127.0.0.1:{port}{STREAM_PATH}")


def _open_viewer(port: int, buffer: int | None = None) -> socket.socket:
    """A viewer of no more than a socket; `buffer` is what its system keeps for it."""
    viewer = socket.socket()
    if buffer is not None:
        viewer.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, buffer)
    viewer.settimeout(20)
    viewer.connect(("127.0.0.1", port))
    viewer.sendall(upgrade_request(f"ws://127.0.0.1:{port}{STREAM_PATH}"))
    return viewer


def _read_available(viewer: socket.socket, wait: float) -> tuple[bytes, bool]:
    """What there is to be read, until nothing comes for `wait` seconds; and whether the server has ended it."""
    viewer.settimeout(wait)
    data = b""
    try:
        while part := viewer.recv(1 << 16):
            data += part
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

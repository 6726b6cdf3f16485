"""Capture tool of `live.py`: sends a clip as VMC bundles in real time, forth and back, until its input ends.

`python -m tests.bench.live_sender CLIP PORT FPS FAULTY [HOST]`: prints the time of `time.monotonic` of the first frame
in microseconds. With FAULTY 1 the network loses, repeats, delays and reorders, and the sender's clock is 200 ppm fast.
"""

from __future__ import annotations

import socket
import struct
import sys
import threading
import time
from pathlib import Path

from bunraku.motion.readers.bvh import parse_bvh
from tests.capture.network_faults import Arrival, Faults, simulate_arrivals
from tests.capture.vmc_performer import make_bundle, make_message, make_messages, perform

MAX_SECONDS = 600
CLEAN = Faults(loss=0.0, duplicates=0.0, jitter_s=0.0, reordering=0.0, drift=0.0, offset_s=0.0)


def bounce(number: int, count: int) -> int:
    """Return which of `count` frames is the frame `number` of a clip that runs forth and back for ever."""
    phase = number % (2 * count - 2)
    return phase if phase < count else 2 * count - 2 - phase


def make_bundles(path: Path, fps: float) -> list[bytes]:
    """Return the frames of a clip at about `fps` frames per second as bundles without their time, the last message."""
    performance = perform(parse_bvh(path.read_bytes()))
    step = max(round(performance.fps / fps), 1)
    frames = range(0, performance.frame_count, step)
    return [make_bundle(make_messages(performance, frame, 0.0)[:-1]) for frame in frames]


def add_time(bundle: bytes, seconds: float) -> bytes:
    """Return a bundle with the message of its time."""
    message = make_message("/VMC/Ext/T", seconds).dgram
    return bundle + struct.pack(">i", len(message)) + message


def send(
    bundles: list[bytes], arrivals: list[Arrival], begin_s: float, address: tuple[str, int], ended: threading.Event
) -> None:
    """Send the frames at the times of their arrivals, which the network has delayed already."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        for arrival in arrivals:
            if ended.wait(max(begin_s + arrival.arrival_s - time.monotonic(), 0.0)):
                return
            packet = add_time(bundles[bounce(arrival.number, len(bundles))], arrival.sender_s)
            sender.sendto(packet, address)


def main() -> None:
    clip, port, fps, faulty, *hosts = sys.argv[1:]
    bundles = make_bundles(Path(clip), float(fps))
    faults = Faults(reordering_s=0.05, offset_s=12.5) if int(faulty) else CLEAN
    arrivals = simulate_arrivals(round(MAX_SECONDS * float(fps)), float(fps), faults, 1)
    begin_s = time.monotonic() + 0.1
    print(round(begin_s * 1e6), flush=True)
    ended = threading.Event()

    def wait_for_end() -> None:
        sys.stdin.read()
        ended.set()

    threading.Thread(target=wait_for_end, daemon=True).start()
    send(bundles, arrivals, begin_s, (hosts[0] if hosts else "127.0.0.1", int(port)), ended)


if __name__ == "__main__":
    main()

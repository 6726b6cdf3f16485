"""Files that a parser or decoder would expand, follow or trust: rows 7 and 13."""

from __future__ import annotations

import asyncio
import gzip
import io
import struct
import zipfile
from collections.abc import Iterator

from tests.attack.raw_socket import fetch
from tests.attack.registry import Report, Target, attack
from tests.servers import make_bvh_clip

FILE_TIMEOUT_S = 90.0
"""Time for the answer to a file that a worker may read until its own time limit, seconds."""
MEGABYTE = 1 << 20


async def _upload(target: Target, report: Report, path: str, name: str, data: bytes) -> None:
    """Upload a file and require an answer that is no failure; delete what it has become."""
    token = target.tokens["ingest"]
    response = await fetch(target, "POST", path, token=token, body=data, timeout_s=FILE_TIMEOUT_S)
    status = response.status if response is not None else None
    report.count(str(status))
    report.require(status is not None and (status < 500 or status == 507), f"{name}: {status}")
    if response is not None and status == 201:
        await fetch(target, "DELETE", f"/v1/motions/{response.json()['id']}", token=token)


def _zip_bomb() -> bytes:
    archive = io.BytesIO()
    with zipfile.ZipFile(archive, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as file:
        file.writestr("a.bvh", bytes(64 * MEGABYTE))
    return archive.getvalue()


def _motions() -> Iterator[tuple[str, bytes]]:
    clip = make_bvh_clip(1.0, 5)
    joint = b"JOINT j\n{\nOFFSET 0 1 0\nCHANNELS 3 Zrotation Xrotation Yrotation\nEnd Site\n{\nOFFSET 0 1 0\n}\n}\n"
    yield "a million joints", b"HIERARCHY\nROOT a\n{\nOFFSET 0 0 0\nCHANNELS 0\n" + joint * 600_000 + b"}\nMOTION\n"
    yield (
        "one line of 60 MB",
        b"HIERARCHY ROOT a { OFFSET 0 0 0 CHANNELS 1 Xrotation } MOTION Frames: 1 Frame Time: 0.1 "
        + b"1 " * (30 * MEGABYTE),
    )
    yield "one word of 60 MB", clip + b"1" * (60 * MEGABYTE)
    yield "60 MB of line ends", b"HIERARCHY" + b"\n" * (60 * MEGABYTE)
    yield "a name of 60 MB", b"HIERARCHY\nROOT " + b"a" * (60 * MEGABYTE)
    yield "a channel count of 60 MB", b"HIERARCHY ROOT a { OFFSET 0 0 0 CHANNELS " + b"9" * (60 * MEGABYTE)
    yield "UTF-16", b"\xff\xfe" + clip.decode().encode("utf-16-le")
    yield "UTF-16 cut in a surrogate", b"\xff\xfe" + b"\x00\xd8" * (20 * MEGABYTE)
    yield "names with control characters", clip.replace(b"JOINT ", b"JOINT \x1b[2J\xe2\x80\xae", 3)
    yield "frame time of a day", clip.replace(b"Frame Time: 0.", b"Frame Time: 86400.", 1)
    yield "smallest frame time", clip.replace(b"Frame Time: 0.", b"Frame Time: 0.0000000000000", 1)
    yield "largest numbers", clip.replace(b" 0.", b" 179769313486231570000000000000000000000e270", 50)
    yield "gzip bomb", gzip.compress(bytes(256 * MEGABYTE), 9)
    yield "zip bomb", _zip_bomb()
    yield "XML with entities", b'<!DOCTYPE a [<!ENTITY b SYSTEM "file:///etc/passwd">]><a>&b;</a>'


@attack(7, "4xx or the motion; others' uploads go on", seconds=20.0, probe="upload", max_rss_growth_mb=80.0)
async def motions_that_expand(target: Target, report: Report) -> None:
    """Upload motions with a million joints, endless lines and words, hostile encodings, and archives."""
    # fewer than one subject may have at the same time
    slots = asyncio.Semaphore(6)

    async def run(number: int, name: str, data: bytes) -> None:
        async with slots:
            await _upload(target, report, f"/v1/motions?filename=a{number}.bvh", name, data)

    running = asyncio.gather(*(run(number, *one) for number, one in enumerate(_motions())))
    await asyncio.sleep(2.0)
    await report.reach_peak()
    await running


def wave_file(size: int = 200_000, **fields: int) -> bytes:
    """Return a WAV file with silence, of whose header fields some may lie."""
    values = {
        "riff": 36 + size,
        "form": 1,
        "channels": 1,
        "rate": 48_000,
        "bytes": 96_000,
        "align": 2,
        "bits": 16,
        "data": size,
    }
    values.update(fields)
    head = struct.pack("<4sI4s4sI", b"RIFF", values["riff"], b"WAVE", b"fmt ", 16)
    head += struct.pack("<HHIIHH", *(values[name] for name in ("form", "channels", "rate", "bytes", "align", "bits")))
    return head + struct.pack("<4sI", b"data", values["data"]) + bytes(size)


def _ogg_page(payload: bytes, number: int = 0, flags: int = 2, position: int = 0) -> bytes:
    """Return an Ogg page without a valid checksum (RFC 3533, section 6)."""
    segments = [255] * (len(payload) // 255) + [len(payload) % 255]
    return (
        struct.pack("<4sBBqIIIB", b"OggS", 0, flags, position, 1, number, 0, len(segments)) + bytes(segments) + payload
    )


def _sounds(url: str) -> Iterator[tuple[str, bytes]]:
    """Yield sound files; some name `url`, which nothing may open."""
    opus_head = struct.pack("<8sBBHIHB", b"OpusHead", 1, 2, 65_535, 48_000, 0, 0)
    tag_size = bytes((127,) * 4)
    playlist = f"#EXTM3U\n#EXTINF:10,\n{url}\n#EXT-X-ENDLIST\n".encode()
    yield "HLS playlist", playlist
    yield "playlist behind RIFF", b"RIFF\x24\0\0\0WAVE" + playlist
    yield "playlist behind an ID3 tag", b"ID3\x04\0\0\0\0\0\x0a" + bytes(10) + playlist
    yield "concat script", f"ffconcat version 1.0\nfile '{url}'\nfile '/etc/passwd'\n".encode()
    yield (
        "SDP",
        f"v=0\no=- 0 0 IN IP4 127.0.0.1\nc=IN IP4 127.0.0.1\nm=audio {url.rpartition(':')[2]} RTP/AVP 0\n".encode(),
    )
    yield (
        "DASH manifest",
        f"<MPD><Period><AdaptationSet><Representation><BaseURL>{url}</BaseURL></Representation></AdaptationSet></Period></MPD>".encode(),
    )
    yield "QuickTime reference", b"\0\0\0\x08wide\0\0\0\x50moov" + f"rdrf....url {url}".encode()
    yield (
        "URL in an ID3 tag",
        b"ID3\x04\0\0\0\0\x02\0WXXX"
        + struct.pack(">I", 240)
        + b"\0\0"
        + url.encode().ljust(246, b"\0")
        + b"\xff\xfb\x90\0" * 400,
    )
    yield "ID3 tag of 256 MB", b"ID3\x04\0\0" + tag_size + bytes(1_000)
    yield "nested ID3 tags", (b"ID3\x04\0\0\0\0\0\0" * 100_000) + b"\xff\xfb\x90\0" * 400
    yield "WAV that is longer than declared", wave_file(riff=0, data=0)
    yield "WAV that is shorter than declared", wave_file(riff=0xFFFFFFFF, data=0xFFFFFFFF)
    yield "WAV with a data size of 2^32 - 2", wave_file(data=0xFFFFFFFE)
    for name, value in (
        ("channels", 0),
        ("channels", 65_535),
        ("rate", 0),
        ("rate", 0xFFFFFFFF),
        ("align", 0),
        ("align", 65_535),
        ("bits", 0),
        ("bits", 65_535),
        ("form", 0xFFFE),
        ("form", 2),
        ("form", 0x0055),
        ("bytes", 0),
    ):
        yield f"WAV with {name} {value}", wave_file(**{name: value})
    yield "WAV of silence for 350 s", wave_file(60 * MEGABYTE, riff=36 + 60 * MEGABYTE)
    yield "RF64", wave_file().replace(b"RIFF", b"RF64", 1)
    yield "FLAC with an endless picture", b"fLaC\x86\xff\xff\xff" + bytes(5_000)
    yield (
        "FLAC of 2^36 samples",
        b"fLaC\x80\0\0\x22"
        + b"\x10\0\x10\0"
        + bytes(6)
        + b"\x0b\xb8\x02\xff\xff\xff\xff\xff"
        + bytes(16)
        + bytes(1_000),
    )
    yield "Ogg without an end", _ogg_page(opus_head) + _ogg_page(b"OpusTags" + b"\xff" * 8, 1, 0) * 5_000
    yield (
        "Opus with pre-skip only",
        _ogg_page(opus_head) + _ogg_page(b"OpusTags" + bytes(8), 1, 0) + _ogg_page(b"\xfc\xff\xfe", 2, 4, 1 << 62),
    )
    yield (
        "chained streams of other rates",
        b"".join(
            _ogg_page(struct.pack("<8sBBHIHB", b"OpusHead", 1, channels, 0, 48_000, 0, 0))
            for channels in (1, 2, 1, 2) * 500
        ),
    )
    yield (
        "comments of 4 GB",
        _ogg_page(opus_head) + _ogg_page(b"OpusTags" + struct.pack("<I", 0xFFFFFFF0) + bytes(100), 1, 0),
    )


@attack(13, "no file of a sound opens a connection; 4xx or the sound", seconds=10.0)
async def sounds_that_refer_elsewhere(target: Target, report: Report) -> None:
    """Upload playlists, references and damaged sounds that name a listener on this machine, which nothing may call."""
    called = 0

    async def on_call(_: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        nonlocal called
        called += 1
        writer.close()

    listener = await asyncio.start_server(on_call, "127.0.0.1", 0)
    async with listener:
        url = f"http://127.0.0.1:{listener.sockets[0].getsockname()[1]}"
        path = f"/v1/motions/{target.motion}/audio?filename=a.wav"
        for name, data in _sounds(url):
            await _upload(target, report, path, name, data)
    report.require(not called, f"the server called a listener {called} times")


@attack(7, "4xx; nothing is stored under these names")
async def hostile_filenames(target: Target, report: Report) -> None:
    """Upload a sound under names that mean something to a shell, a file system, FFmpeg or a header."""
    names = (
        "concat:/etc/passwd|/etc/hosts",
        "http://127.0.0.1:1/a.wav",
        "file:///etc/passwd",
        "pipe:0",
        "../../../etc/cron.d/a",
        "a.wav%0d%0aX-Injected: 1",
        "a%00.bvh",
        "-y",
        "$(id).wav",
        "CON",
        "~root",
        "a%2Fb%5Cc.wav",
        "%E2%80%AEvaw.a",
        "%22; a=b.wav",
    )
    for name in names:
        path = f"/v1/motions/{target.motion}/audio?filename={name.replace(' ', '%20')}"
        response = await fetch(
            target, "POST", path, token=target.tokens["ingest"], body=wave_file(9_600), timeout_s=30.0
        )
        status = response.status if response is not None else None
        report.count(str(status))
        report.require(status in (200, 201, 422), f"{name}: {status}")
        report.require(response is None or "x-injected" not in response.headers, f"{name}: a header was injected")
        if response is not None and status == 201:
            await fetch(target, "DELETE", f"/v1/motions/{response.json()['id']}", token=target.tokens["ingest"])

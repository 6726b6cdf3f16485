"""What a job does to keep a session: its log, replayed over the dance, to an encoded motion of its own."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from threading import Lock

import numpy as np

from bunraku.backing.library import StoredMotion, pack
from bunraku.backing.order import FPS, Keyframe, Order
from bunraku.codec.encode import EncodedMotion, Grade, encode_motion
from bunraku.codec.scene import Scene
from bunraku.codec.scene_encode import encode_scene
from bunraku.ingest.making import FIRST_SECONDS, MOST_FRAMES_AT_BEST
from bunraku.ingest.results import Made, Refused
from bunraku.ingest.showing import MissingDance, Showing
from bunraku.marionette.log import DamagedLog, Log
from bunraku.motion.skeleton import Motion


def keep(
    motion: str,
    order: Order,
    log: bytes,
    dances: dict[str, StoredMotion],
    progress: Callable[[float], None] = lambda _: None,
) -> Made | Refused:
    """Replay `log` as `order` says and encode what was seen as the motion of this id; `dances` are those that the log
    is over, by id. A session that changed its dance meanwhile is kept from where its last one came on.

    `progress` is told the share encoded, 0..1.
    """
    replayed = Log.unpack(log)
    showing = Showing(replayed, dances)
    times = [order.begin + round(number * 1e6 / FPS) for number in range(order.frames)]
    states = [showing.timeline_at(time) for time in times]
    last = states[-1]
    if last is None:
        return Refused("Nothing to keep", "no dance was on the stage in this interval", field="seconds")
    times = times[1 + max((n for n, s in enumerate(states) if s is None or s.motion != last.motion), default=-1) :]
    if replayed.known_from > times[0]:
        seconds = max(order.end - replayed.known_from, 0) * 1e-6
        return Refused(
            "Too long ago",
            f"limbs were held for so long that only the last {seconds:.0f} s of this session can be kept",
            field="seconds",
            hint="let all limbs go for a moment: from there on it is remembered",
        )
    try:
        poses = list(showing.poses(times))
    except (MissingDance, DamagedLog) as error:
        return Refused("Cannot be replayed", str(error))
    dance = dances[last.motion]
    # every one of these instants has a timeline and its dances
    shown = [pose for pose in poses if pose is not None]
    performed = [
        Motion(one.track.figure, float(FPS), *(np.stack(part) for part in zip(*seen, strict=True)))
        for one, seen in zip(dance.dances, zip(*shown, strict=True), strict=True)
    ]
    kept = performed[0]
    grade: Grade = "best" if kept.frames * len(performed) <= MOST_FRAMES_AT_BEST else "live"
    telling, before = Lock(), 0.0

    def told(share: float) -> None:
        with telling:
            progress(before + share / len(performed))

    try:
        scenes = [encode_scene(film(order.camera, times), first_seconds=FIRST_SECONDS)] if order.camera else []
    except ValueError as error:
        return Refused("Invalid camera", str(error), field="camera")
    each: list[EncodedMotion] = []
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        for one, danced in zip(dance.dances, performed, strict=True):
            before = len(each) / len(performed)
            encoded = encode_motion(danced, first_seconds=FIRST_SECONDS, grade=grade, progress=told, spread=pool.map)
            # the dance's front: a hand that was pulled turns no stage
            each.append(replace(encoded, front=one.front, place=one.place))
    encoded, *others = each
    return Made(
        pack(motion, encoded, scenes, others),
        {
            "duration": kept.duration,
            "fps": kept.fps,
            "frames": kept.frames,
            "blocks": encoded.track.blocks,
            "tracks": [*(["motion"] * len(each)), *(scene.track.kind for scene in scenes)],
            **({"performers": len(each)} if others else {}),
            "rates": encoded.describe()["rates"],
            "kept_from": dance.id,
        },
    )


def film(keyframes: Sequence[Keyframe], times: Sequence[int]) -> Scene:
    """The camera of `keyframes` at clock `times`: linear between two of them, still before the first and after the
    last. Raises ValueError where it is no camera."""
    keys = np.array(keyframes, dtype=np.float64)
    values = np.stack([np.interp(np.array(times, dtype=np.float64), keys[:, 0], column) for column in keys.T[1:]], 1)
    return Scene("camera", float(FPS), values)

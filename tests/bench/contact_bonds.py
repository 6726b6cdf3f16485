"""Bonds of two hands under random motions, inputs and faults: part `bonds` of `make bench-contact`.

Each scene has one or two dancers who sway and turn, and one to two puppeteers whose inputs jump and drag. The link
loses 5 % of the inputs, delays 10 % by up to 80 ms and doubles 5 %. In a part of the scenes the led hand is claimed,
given up and claimed by another, or a puppeteer falls silent. Figures:

    bond_mm_max          distance of two hands that have met, where the limits of both shoulders allow it
    bond_accel_max       acceleration of a bonded hand, arm lengths/s^2, relative to the frame that the shoulders carry,
                         likewise; the share of frames at a shoulder's limit is `limited_ratio`
    join_ms_max          time from the begin of a bond until both hands have met, likewise
    languages_differ_max largest difference of Python and TypeScript, metres
    replay_exact         whether a second run of the same commands (of every tenth scene), and the log, give every
                         overlay to the last bit
"""

from __future__ import annotations

import json
import subprocess
import tempfile
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cache
from itertools import groupby
from multiprocessing import Pool
from pathlib import Path
from typing import Any

import numpy as np

from bunraku.kernels import load_kernels
from bunraku.marionette.limb_target import InputKind
from bunraku.marionette.ownership import LimbGrant, LimbInput, LimbPair
from bunraku.marionette.solver.limb_solver import LimbSolver
from bunraku.playout.overlay_buffer import pack_overlay
from bunraku.playout.session_log import SessionLog
from bunraku.runtime.compile_cache import compile_cache_folder
from tests.marionette.bond.bonded_stage import FRAME_INTERVAL_US, BondedStage, random_dance
from tests.vectors import bonds as bond_vectors

WEB = Path(__file__).resolve().parents[2] / "services" / "web"
SCENES = 10_000
FRAMES = 90
BOND_FRAME = 8
ORIGIN_US = 10**15
LANGUAGE_CASES = 200
REPLAY_STRIDE = 10
"""One scene of so many of each kind is played again."""


@cache
def _load_solver() -> LimbSolver:
    solver: LimbSolver = load_kernels("marionette").compile_solver(compile_cache_folder("marionette"))
    return solver


@dataclass
class SceneFigures:
    """Figures of one scene."""

    frames: int = 0
    limited: int = 0
    gap_mm: float = 0.0
    acceleration: float = 0.0
    join_ms: float = 0.0
    is_replayed: bool = True
    ends: list[str] = field(default_factory=list)


class Scene:
    """One stage, its puppeteers and the link of their inputs, all determined by a seed."""

    def __init__(self, seed: int) -> None:
        self._random = random = np.random.default_rng(seed)
        self.kind = ("own", "led", "taken", "two")[seed % 4]
        if self.kind == "own":
            dances = [random_dance(FRAMES, random, (0.0, 0.9, 0.0), float(random.uniform(0.0, 6.0)))]
            self.pair: LimbPair = (0, 1)
        else:
            side, distance = random.uniform(-0.3, 0.3), random.uniform(0.5, 0.8)
            turns = random.uniform(-0.5, 0.5, 2)
            dances = [
                random_dance(FRAMES, random, (0.0, 0.9, 0.0), float(turns[0])),
                random_dance(FRAMES, random, (float(side), 0.9, float(distance)), 3.14 + float(turns[1])),
            ]
            self.pair = (int(random.integers(2)), 4 + int(random.integers(2)))
        self.stage = BondedStage(dances, self.pair)
        self.stage.marionettes.use_solver(_load_solver())
        self._epochs: dict[int, int] = {}
        self._holders: dict[int, str] = {}
        self._in_flight: list[tuple[int, str, LimbInput]] = []
        self._sequence = 0
        self._goals = {limb: self._random_goal() for limb in self.pair}
        self._silence = range(0)
        if random.random() < 0.15:
            begin = int(random.integers(40, FRAMES))
            self._silence = range(begin, begin + int(random.integers(4, 40)))

    def play(self) -> None:
        """Play all frames."""
        for frame in range(FRAMES):
            now = ORIGIN_US + frame * FRAME_INTERVAL_US
            self._act(frame, now)
            self._receive(now)
            self.stage.ownership.expire(now)
            self.stage.show(frame, now)

    def _act(self, frame: int, now: int) -> None:
        first, second = self.pair
        ownership = self.stage.ownership
        if frame == 2:
            self._claim(first, "ada", now)
            if self.kind == "own":
                self._claim(second, "ada", now)
        if frame == BOND_FRAME:
            ownership.bond(first, second, "ada", now)
        if frame == BOND_FRAME + 1 and self.kind == "two":
            self._claim(second, "bo", now)
        if self.kind == "taken" and frame in (30, 60):
            if second in self._holders:
                # the bond ends with the release; ada bonds the hand again, and cy claims it
                ownership.release(second, self._holders.pop(second), self._epochs[second], now)
                ownership.bond(first, second, "ada", now)
            self._claim(second, "bo" if frame == 30 else "cy", now)
        if frame in self._silence:
            return
        for limb, holder in self._holders.items():
            ownership.keep_alive(holder, [limb], now)
            if self._random.random() < 0.03:
                self._goals[limb] = self._random_goal()
            elif self._random.random() < 0.5:
                self._goals[limb] = self._goals[limb] + self._random.normal(size=3) * 0.02
            else:
                continue
            kind = InputKind.TARGET if self._random.random() < 0.8 else InputKind.VELOCITY
            self._send(limb, holder, kind, now)

    def _claim(self, limb: int, holder: str, now: int) -> None:
        grant = self.stage.ownership.claim(limb, holder, now)
        if isinstance(grant, LimbGrant):
            self._epochs[limb], self._holders[limb] = grant.epoch, holder

    def _send(self, limb: int, holder: str, kind: InputKind, now: int) -> None:
        random = self._random
        self._sequence += 1
        x, y, z = self._goals[limb].tolist()
        sample = LimbInput(limb, kind, self._epochs[limb], self._sequence, now, (x, y, z))
        if random.random() < 0.05:
            return
        for _ in range(1 + int(random.random() < 0.05)):
            delay = random.integers(2_000, 8_000) + (random.random() < 0.10) * random.integers(20_000, 80_000)
            self._in_flight.append((now + int(delay), holder, sample))

    def _receive(self, now: int) -> None:
        arrived = sorted(
            (item for item in self._in_flight if item[0] <= now), key=lambda item: (item[0], item[2].sequence)
        )
        self._in_flight = [item for item in self._in_flight if item[0] > now]
        for received, holder, sample in arrived:
            self.stage.ownership.apply_input(holder, sample, received)

    def _random_goal(self) -> Any:
        x, y, z = self._random.normal(size=3)
        goal = np.array([x, y, abs(z)])
        return goal / np.linalg.norm(goal) * self._random.uniform(0.25, 1.0)


def measure_scene(seed: int) -> SceneFigures:
    """Play a scene, some of them twice, and return its figures."""
    scene = Scene(seed)
    scene.play()
    stage = scene.stage
    figures = SceneFigures(ends=[reason for _, reason in stage.ownership.take_ended_bonds()])
    gaps = stage.gaps_mm()
    accelerations = [[0.0, 0.0, *stage.accelerations(side)] for side in (0, 1)]
    for is_bonded, group in groupby(range(FRAMES), key=lambda frame: stage.shares[frame] is not None):
        frames = list(group)
        if not is_bonded:
            continue
        joined = [frame for frame in frames if stage.joined[frame]]
        figures.frames += len(frames)
        figures.limited += sum(stage.limited[frame] for frame in frames)
        if joined and not any(stage.limited[frames[0] : joined[0] + 1]):
            figures.join_ms = max(figures.join_ms, (joined[0] - frames[0]) * FRAME_INTERVAL_US / 1e3)
        free = [frame for frame in frames if not any(stage.limited[frame - 2 : frame + 1])]
        figures.gap_mm = max([figures.gap_mm, *(gaps[frame] for frame in joined if frame in free)])
        figures.acceleration = max(
            [figures.acceleration, *(accelerations[side][frame] for frame in free for side in (0, 1))]
        )
    figures.is_replayed = _is_logged(stage)
    if seed // 4 % REPLAY_STRIDE == 0:
        again = Scene(seed)
        again.play()
        figures.is_replayed &= again.stage.overlays == stage.overlays
    return figures


def _is_logged(stage: BondedStage) -> bool:
    """Return whether the log of a stage gives back every published message."""
    log = SessionLog()
    messages = [
        pack_overlay(number, number * FRAME_INTERVAL_US, [overlay])
        for number, overlay in enumerate(stage.overlays)
        if overlay
    ]
    for number, message in enumerate(messages):
        log.add_message(number * FRAME_INTERVAL_US, message)
    return [message.pack() for message in SessionLog.unpack(log.pack()).messages()] == messages


def measure_languages(count: int = LANGUAGE_CASES) -> float:
    """Return the largest difference of a position between Python and TypeScript, metres, over random cases."""
    random = np.random.default_rng(11)
    leads = ((True, True), (True, False), (False, True))
    cases = [
        bond_vectors.make_case(
            1_000 + n, leads[n % 3], float(random.uniform(0.3, 1.0)), float(random.uniform(0.0, 0.2))
        )
        for n in range(count)
    ]
    with tempfile.TemporaryDirectory() as folder:
        script = str(Path(folder) / "bonds.mjs")
        bundle = ["npx", "rolldown", "tests/bench/bonds.ts", "--file", script, "--platform", "node", "--format", "esm"]
        subprocess.run(bundle, cwd=WEB, capture_output=True, timeout=120, check=True)
        request = json.dumps({"seconds": bond_vectors.FRAME_S, "cases": cases})
        done = subprocess.run(["node", script], input=request, capture_output=True, text=True, timeout=600, check=True)
    return float(json.loads(done.stdout.splitlines()[-1])["difference"])


def measure_bonds(scenes: int, processes: int = 1) -> dict[str, Any]:
    """Return the figures of this module over a number of scenes; prints a table by kind of scene."""
    with Pool(processes) as pool:
        found = list(pool.imap(measure_scene, range(scenes), chunksize=16))
    print(f"{'scene':<8}{'frames':>9}{'limited':>9}{'gap mm':>9}{'accel':>9}{'join ms':>9}  ends")
    for kind, name in enumerate(("own", "led", "taken", "two")):
        print("".join(_table_row(name, found[kind::4])))
    return {
        "scenes": scenes,
        "bond_mm_max": round(max(one.gap_mm for one in found), 4),
        "bond_accel_max": round(max(one.acceleration for one in found), 2),
        "join_ms_max": round(max(one.join_ms for one in found)),
        "limited_ratio": round(sum(one.limited for one in found) / sum(one.frames for one in found), 4),
        "languages_differ_max": measure_languages(),
        "replay_exact": all(one.is_replayed for one in found),
    }


def _table_row(name: str, found: list[SceneFigures]) -> Iterator[str]:
    ends = Counter(reason for one in found for reason in one.ends)
    yield f"{name:<8}{sum(one.frames for one in found):>9}{sum(one.limited for one in found):>9}"
    yield f"{max(one.gap_mm for one in found):>9.4f}{max(one.acceleration for one in found):>9.2f}"
    yield f"{max(one.join_ms for one in found):>9.0f}  {dict(sorted(ends.items()))}"

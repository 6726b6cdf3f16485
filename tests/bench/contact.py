"""Contacts of performers: `make bench-contact`. The last line printed is one JSON object.

Each part is a module with a function that prints its table and returns its figures. `ARGUMENTS="--only feet"` runs some
of them, `--scenes 200` fewer scenes of bonds.
"""

from __future__ import annotations

import argparse
import json
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

from tests.bench.contact_bonds import SCENES, measure_bonds
from tests.bench.contact_crowd import measure_crowd
from tests.bench.contact_feet import measure_feet
from tests.bench.contact_latency import measure_latency
from tests.bench.contact_robot import measure_robot

PARTS: dict[str, Callable[[Path, int], dict[str, Any]]] = {
    "feet": lambda shared, _: measure_feet(shared),
    "bonds": lambda _, scenes: measure_bonds(scenes, os.cpu_count() or 1),
    "latency": lambda _shared, _scenes: measure_latency(),
    "crowd": lambda _shared, _scenes: measure_crowd(),
    "robot": lambda *_: measure_robot(),
}
"""Parts by name: functions of the folder of the recorded clips and the number of scenes."""


def parse_arguments(arguments: list[str] | None = None) -> tuple[list[str], int]:
    """Return the parts to run and the number of scenes; exit with an error for an unknown part."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--only", default=",".join(PARTS), help=f"comma-separated, of {', '.join(PARTS)}; default: all")
    parser.add_argument("--scenes", type=int, default=SCENES, help=f"random scenes of bonds; default: {SCENES:,}")
    parsed = parser.parse_args(arguments)
    names: list[str] = parsed.only.split(",")
    for name in names:
        if name not in PARTS:
            parser.error(f"unknown part {name!r}: choose from {', '.join(PARTS)}")
    return names, parsed.scenes


def main() -> None:
    shared = Path(os.environ.get("BUNRAKU_SHARED") or Path(__file__).resolve().parents[3] / "shared")
    figures: dict[str, Any] = {}
    names, scenes = parse_arguments()
    for name in names:
        figures |= PARTS[name](shared, scenes)
    print(json.dumps(figures))


if __name__ == "__main__":
    main()

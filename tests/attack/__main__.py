"""Hostile clients against a server: `make verify-attack`. The last line printed is one JSON object.

Without `--compose`, a server with a secret is started in a separate process. Calm viewers watch a session whose left
hand is controlled, while one attack after the other runs. Each is a separate process, bounded in time, memory and
connections. With `--compose URL` the attacks aim at a running stack behind its gateway, whose secret must be that of
`tests/credentials.py`. The exit status is 1 if an attack was not held.
"""

from __future__ import annotations

import argparse
import json
import signal
import sys

from tests.attack.inspection import load_inspections
from tests.attack.lab import VIEWERS, open_lab
from tests.attack.registry import load_attacks
from tests.attack.result import MAX_GAP_RATIO, AttackResult

SECONDS = 4.0
"""Duration of an attack in a full run."""
SHORT_SECONDS = 2.0
"""Duration of an attack in a short run: the connections of a flooder must be closed within as much."""


def main() -> None:
    """Parse the command line, run the attacks and print a row for each."""
    parser = argparse.ArgumentParser(prog="make verify-attack", description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--only", default="", help="words, separated by commas: run attacks whose name contains one")
    parser.add_argument("--rows", default="", help="rows of the table, separated by commas")
    parser.add_argument(
        "--seconds",
        type=float,
        help=f"duration of an attack ({SECONDS:g}, with --short {SHORT_SECONDS:g}); some take longer",
    )
    parser.add_argument("--short", action="store_true", help="give no attack more than --seconds")
    parser.add_argument("--viewers", type=int, default=VIEWERS, help="number of calm viewers")
    parser.add_argument("--attempts", type=int, default=2, help="attempts if only the overlay gap is too long")
    parser.add_argument("--compose", metavar="URL", help="gateway of a running stack, instead of an own server")
    parser.add_argument("--list", action="store_true", help="print the attacks and exit")
    options = parser.parse_args()
    words = [word.strip() for word in options.only.split(",") if word.strip()]
    rows = {int(row) for row in options.rows.split(",") if row}

    def is_selected(name: str, row: int) -> bool:
        return (not words or any(word in name for word in words)) and (not rows or row in rows)

    attacks = [one for one in load_attacks().values() if is_selected(one.name, one.row)]
    inspections = [one for one in load_inspections().values() if is_selected(one.name, one.row)]
    if options.list:
        lines = [(one.row, f"{one.name:<48} {one.criterion}") for one in attacks] + [
            (one.row, f"{one.name:<48} {one.criterion}") for one in inspections
        ]
        for row, line in sorted(lines):
            print(f"{row:>2} {line}")
        return
    # end the server as well if this process is terminated
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))
    results: list[AttackResult] = []
    if attacks:
        with open_lab(options.compose, options.viewers) as lab:
            print(f"calm: overlay gap p99 {lab.calm_ms:.0f} ms with {options.viewers} viewers", flush=True)
            for attack in attacks:
                seconds = options.seconds or (SHORT_SECONDS if options.short else SECONDS)
                seconds = seconds if options.short else max(seconds, attack.seconds)
                results.append(lab.run(attack, seconds, MAX_GAP_RATIO, options.attempts))
                print(results[-1].format_row(), flush=True)
    for inspection in inspections:
        results.append(inspection.run(skip="needs the server's processes" if options.compose else ""))
        print(results[-1].format_row(), flush=True)
    failed_rows = sorted({one.row for one in results if one.held is False})
    print(f"{sum(one.held is True for one in results)} of {len(results)} held; rows that failed: {failed_rows}")
    held = bool(results) and not failed_rows
    print(json.dumps({**{one.name: one.as_json() for one in results}, "held": held}))
    sys.exit(not held)


if __name__ == "__main__":
    main()

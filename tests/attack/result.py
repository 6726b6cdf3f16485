"""Result of an attack: figures before, during and after, and whether the server has held."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from typing import Any

from tests.attack.resources import Resources

MAX_GAP_RATIO = 1.3
"""Largest overlay gap (p99) of calm viewers during an attack, relative to the calm one."""
MAX_DESCRIPTORS_LEFT = 16
"""Descriptors that may be open after an attack beyond those before it."""


@dataclass
class Phases:
    """Value before, during and after an attack."""

    before: float | None = None
    during: float | None = None
    after: float | None = None

    def __str__(self) -> str:
        values = (self.before, self.during, self.after)
        return "/".join("-" if value is None else f"{value:.0f}" for value in values)


@dataclass
class AttackResult:
    """Figures of one attack: overlay gap p99 in ms, memory in MB, descriptors, and answers of the server.

    `gap_ratio` compares the gap during the attack with the calm one. `cpu_share` is the share of the attack for which
    the server's event loop ran, `wait_share` that for which it waited for a processor that other processes had. `held`
    is None if the attack could not be made.
    """

    name: str
    row: int
    criterion: str
    gap_ms: Phases = field(default_factory=Phases)
    gap_max_ms: float | None = None
    gap_ratio: float | None = None
    rss_mb: Phases = field(default_factory=Phases)
    tree_mb: Phases = field(default_factory=Phases)
    descriptors: Phases = field(default_factory=Phases)
    cpu_share: float | None = None
    wait_share: float | None = None
    answers: dict[str, int] = field(default_factory=dict)
    violations: list[str] = field(default_factory=list)
    skipped: str = ""
    attempts: int = 1

    @property
    def held(self) -> bool | None:
        """True if the server has met every criterion, None for a skipped attack."""
        return None if self.skipped else not self.violations

    @property
    def is_only_slow(self) -> bool:
        """True if the only violation is the overlay gap, which also depends on other processes of the machine."""
        return len(self.violations) == 1 and self.violations[0].startswith("overlay gap")

    def set_resources(self, before: Resources, during: Resources, after: Resources) -> None:
        """Set the figures of memory and descriptors."""
        self.rss_mb = Phases(before.rss_mb, during.rss_mb, after.rss_mb)
        self.tree_mb = Phases(before.tree_mb, during.tree_mb, after.tree_mb)
        self.descriptors = Phases(before.descriptors, during.descriptors, after.descriptors)

    def set_processor_shares(self, before: Resources, after: Resources, seconds: float) -> None:
        """Set the shares of the duration of an attack for which the server ran, and waited for a processor."""
        self.cpu_share = round((after.cpu_s - before.cpu_s) / seconds, 3)
        self.wait_share = round((after.wait_s - before.wait_s) / seconds, 3)

    def judge_gap(self, calm_ms: float, gaps: dict[str, Any], max_ratio: float) -> None:
        """Compare the gaps during the attack with the calm ones, and check that no viewer was disconnected."""
        self.gap_ms.during, self.gap_max_ms = gaps["p99"], gaps["max"]
        self.gap_ratio = round(gaps["p99"] / calm_ms, 2)
        if self.gap_ratio > max_ratio:
            self.violations.append(f"overlay gap p99 {gaps['p99']:.0f} ms is {self.gap_ratio:.1f}x calm")
        if gaps["dropped"]:
            self.violations.append(f"{gaps['dropped']} calm viewers were disconnected")

    def judge_resources(self, max_rss_growth_mb: float) -> None:
        """Check the growth of memory, and that descriptors are closed again."""
        rss, descriptors = self.rss_mb, self.descriptors
        if rss.before is not None and rss.during is not None and rss.during - rss.before > max_rss_growth_mb:
            self.violations.append(
                f"RSS grew by {rss.during - rss.before:.0f} MB, at most {max_rss_growth_mb:.0f} MB are permitted"
            )
        if descriptors.before is not None and descriptors.after is not None:
            left = descriptors.after - descriptors.before
            if left > MAX_DESCRIPTORS_LEFT:
                self.violations.append(f"{left:.0f} descriptors are still open")

    def format_row(self) -> str:
        """Format the result as a row of the table, with its violations below."""
        answers = ", ".join(f"{answer}: {number}" for answer, number in list(self.answers.items())[:6])
        state = "skipped: " + self.skipped if self.skipped else "held" if self.held else "FAILED"
        shares = "" if self.cpu_share is None else f"loop runs {self.cpu_share:.0%} waits {self.wait_share:.0%}"
        row = (
            f"{self.row:>2} {self.name:<45} {state:<7} gap {self.gap_ms} ms"
            f" {'' if self.gap_ratio is None else f'({self.gap_ratio:.2f}x)':<8} RSS {self.rss_mb} MB"
            f" (tree {self.tree_mb})  {shares}  fds {self.descriptors}  [{answers}]"
        )
        return "\n".join([row, *(f"{'':>8}{violation}" for violation in self.violations)])

    def as_json(self) -> dict[str, Any]:
        """Return the result as plain values."""
        fields = {name: value for name, value in asdict(self).items() if name != "name"}
        return {**fields, "held": self.held}

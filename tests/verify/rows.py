"""The table: of each fault how often it was tried, how often all held, and the worst of each figure."""

from __future__ import annotations

from dataclasses import dataclass, field


@dataclass
class Row:
    """One fault."""

    fault: str
    tried: int = 0
    held: int = 0
    worst: dict[str, float] = field(default_factory=dict)
    broken: list[str] = field(default_factory=list)

    def round(self, figures: dict[str, float], *broken: str) -> None:
        """One time: its figures, of which the greatest is kept, and what did not hold."""
        self.tried += 1
        self.held += not broken
        self.broken += broken
        for name, value in figures.items():
            self.worst[name] = max(value, self.worst.get(name, value))

    def told(self) -> str:
        """As a line of the table."""
        figures = ", ".join(f"{name} {value:.3g}" for name, value in self.worst.items())
        said = f"{self.fault:<34} {self.held}/{self.tried}  {figures}"
        return "\n".join([said, *(f"{'':<34} did not hold: {why}" for why in dict.fromkeys(self.broken))])

"""How a headless viewer fared, in figures."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any


@dataclass(slots=True)
class ViewerStatistics:
    """How a viewer fared. Times in milliseconds; `kbps` counts all payload received over the time watched; `blocks` are
    the motion's, `gaps` how often one was missing and `dark_ms` for how long, `shown_kbps` the mean of the rates shown,
    `reason` why the server chose the last one, `reconnects` how often the line was lost and tried again; `camera` where
    the show's camera was last: `position` and `gaze` in metres, `fov` in radians."""

    seconds: float = 0.0
    first_pose_ms: float | None = None
    frames: int = 0
    gaps: int = 0
    dark_ms: float = 0.0
    shown_kbps: float = 0.0
    blocks: int = 0
    camera_blocks: int = 0
    light_blocks: int = 0
    audio_blocks: int = 0
    audio_rate: int = -1
    overlays: int = 0
    reconnects: int = 0
    reason: str | None = None
    bytes: int = 0
    kbps: float = 0.0
    rate: int = -1
    clock_offset_ms: float = 0.0
    clock_error_ms: float | None = None
    overlay_early_ms: float | None = None
    camera: dict[str, Any] | None = None

    def as_json(self) -> dict[str, Any]:
        """The figures as plain values."""
        return {key: _round_floats(value) for key, value in asdict(self).items()}


def _round_floats(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _round_floats(part) for key, part in value.items()}
    if isinstance(value, list):
        return [_round_floats(part) for part in value]
    return round(value, 3) if isinstance(value, float) else value

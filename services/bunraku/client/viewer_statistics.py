"""Statistics of a headless viewer."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any


@dataclass(slots=True)
class ViewerStatistics:
    """Statistics of a viewer.

    Times are milliseconds; `kbps` is all payload received over the time watched. `blocks` are the motion's; `gaps`
    counts missing blocks and `dark_ms` their duration; `shown_kbps` is the mean bitrate of the levels shown, `reason`
    the server's reason for the last level, `reconnects` the number of lost connections. `camera` is the last view:
    `position` and `gaze` in metres, `fov` in radians.
    """

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
    live_messages: int = 0
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
        """Return the statistics as plain values."""
        return {key: _round_floats(value) for key, value in asdict(self).items()}


def _round_floats(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _round_floats(part) for key, part in value.items()}
    if isinstance(value, list):
        return [_round_floats(part) for part in value]
    return round(value, 3) if isinstance(value, float) else value

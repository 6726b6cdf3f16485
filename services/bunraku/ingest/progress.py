"""How far an upload is."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

UploadStage = Literal["receiving", "waiting", "reading", "encoding"]


@dataclass(slots=True)
class UploadProgress:
    """What is being done with an upload, and the share of that which is done, 0..1: of its bytes while it is received,
    of its blocks while it is encoded. It waits where others are encoded first; reading has no share."""

    stage: UploadStage = "receiving"
    share: float = 0.0

    def advance_to(self, stage: UploadStage, share: float = 0.0) -> None:
        """Note where the upload is now."""
        self.stage, self.share = stage, share

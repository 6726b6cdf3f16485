"""What tests of many rooms share."""

from __future__ import annotations

import os
from pathlib import Path

import hypothesis
import pytest

# how long an example takes says more of the machine than of the code
hypothesis.settings.register_profile("bunraku", deadline=None)
hypothesis.settings.load_profile("bunraku")

REPOSITORY = Path(__file__).resolve().parent.parent


@pytest.fixture(scope="session")
def shared() -> Path:
    """The folder of real clips, links and studies that stands beside the project on some machines."""
    folder = Path(os.environ.get("BUNRAKU_SHARED") or REPOSITORY.parent / "shared")
    if not (folder / "mocap" / "bvh").is_dir():
        if os.environ.get("CI"):
            pytest.fail(f"in CI the real clips must be there: {folder}")
        pytest.skip(f"no real clips at {folder}; set BUNRAKU_SHARED to where they are")
    return folder

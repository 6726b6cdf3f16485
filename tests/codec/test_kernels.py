from __future__ import annotations

import subprocess
import sys

import pytest

from bunraku.codec import _kernels
from bunraku.kernels import load_kernels
from tests.time_limit import HANG_TIMEOUT_S

PURE_MODULES = ("coefficients", "block_encoder", "motion_encoder", "scene_encoder", "motion_decoder", "container")


def test_loader_returns_the_kernels_of_the_codec() -> None:
    kernels = load_kernels("codec")
    assert kernels is _kernels
    assert all(callable(getattr(kernels, name)) for name in kernels.__all__ if name.islower())


@pytest.mark.parametrize("module", PURE_MODULES)
def test_pure_module_does_not_import_numba(module: str) -> None:
    code = f"import sys, bunraku.codec.{module}; sys.exit('numba' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], timeout=HANG_TIMEOUT_S, check=False).returncode == 0

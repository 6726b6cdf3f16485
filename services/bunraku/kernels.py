"""Loader of compiled kernels.

A package with compiled code keeps its entry points in one private module, `_kernels`, the only one that imports numba.
Importing numba takes seconds and compiling takes more, so a kernel module is loaded at its first use, or ahead of time
by a service that warms up.
"""

from __future__ import annotations

from functools import cache
from importlib import import_module
from types import ModuleType


@cache
def load_kernels(package: str) -> ModuleType:
    """Import the kernels of a package of Bunraku, for example `"codec"`. Thread-safe; takes seconds the first time."""
    return import_module(f"bunraku.{package}._kernels")

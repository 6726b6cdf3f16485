"""Loader of compiled kernels.

A package with compiled code keeps it in a private module or subpackage `_kernels`, the only part of the package that
imports numba. Importing numba takes seconds and compiling takes more. So callers load the kernels at their first use,
or a service loads them in a thread after its start.
"""

from __future__ import annotations

from functools import cache
from importlib import import_module
from types import ModuleType


@cache
def load_kernels(package: str) -> ModuleType:
    """Import the kernels of a package, for example `"codec"`. Thread-safe; takes seconds the first time."""
    return import_module(f"bunraku.{package}._kernels")

"""Compiled code of the codec, the only part of it that imports numba.

Other modules load it at its first use, with `bunraku.kernels.load_kernels("codec")`. Every function is cached beside
its source file (`cache=True`).
"""

from __future__ import annotations

from bunraku.codec._kernels.bit_cost import build_cost_table
from bunraku.codec._kernels.closed_loop import quantise_closed_loop
from bunraku.codec._kernels.context_model import create_context_model
from bunraku.codec._kernels.entropy_coder import (
    MAX_ESCAPE_BITS,
    allocate_output,
    collect_examples,
    decode_block,
    decode_header,
    encode_block,
)
from bunraku.codec._kernels.error_bound import refine_within_bound
from bunraku.codec._kernels.forward_kinematics import compute_points
from bunraku.codec._kernels.rate_distortion import refine_coefficients
from bunraku.codec._kernels.value_quantiser import add_offset_costs, quantise_values

__all__ = [
    "MAX_ESCAPE_BITS",
    "add_offset_costs",
    "allocate_output",
    "build_cost_table",
    "collect_examples",
    "compute_points",
    "create_context_model",
    "decode_block",
    "decode_header",
    "encode_block",
    "quantise_closed_loop",
    "quantise_values",
    "refine_coefficients",
    "refine_within_bound",
]

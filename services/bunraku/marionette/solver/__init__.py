"""Steps that solve one limb, on plain tuples of floats: Python functions that `_kernels` compiles as they stand."""

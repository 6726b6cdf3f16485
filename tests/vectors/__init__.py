"""Generators of the golden vectors in `proto/vectors` and of the generated parts of the contract."""

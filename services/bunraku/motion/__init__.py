"""Rotations, skeletons, BVH reader and writer, joint naming, analysis. Pure."""

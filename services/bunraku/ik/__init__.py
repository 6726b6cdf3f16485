"""Inverse kinematics service: bend tables and batched solutions."""

"""Formats of other tools for a stage's poses and lights: VMC, OSC, Art-Net and sACN packets. Pure."""

"""Trains what the codec ships: the prior of its coder, from clips whose licence allows it."""

"""Simulated humanoid robot that follows a performer of a session: `python -m examples.robot --help`."""

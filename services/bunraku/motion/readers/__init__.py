"""Readers of motion files, by format. `motion_file.read_motion` chooses by content."""

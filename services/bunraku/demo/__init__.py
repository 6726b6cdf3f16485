"""Motion, music and staging of the demo, and their installation."""

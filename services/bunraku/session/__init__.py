"""Session service: timeline, puppeteers and overlays of each stage."""

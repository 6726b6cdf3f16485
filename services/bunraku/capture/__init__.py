"""Live motion capture: packets of capture tools to poses of the figure. Pure."""

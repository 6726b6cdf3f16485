"""What goes with the demo's dance: music, a camera and lights, made by code from the dance's score."""

"""What goes with the demo's dance beside its music: a camera and lights, made by code from the dance's score."""

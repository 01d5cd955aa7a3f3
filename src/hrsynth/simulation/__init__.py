"""The servo loop: control law, simulated runs, the physics bench and the camera bench."""

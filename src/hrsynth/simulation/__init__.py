"""The servo loop: control law, simulated runs, the dynamic simulation and the camera bench."""

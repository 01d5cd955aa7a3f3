"""Servo loop: control law, simulated runs, dynamic simulation and rendered images."""

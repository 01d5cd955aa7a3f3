"""Mechanisms as drawings in SVG: the joint graph, and the kinematic symbols along the legs."""

"""Mechanisms as drawings in SVG: the kinematic symbols along the legs."""

"""Loci of tips and conditions on the pose that legs give, with their measured values fixed."""

"""Trajectory scenes by hand: a hand leads the tool along the trajectory through an admittance, instead of a pose task."""

"""Trajectory scenes by hand: a hand leads the tool through an admittance, in the place of a pose task."""

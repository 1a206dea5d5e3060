"""The kinds of scenes, as `kind` in a trace's header and in a summary names them."""

TRAJECTORY, BY_HAND, HANDS_ON = "trajectory", "by-hand", "hands-on"
"""The tool follows a trajectory by itself; a hand leads it along one; a hand leads it through a port."""

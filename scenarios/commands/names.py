"""Names that an option takes, as the command line spells them."""

from enum import StrEnum


class PlantName(StrEnum):
    """Plants."""

    kinematic = "kinematic"
    mujoco = "mujoco"


class GuardMode(StrEnum):
    """What the guard does with what verification finds."""

    act = "act"
    watch = "watch"
    off = "off"

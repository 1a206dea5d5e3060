from .nullspace import FreeMotion as FreeMotion
from .nullspace import free_motion as free_motion

__all__ = ["FreeMotion", "free_motion"]

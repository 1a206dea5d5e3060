"""Pictures of runs: an off-screen canvas, what stands on the stage, and the video."""

from primitives.errors import ActiveConstraintsError


class ViewError(ActiveConstraintsError):
    """A picture cannot be made on this machine; says which packages it takes."""

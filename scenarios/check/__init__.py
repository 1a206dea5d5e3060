"""`vfi check`: what can be said of a scene before it runs. One file a concern; `report` and `led` call them all."""

from collections.abc import Callable
from typing import TYPE_CHECKING

from scenarios.scene import Scene

if TYPE_CHECKING:
    from scenarios.check.report import Report
    from scenarios.hands_on.scene import HandsOnScene


def check_any(
    scene: "Scene | HandsOnScene", progress: Callable[[str, float], None] = lambda label, share: None
) -> "Report":
    """Check a scene of either kind; progress is told what is looked at and a share of it. Raises as `check_scene`."""
    if isinstance(scene, Scene):
        from scenarios.check.report import check_scene

        return check_scene(scene, progress)
    from scenarios.check.led import check_led

    return check_led(scene, progress)

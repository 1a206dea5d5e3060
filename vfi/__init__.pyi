from .backends import Backend as Backend
from .backends import Solver as Solver
from .controller import Controller as Controller
from .forms import Soft as Soft
from .latch import Latch as Latch
from .messages import (
    ByName as ByName,
)
from .messages import (
    Command as Command,
)
from .messages import (
    FreeReference as FreeReference,
)
from .messages import (
    Measurement as Measurement,
)
from .messages import (
    Rows as Rows,
)
from .outcome import (
    Guard as Guard,
)
from .outcome import (
    Reason as Reason,
)
from .outcome import (
    State as State,
)
from .qp import QP as QP
from .qp import SolverStatus as SolverStatus
from .tasks import PoseTask as PoseTask
from .tasks import ProjectionTask as ProjectionTask
from .tasks import VelocityTask as VelocityTask

__all__ = [
    "QP",
    "Backend",
    "ByName",
    "Command",
    "Controller",
    "FreeReference",
    "Guard",
    "Latch",
    "Measurement",
    "PoseTask",
    "ProjectionTask",
    "Reason",
    "Rows",
    "Soft",
    "Solver",
    "SolverStatus",
    "State",
    "VelocityTask",
]

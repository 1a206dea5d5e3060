from .controller import Admittance as Admittance
from .messages import Motion as Motion
from .messages import Proposal as Proposal
from .nullspace import FreeMotion as FreeMotion
from .nullspace import free_motion as free_motion
from .outcome import Reason as Reason
from .outcome import State as State
from .parameters import NEURO8 as NEURO8
from .parameters import TABLE_1 as TABLE_1
from .parameters import Parameters as Parameters
from .regions import Cloud as Cloud
from .regions import Region as Region

__all__ = [
    "NEURO8",
    "TABLE_1",
    "Admittance",
    "Cloud",
    "FreeMotion",
    "Motion",
    "Parameters",
    "Proposal",
    "Reason",
    "Region",
    "State",
    "free_motion",
]

from .controller import Admittance as Admittance
from .hand import Delay as Delay
from .hand import Hand as Hand
from .hand import ScriptedHand as ScriptedHand
from .hand import SpringHand as SpringHand
from .hand import Tremor as Tremor
from .hand_file import load_hand as load_hand
from .joint_parameters import LWR4PLUS_JOINTS as LWR4PLUS_JOINTS
from .joint_parameters import NEURO8_JOINTS as NEURO8_JOINTS
from .joint_parameters import JointParameters as JointParameters
from .joints import JointAdmittance as JointAdmittance
from .joints import JointMotion as JointMotion
from .messages import Motion as Motion
from .messages import Proposal as Proposal
from .nullspace import FreeMotion as FreeMotion
from .nullspace import free_motion as free_motion
from .outcome import Reason as Reason
from .outcome import State as State
from .parameters import NEURO8 as NEURO8
from .parameters import TABLE_1 as TABLE_1
from .parameters import Parameters as Parameters
from .potential import Repulsion as Repulsion
from .potential import repulsion as repulsion
from .regions import Cloud as Cloud
from .regions import Region as Region

__all__ = [
    "LWR4PLUS_JOINTS",
    "NEURO8",
    "NEURO8_JOINTS",
    "TABLE_1",
    "Admittance",
    "Cloud",
    "Delay",
    "FreeMotion",
    "Hand",
    "JointAdmittance",
    "JointMotion",
    "JointParameters",
    "Motion",
    "Parameters",
    "Proposal",
    "Reason",
    "Region",
    "Repulsion",
    "ScriptedHand",
    "SpringHand",
    "State",
    "Tremor",
    "free_motion",
    "load_hand",
    "repulsion",
]

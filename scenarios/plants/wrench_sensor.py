"""The force/torque sensor between the arm and its tool, freed from the tool's own weight and inertia."""

from typing import Any

import mujoco
import numpy as np

from primitives.checks import Array
from primitives.errors import ModelError


class WrenchSensor:
    """MuJoCo's `force` and `torque` sensors of a site, in world axes, compensated.

    MuJoCo's sensors show what the arm does to the tool. What acts on the tool from outside is what its bodies need to
    move as they do, by Newton and Euler, from the acceleration that an accelerometer at each of them would show (so the
    weight is in it), less that. The tool touching something acts from outside too; the sensor cannot tell it from the
    hand.

    Parameters
    ----------
    model : a `mujoco.MjModel`.
    prefix : of the arm's names, with its slash; empty for a single arm.

    Raises
    ------
    ModelError : the model lacks one of the two sensors, or they sit on different sites.
    """

    def __init__(self, model: Any, prefix: str):
        addresses, sites = [], []
        for name in ("force", "torque"):
            index = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_SENSOR, prefix + name)
            if index < 0:
                raise ModelError(f'the MJCF of the arm "{prefix}" has no sensor "{prefix + name}"; add it at its site')
            addresses.append(int(model.sensor_adr[index]))
            sites.append(int(model.sensor_objid[index]))
        self._force, self._torque = addresses
        if sites[0] != sites[1]:
            raise ModelError(
                f'the sensors "{prefix}force" and "{prefix}torque" sit on different sites; put both on one'
            )
        self._site = sites[0]
        first = int(model.site_bodyid[self._site])
        self._bodies = [b for b in range(model.nbody) if model.body_mass[b] > 0.0 and _hangs_on(model, b, first)]
        self._model = model
        self._acceleration, self._velocity = np.empty(6), np.empty(6)

    def read(self, data: Any) -> Array:
        """(6,) [force; torque] on the tool from outside, N and Nm, world axes, at the sensor.

        The accelerations and sensors in `data`, a `mujoco.MjData`, must be those of its state.
        """
        turn, origin = data.site_xmat[self._site].reshape(3, 3), data.site_xpos[self._site]
        force = -turn @ data.sensordata[self._force : self._force + 3]
        torque = -turn @ data.sensordata[self._torque : self._torque + 3]
        body_kind = mujoco.mjtObj.mjOBJ_BODY
        for body in self._bodies:
            mujoco.mj_objectAcceleration(self._model, data, body_kind, body, self._acceleration, 0)
            mujoco.mj_objectVelocity(self._model, data, body_kind, body, self._velocity, 0)
            axes, spin = data.ximat[body].reshape(3, 3), self._velocity[:3]
            inertia = (axes * self._model.body_inertia[body]) @ axes.T
            push = self._model.body_mass[body] * self._acceleration[3:]
            force += push
            torque += inertia @ self._acceleration[:3] + np.cross(spin, inertia @ spin)
            torque += np.cross(data.xipos[body] - origin, push)
        return np.concatenate([force, torque])


def _hangs_on(model: Any, body: int, first: int) -> bool:
    while body not in (0, first):
        body = int(model.body_parentid[body])
    return body == first

"""Orientations of actuated pairs of bodies."""

from collections.abc import Sequence

import numpy as np

from marathon_rl._arrays import FloatArray
from marathon_rl._native import Model


class JointRotations:
    """Orientation of the parent as seen from the child, for each body with actuated rotating joints.

    All pairs are computed together: what the k-th joint of a body does is an array over the bodies.
    """

    def __init__(self, model: Model, joints: Sequence[int]) -> None:
        """For the bodies of these hinges and balls, in their order."""
        body_of, kinds = model.joint_body, model.joint_type
        bodies = list(dict.fromkeys(int(body_of[j]) for j in joints))
        turns = [[j for j in range(len(kinds)) if body_of[j] == b and kinds[j] in ("hinge", "ball")] for b in bodies]
        most = max((len(own) for own in turns), default=0)
        self._rest = model.body_quat[bodies]
        # hinges and balls by place: address in qpos, and for a hinge its angle at rest and its axis
        self._address = np.zeros((most, len(bodies)), int)
        self._at_rest = np.zeros((most, len(bodies)))
        self._axis = np.zeros((most, len(bodies), 3))
        self._hinge = np.zeros((most, len(bodies)))
        self._balls: list[list[tuple[int, int]]] = [[] for _ in range(most)]
        for pair, own in enumerate(turns):
            for place, joint in enumerate(own):
                address = int(model.joint_qpos[joint])
                if kinds[joint] == "ball":
                    self._balls[place].append((pair, address))
                    continue
                self._address[place, pair] = address
                self._at_rest[place, pair] = model.qpos0[address]
                self._axis[place, pair] = model.joint_axis[joint]
                self._hinge[place, pair] = 1.0

    def __call__(self, qpos: FloatArray) -> FloatArray:
        """Quaternions x y z w with w >= 0, `(N, 4 * pairs)`."""
        n, pairs = len(qpos), len(self._rest)
        q = np.broadcast_to(self._rest, (n, pairs, 4))
        for place, balls in enumerate(self._balls):
            # where a body has no such hinge, the angle is 0
            half = 0.5 * self._hinge[place] * (qpos[:, self._address[place]] - self._at_rest[place])
            turn = np.empty((n, pairs, 4))
            turn[..., 0] = np.cos(half)
            turn[..., 1:] = np.sin(half)[..., None] * self._axis[place]
            for pair, address in balls:
                turn[:, pair] = qpos[:, address : address + 4]
            q = _product(q, turn)
        # the inverse of a unit quaternion has the opposite vector part
        sign = np.where(q[..., :1] < 0, -1.0, 1.0)
        out = np.empty((n, pairs, 4))
        out[..., :3] = -sign * q[..., 1:]
        out[..., 3:] = sign * q[..., :1]
        return out.reshape(n, 4 * pairs)


def _product(a: FloatArray, b: FloatArray) -> FloatArray:
    """Product of quaternions w x y z."""
    aw, ax, ay, az = np.moveaxis(a, -1, 0)
    bw, bx, by, bz = np.moveaxis(b, -1, 0)
    return np.stack(
        [
            aw * bw - ax * bx - ay * by - az * bz,
            aw * bx + ax * bw + ay * bz - az * by,
            aw * by + ay * bw + az * bx - ax * bz,
            aw * bz + az * bw + ax * by - ay * bx,
        ],
        axis=-1,
    )

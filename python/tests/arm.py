"""An agent written in Python, for tests: an arm with a motor."""

import numpy as np

from marathon_rl import MarathonAgent

ARM = """
<mujoco model="arm">
  <option timestep="0.01"/>
  <worldbody>
    <body name="arm">
      <joint name="shoulder" axis="0 1 0" damping="0.2" range="-170 170"/>
      <geom name="arm" type="capsule" fromto="0 0 0 0 0 -0.3" size="0.03" contype="0" conaffinity="0"/>
    </body>
  </worldbody>
  <actuator><motor name="shoulder" joint="shoulder" gear="2"/></actuator>
</mujoco>"""


class Arm(MarathonAgent):
    """Lift the arm."""

    mjcf = ARM
    frame_skip = 5
    max_episode_steps = 40

    def observations(self) -> list[np.ndarray]:
        return [self.position("arm"), self.joint_velocities()]

    def step_reward(self) -> dict[str, np.ndarray]:
        return {"height": self.height("arm") / 0.15 + 1, "effort": -0.01 * self.effort()}

    def info(self) -> dict[str, np.ndarray]:
        return {"angle": self.sim.qpos[:, 0]}

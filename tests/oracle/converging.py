"""Solving MuJoCo's constraints to the end, where a model's own settings let its solver converge."""

import mujoco

# below this cap, MuJoCo may stop before it converges, and the point where it stops is the answer (`Caps` in the
# physics)
LEAST_ORDINARY_CAP = 50


def converges(opt):
    """Whether the settings let MuJoCo's Newton solver converge."""
    return opt.iterations >= LEAST_ORDINARY_CAP


def solve_to_the_end(opt):
    """Sets the options so that the solver stops at rounding. A low cap is not raised: that would hide what it does."""
    if not converges(opt):
        raise ValueError(f"iterations is {opt.iterations}: such a model is compared under its own settings (low_caps.py)")
    opt.solver = mujoco.mjtSolver.mjSOL_NEWTON
    opt.iterations = 300
    opt.tolerance = 1e-14
    opt.ls_iterations = 200
    opt.ls_tolerance = 1e-10

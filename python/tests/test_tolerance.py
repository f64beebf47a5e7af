"""`Tolerance` is worth what dm_control's `rewards.tolerance` is."""

import numpy as np
import pytest
from dm_control.utils import rewards

from marathon_rl import Tolerance

NUMBERS = np.concatenate([np.linspace(-6, 6, 241), [-1e4, 1e4]])
SIGMOIDS = ["gaussian", "hyperbolic", "long_tail", "reciprocal", "cosine", "linear", "quadratic", "tanh_squared"]


@pytest.mark.parametrize("sigmoid", SIGMOIDS)
@pytest.mark.parametrize("value", [0.0, 0.1, 0.7])
@pytest.mark.parametrize(("bounds", "margin"), [((-1.0, 1.5), 2.0), ((0.5, np.inf), 0.25), ((0.0, 0.0), 3.0)])
def test_worth_is_that_of_dm_control(sigmoid, value, bounds, margin):
    if value == 0.0 and sigmoid not in ("cosine", "linear", "quadratic"):
        with pytest.raises(ValueError, match=r"value_at_margin is 0\.0, expected a number between 0 and 1"):
            Tolerance(bounds, margin, sigmoid, value)
        return
    # theirs overflows far away, and says so
    with np.errstate(over="ignore"):
        theirs = rewards.tolerance(NUMBERS, bounds, margin, sigmoid, value)
    ours = Tolerance(bounds, margin, sigmoid, value)(NUMBERS)
    assert ours.shape == NUMBERS.shape
    np.testing.assert_allclose(ours, theirs, rtol=1e-12, atol=1e-12)


def test_without_a_margin_it_is_all_or_nothing():
    assert Tolerance((0.6, 2.0))([0.5, 0.6, 1.0, 2.0, 2.1]).tolist() == [0.0, 1.0, 1.0, 1.0, 0.0]
    assert Tolerance.around_zero(1.0)(1.0) == pytest.approx(0.1)
    assert Tolerance.at_least(2.0, 1.0, sigmoid="linear", value_at_margin=0.5)([3.0, 1.0]).tolist() == [1.0, 0.5]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ({"bounds": (1.0, 0.0)}, "expected the lower one first"),
        ({"margin": -1.0}, "margin is -1.0"),
        ({"sigmoid": "steep"}, "sigmoid is 'steep', expected one of gaussian, hyperbolic"),
        ({"value_at_margin": 1.0}, "value_at_margin is 1.0"),
    ],
)
def test_what_makes_no_sense_is_refused(words, message):
    with pytest.raises(ValueError, match=message):
        Tolerance(**words)

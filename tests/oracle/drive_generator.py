"""Draws actuators at sites, slider-cranks and muscles for a model of `model_generator.py`, with their sensors.

They come last and from their own random stream, so that the rest of a seed's model stays as it was without them.
"""

import numpy as np


def sections(g, seed, element):
    """Returns lists of elements by section: `actuator`, `sensor`. `g` is the generator."""
    rng, g.rng = g.rng, np.random.default_rng([2033, seed])
    out = {"actuator": [], "sensor": []}
    if g.sites and g.maybe(0.4):
        for _ in range(g.pick(1, 1, 2, 3)):
            form, a = actuator(g)
            out["actuator"].append(element(form, a))
            kind = g.pick("actuatorpos", "actuatorvel", "actuatorfrc")
            out["sensor"].append(element(kind, {"actuator": a["name"]}))
    g.rng = rng
    return out


def target(g):
    """A transmission."""
    first, second = g.among(g.sites)[0], g.among(g.sites)[0]
    kind = g.pick("site", "refsite", "refsite", "crank")
    if kind == "crank":
        return {"cranksite": first, "slidersite": second, "cranklength": g.log(0.2, 2), "gear": g.maybe(0.4, lambda: g.vector(2.0, 1))}
    gear = g.vector(1.5, 6) * g.pick([1, 1, 1, 0, 0, 0], [0, 0, 0, 1, 1, 1], [1, 1, 1, 0.3, 0.3, 0.3])
    return {"site": first, "refsite": second if kind == "refsite" else None, "gear": gear}


def add_law(g, form, a):
    """Adds the law of a servo or a general actuator to the attributes `a`."""
    if form == "position":
        a.update(kp=g.log(0.5, 50), kv=g.maybe(0.5, lambda: g.log(0.05, 3)))
        if a["kv"] is None:
            a["dampratio"] = g.maybe(0.3, lambda: g.u(0.2, 1.5))
    elif form == "velocity":
        a["kv"] = g.log(0.05, 5)
    elif form == "general":
        a.update(gaintype="affine", gainprm=g.vector(2.0) * [1, 1, 0.2], biastype="affine", biasprm=g.vector(2.0) * [1, 1, 0.3])


def add_force_range(g, a):
    """Adds a range of forces now and then."""
    if g.maybe(0.25):
        a["forcerange"] = [-g.u(0.5, 5), g.u(0.5, 5)]
        if not g.autolimits:
            a["forcelimited"] = True


def actuator(g):
    a = {"name": g.name("d"), **target(g)}
    form = g.pick("motor", "position", "velocity", "general", "muscle")
    add_law(g, form, a)
    if form == "muscle":
        # the element itself has no sites
        low, numbers = g.u(0.5, 0.9), [g.log(1, 20), 1, g.u(0.3, 0.7), g.u(1.3, 1.9), g.u(0.8, 5), g.u(0.5, 1.5), g.u(1.1, 1.6)]
        a.update(gaintype="muscle", biastype="muscle", gainprm=[low, g.u(1.0, 1.3), *numbers], biasprm=[low, g.u(1.0, 1.3), *numbers])
        shortest = g.u(-1, 0.5)
        a["lengthrange"] = [shortest, shortest + g.u(0.3, 1.5)]
        a.update(dyntype="muscle", dynprm=[g.log(0.005, 0.1), g.log(0.01, 0.2), g.pick(0, g.u(0.05, 0.5))])
        form = "general"
    add_force_range(g, a)
    return form, a

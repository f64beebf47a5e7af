"""Draws spatial tendons for a model of `model_generator.py`, with actuators, sensors and equality constraints on them.

They come last and from their own random stream, so that the rest of a seed's model stays as it was without them.
"""

import numpy as np

import drive_generator


def sections(g, seed, element):
    """Returns lists of elements by section: `tendon`, `actuator`, `equality`, `sensor`. `g` is the generator."""
    rng, g.rng = g.rng, np.random.default_rng([2031, seed])
    out = Strings(g, element).sections() if len(g.sites) > 1 and g.maybe(0.5) else {}
    g.rng = rng
    return out


class Strings:
    def __init__(self, g, element):
        self.g, self.element = g, element
        self.round = [n for n, kind, _ in g.geoms if kind in ("sphere", "cylinder")]

    def branch(self):
        """Sites, with a geom between some of them."""
        g = self.g
        path, last, self.sites = [], None, []
        for _ in range(g.rng.integers(2, 5)):
            site = g.among([s for s in g.sites if s != last])[0]
            if last and self.round and g.maybe(0.4):
                side = g.maybe(0.5, lambda: g.among(g.sites)[0])
                path.append(self.element("geom", {"geom": g.among(self.round)[0], "sidesite": side}))
            path.append(self.element("site", {"site": site}))
            self.sites.append(site)
            last = site
        return path

    def pulley(self):
        return [self.element("pulley", {"divisor": self.g.log(0.3, 4)})]

    def tendon(self):
        g = self.g
        path = (self.pulley() if g.maybe(0.1) else []) + self.branch()
        single = True
        while g.maybe(0.25):
            path += self.pulley() + self.branch()
            single = False
        a = {"name": g.name("s")}
        if single and not any("<geom" in line for part in path for line in part):
            a["armature"] = g.string_armature(self.sites)
        limited = g.maybe(0.35)
        if limited:
            a["range"] = [g.u(0, 0.3), g.u(0.4, 1.5)]
            a["margin"] = g.maybe(0.3, lambda: g.u(0, 0.1))
            a.update(g.solver("limit"))
            if not g.autolimits:
                a["limited"] = True
        a["stiffness"] = g.maybe(0.5, lambda: g.log(0.5, 100))
        a["springlength"] = g.maybe(0.5, lambda: g.pick(g.u(0, 0.8), sorted(g.u(0, 1, 2))))
        a["damping"] = g.maybe(0.4, lambda: g.log(0.01, 5))
        a["frictionloss"] = g.maybe(0.2, lambda: g.log(0.01, 1))
        if a["frictionloss"]:
            a.update(g.solver("friction"))
        if g.maybe(0.15):
            a["actuatorfrcrange"] = [-g.u(0.1, 2), g.u(0.1, 2)]
            if not g.autolimits:
                a["actuatorfrclimited"] = True
        return self.element("spatial", a, path), a["name"], limited

    def actuator(self, tendon):
        g = self.g
        form = g.pick("motor", "position", "velocity", "general")
        a = {"name": g.name("p"), "tendon": tendon, "gear": g.maybe(0.4, lambda: g.vector(2.0, 1))}
        drive_generator.add_law(g, form, a)
        if form == "general":
            a["dyntype"] = g.maybe(0.3, lambda: g.pick("integrator", "filter", "filterexact"))
            if a["dyntype"] in ("filter", "filterexact"):
                a["dynprm"] = g.log(0.005, 0.3)
        drive_generator.add_force_range(g, a)
        return form, a

    def equality(self, names):
        g = self.g
        ends = g.among(names + g.tendons, min(len(names + g.tendons), g.pick(1, 2)))
        a = {"name": g.name("q"), **{f"tendon{i + 1}": t for i, t in enumerate(ends)}, **g.solver()}
        a["polycoef"] = g.maybe(0.7, lambda: g.vector(0.3, 5))
        return self.element("tendon", a)

    def sections(self):
        g, names, limited = self.g, [], []
        out = {"tendon": [], "actuator": [], "equality": [], "sensor": []}
        for _ in range(g.pick(1, 1, 2, 3)):
            string, name, has_limit = self.tendon()
            out["tendon"].append(string)
            names.append(name)
            limited += [name] * bool(has_limit)
        actuators = []
        # those of the joints leave tendons out with implicitfast
        for _ in range(g.pick(0, 1, 1, 2, 3)):
            form, a = self.actuator(g.among(names + g.tendons)[0])
            out["actuator"].append(self.element(form, a))
            actuators.append(a["name"])
        if g.maybe(0.2):
            out["equality"].append(self.equality(names))
        for _ in range(g.rng.integers(0, 5)):
            kind = g.pick("tendonpos", "tendonvel", "tendonactuatorfrc", "tendonlimitpos", "tendonlimitvel", "tendonlimitfrc")
            if "limit" not in kind or limited:
                name = g.among(limited if "limit" in kind else names)[0]
                out["sensor"].append(self.element(kind, {"tendon": name}))
        for name in actuators:
            out["sensor"].append(self.element(g.pick("actuatorpos", "actuatorvel", "actuatorfrc"), {"actuator": name}))
        scalar = g.scalar_joints()
        if scalar and g.maybe(0.5):
            out["sensor"].append(self.element("jointactuatorfrc", {"joint": g.among(scalar)[0]}))
        return out

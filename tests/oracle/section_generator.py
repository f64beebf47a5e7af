"""Draws the sections of a random model that come after its bodies: tendons, actuators, equalities, contacts, sensors, options."""

import numpy as np

from random_draws import Draws, element


class Sections(Draws):
    """Draws sections about the bodies, joints, geoms and sites that the generator has drawn."""

    def scalar_joints(self):
        return [n for n, k in self.joints if k in ("hinge", "slide")]

    def tendon_armature(self, paths):
        """Armature of a tendon, sometimes, if the bodies that it pulls do not branch; given the paths to them."""
        if self.late.random() >= 0.2:
            return None
        ends = {path[-1]: [b for b in path if b] for path in paths if path}
        for a in ends.values():
            for b in ends.values():
                if a != b[: len(a)] and b != a[: len(b)] and set(a) & set(b) & set(ends):
                    return None
        return float(np.exp(self.late.uniform(np.log(1e-3), np.log(0.5))))

    def string_armature(self, sites):
        """The same for a string through sites."""
        pulled = []
        for one, other in zip(sites, sites[1:]):
            a, b = self.moved_by.get(one, []), self.moved_by.get(other, [])
            common = len([1 for x, y in zip(a, b) if x == y])
            pulled += [path[: k + 1] for path in (a, b) for k in range(common, len(path)) if path[k]]
        return self.tendon_armature(pulled)

    def tendon_section(self):
        scalar, out = self.scalar_joints(), []
        if len(scalar) < 1 or not self.maybe(0.5):
            return out
        for _ in range(self.pick(1, 2)):
            name = self.name("t")
            chosen = self.among(scalar, self.rng.integers(1, min(4, len(scalar) + 1)))
            a = {"name": name}
            if self.maybe(0.4):
                a["range"] = [-self.u(0.05, 0.7), self.u(0.05, 0.7)]
                a["margin"] = self.maybe(0.3, lambda: self.u(0, 0.1))
                a.update(self.solver("limit"))
                self.limited_tendons.add(name)
                if not self.autolimits:
                    a["limited"] = True
            a["stiffness"] = self.maybe(0.4, lambda: self.log(0.1, 50))
            a["springlength"] = self.maybe(0.3, lambda: self.pick(self.u(-0.5, 0.5), sorted(self.u(-0.5, 0.5, 2))))
            a["damping"] = self.maybe(0.3, lambda: self.log(0.01, 2)) if self.integrator != "implicitfast" else None
            a["frictionloss"] = self.maybe(0.2, lambda: self.log(0.01, 1))
            if a["frictionloss"]:
                a.update(self.solver("friction"))
            a["armature"] = self.tendon_armature([self.moved_by[j] for j in chosen])
            terms = [element("joint", {"joint": j, "coef": self.u(-2, 2)}) for j in chosen]
            out.append(element("fixed", a, terms))
            self.tendons.append(name)
        return out

    def actuator_section(self):
        out = []
        if not self.maybe(0.65):
            return out
        targets = [("joint", n, k) for n, k in self.joints] + [("tendon", n, "tendon") for n in self.tendons]
        if not targets:
            return out
        for _ in range(self.rng.integers(1, 5)):
            where, name, kind = self.among(targets)[0]
            scalar = kind not in ("free", "ball")
            feedback = scalar and not (kind == "tendon" and self.integrator == "implicitfast")
            kinds = ["motor", "general"]
            if feedback:
                kinds += ["position", "velocity", "damper", "general", "cylinder"]
                # has no attribute that says that its range counts
                kinds += ["intvelocity"] * self.autolimits
            form = self.pick(*kinds)
            own = self.name("a")
            a = {"name": own, where: name}
            if where == "joint" and scalar and self.maybe(0.1):
                a = {"name": own, "jointinparent": name}
            a["gear"] = self.maybe(0.4, lambda: self.vector(2.0, 1 if scalar else 6))
            limits = {}
            if form != "damper":
                limits["ctrl"] = self.maybe(0.4, lambda: [-self.u(0.1, 1), self.u(0.1, 1)])
            limits["force"] = self.maybe(0.25, lambda: [-self.u(0.5, 5), self.u(0.5, 5)])
            if form == "position":
                a["kp"] = self.log(0.5, 50)
                a["kv"] = self.maybe(0.4, lambda: self.log(0.05, 3))
                if a["kv"] is None and where == "joint" and "joint" in a:
                    a["dampratio"] = self.maybe(0.3, lambda: self.u(0.2, 1.5))
                a["timeconst"] = self.maybe(0.3, lambda: self.log(0.01, 0.2))
            elif form == "velocity":
                a["kv"] = self.log(0.05, 5)
            elif form == "intvelocity":
                a.update(kp=self.log(0.5, 20), kv=self.maybe(0.4, lambda: self.log(0.05, 3)))
                limits["act"] = [-self.u(0.1, 1), self.u(0.1, 1)]
            elif form == "damper":
                a.update(kv=self.log(0.05, 3))
                limits["ctrl"] = [0, self.u(0.2, 1)]
            elif form == "cylinder":
                a.update(timeconst=self.log(0.01, 0.3), area=self.log(0.1, 3), bias=self.maybe(0.5, lambda: self.vector(1.0)))
            elif form == "general":
                a["dyntype"] = self.maybe(0.6, lambda: self.pick("integrator", "filter", "filterexact"))
                if a["dyntype"] in ("filter", "filterexact"):
                    a["dynprm"] = self.log(0.005, 0.3)
                if a["dyntype"]:
                    a["actearly"] = self.maybe(0.3)
                    limits["act"] = self.maybe(0.4, lambda: [-self.u(0.1, 1), self.u(0.1, 1)])
                a["gainprm"] = self.vector(3.0, 1)
                if feedback and self.maybe(0.5):
                    a.update(gaintype="affine", gainprm=self.vector(2.0))
                if feedback and self.maybe(0.5):
                    a.update(biastype="affine", biasprm=self.vector(2.0) * [1, 1, 0.3])
            for key, value in limits.items():
                a[key + "range"] = value
                if value is not None and not self.autolimits and (form, key) != ("damper", "ctrl"):
                    a[key + "limited"] = True
            if feedback and where == "joint" and self.maybe(0.1):
                a["armature"] = self.log(1e-3, 0.05)
            if feedback and where == "joint" and self.maybe(0.1):
                a["damping"] = self.log(1e-2, 1)
            out.append(element(form, a))
            self.actuators.append(own)
        return out

    def equality_section(self):
        out = []
        if not self.maybe(0.45):
            return out
        scalar = self.scalar_joints()
        for _ in range(self.pick(1, 1, 2, 3)):
            kind = self.pick("connect", "weld", "joint", "tendon")
            a = {"name": self.name("e"), **self.solver(), "active": self.maybe(0.1, False)}
            if kind in ("connect", "weld"):
                if len(self.sites) > 1 and self.maybe(0.3):
                    a["site1"], a["site2"] = self.among(self.sites, 2)
                else:
                    two = len(self.bodies) > 1 and self.maybe(0.6)
                    chosen = self.among(self.bodies, 2 if two else 1)
                    a.update({f"body{i + 1}": b for i, b in enumerate(chosen)})
                    if kind == "connect" or self.maybe(0.4):
                        a["anchor"] = self.vector(0.1)
                    if kind == "weld" and self.maybe(0.5):
                        a["relpose"] = [*self.vector(0.2), *self.vector(1.0, 4)]
                if kind == "weld":
                    a["torquescale"] = self.maybe(0.4, lambda: self.log(0.1, 3))
            else:
                items = scalar if kind == "joint" else self.tendons
                if not items:
                    continue
                n = min(len(items), self.pick(1, 2))
                a.update({f"{kind}{i + 1}": x for i, x in enumerate(self.among(items, n))})
                a["polycoef"] = self.maybe(0.7, lambda: self.vector(0.4, 5))
            out.append(element(kind, a))
        return out

    def contact_section(self):
        out = []
        meets = {"sphere", "capsule", "box"}
        if len(self.geoms) > 1 and self.maybe(0.3):
            (a, ka, _), (b, kb, _) = self.among(self.geoms, 2)
            known = {ka, kb} <= meets or "plane" in (ka, kb) and ka != kb or {ka, kb} == {"sphere", "cylinder"}
            if known and self.pairable(a, b):
                attributes = {"geom1": a, "geom2": b, "condim": self.maybe(0.6, lambda: self.pick(1, 3, 4, 6))}
                attributes["friction"] = self.maybe(0.6, lambda: [*self.u(0.05, 1.2, 2), *self.u(1e-3, 0.05, 3)])
                attributes["margin"] = self.maybe(0.3, lambda: self.u(0, 0.1))
                attributes["gap"] = self.maybe(0.2, lambda: self.u(0, 0.05))
                out.append(element("pair", {**attributes, **self.solver()}))
        if len(self.bodies) > 1 and self.maybe(0.2):
            a, b = self.among(self.bodies, 2)
            out.append(element("exclude", {"body1": a, "body2": b}))
        return out

    def pairable(self, a, b):
        return True

    def sensor_section(self):
        out = []
        if not self.maybe(0.7):
            return out
        for _ in range(self.rng.integers(1, 9)):
            sensor = self.sensor()
            if sensor:
                kind, a = sensor
                a = {"name": self.name("n"), **a}
                # MuJoCo refuses a cutoff on axes and quaternions
                if not kind.endswith(("axis", "quat")) and kind not in ("contact", "rangefinder", "insidesite"):
                    a["cutoff"] = self.maybe(0.1, lambda: self.log(0.01, 10))
                out.append(element(kind, a))
        return out

    def sensor(self):
        def of(items, kind, **more):
            return (kind, {**{k: self.among(v)[0] for k, v in items.items()}, **more}) if all(items.values()) else None

        scalar = self.scalar_joints()
        balls = [n for n, k in self.joints if k == "ball"]
        hinged = [j for j in scalar if j in self.limited]
        group = self.pick("site", "joint", "tendon", "actuator", "frame", "subtree", "energy", "contact", "site", "frame")
        if group == "site":
            kind = self.pick("touch", "accelerometer", "velocimeter", "gyro", "force", "torque", "magnetometer", "rangefinder")
            # those of the world itself are not evaluated
            sites = [s for s in self.sites if s not in self.world_sites] if kind in ("force", "torque") else self.sites
            return of({"site": sites}, kind)
        if group == "joint":
            kind = self.pick("jointpos", "jointvel", "ballquat", "ballangvel", "jointlimitpos", "jointlimitvel",
                             "jointlimitfrc", "jointactuatorfrc")
            if kind.startswith("ball"):
                return of({"joint": balls}, kind)
            return of({"joint": hinged if "limit" in kind else scalar}, kind)
        if group == "tendon":
            kind = self.pick("tendonpos", "tendonvel", "tendonlimitpos", "tendonlimitvel", "tendonlimitfrc", "tendonactuatorfrc")
            limited = [t for t in self.tendons if t in self.limited_tendons]
            return of({"tendon": limited if "limit" in kind else self.tendons}, kind)
        if group == "actuator":
            return of({"actuator": self.actuators}, self.pick("actuatorpos", "actuatorvel", "actuatorfrc"))
        if group == "subtree":
            return of({"body": self.bodies}, self.pick("subtreecom", "subtreelinvel", "subtreeangmom"))
        if group == "energy":
            return self.pick("e_potential", "e_kinetic"), {}
        frames = {"body": self.bodies, "xbody": self.bodies, "geom": [g for g, _, _ in self.geoms], "site": self.sites,
                  "camera": self.cameras}
        if group == "contact":
            if not self.maybe(0.5):
                kind = self.pick("site", "body", "xbody", "geom")
                if not self.sites or not frames[kind]:
                    return None
                a = {"site": self.among(self.sites)[0], "objtype": kind, "objname": self.among(frames[kind])[0]}
                return "insidesite", a
            a = {"geom1": self.among(frames["geom"])[0], "data": "found"}
            return "contact", a
        kind = self.pick("framepos", "framequat", "framexaxis", "frameyaxis", "framezaxis", "framelinvel", "frameangvel",
                         "framelinacc", "frameangacc")
        kinds = [k for k, v in frames.items() if v]
        first, second = self.pick(*kinds), self.pick(*kinds)
        a = {"objtype": first, "objname": self.among(frames[first])[0]}
        if self.maybe(0.4) and not kind.endswith("acc"):
            a.update(reftype=second, refname=self.among(frames[second])[0])
        return kind, a

    def option(self):
        self.integrator = self.pick("Euler", "Euler", "implicitfast", "RK4")
        out = {
            "timestep": self.pick(0.001, 0.002, 0.005, 0.01),
            "integrator": self.integrator,
            "cone": self.pick("pyramidal", "elliptic"),
            "impratio": self.maybe(0.3, lambda: self.log(0.5, 10)),
            "gravity": self.maybe(0.3, lambda: self.vector(5.0)),
            "magnetic": self.maybe(0.1, lambda: self.vector(1.0)),
        }
        if self.integrator != "implicitfast" and self.maybe(0.15):
            out["density"] = self.maybe(0.7, lambda: self.log(1, 1000))
            out["viscosity"] = self.maybe(0.7, lambda: self.log(1e-5, 1))
            out["wind"] = self.maybe(0.5, lambda: self.vector(2.0))
        if self.integrator != "RK4" and self.late.random() < 0.2:
            out["integrator"] = "implicit"
        if self.integrator == "implicitfast" and self.late.random() < 0.2:
            out["density"], out["viscosity"] = self.late.uniform(0, 500), self.late.uniform(0, 0.5)
        if self.caps.random() < 0.3:
            out["iterations"], out["ls_iterations"] = self.caps.integers(1, 6), self.caps.integers(4, 11)
            out["solver"] = "CG" if self.caps.random() < 0.2 else None
        flags = {}
        for flag in ["gravity", "limit", "equality", "frictionloss", "contact", "spring", "damper", "clampctrl",
                     "warmstart", "actuation", "refsafe", "eulerdamp", "filterparent", "constraint"]:
            if self.maybe(0.02):
                flags[flag] = "disable"
        if self.maybe(0.05):
            flags["override"] = "enable"
            out.update(o_margin=self.u(0, 0.02), o_solref=[self.log(0.01, 0.1), self.u(0.5, 1.2)],
                       o_solimp=[self.u(0.3, 0.8), self.u(0.8, 0.95), self.log(0.001, 0.05), 0.5, 2],
                       o_friction=[*self.u(0.1, 1, 2), *self.u(0.001, 0.05, 3)])
        return element("option", out, [element("flag", flags)] if flags else ())

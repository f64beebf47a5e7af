"""Draws models in MJCF that use everything Marathon supports, in any combination. A seed's model depends on nothing else."""

import mujoco
import numpy as np

import drive_generator
import string_generator


def text(x):
    """A number or a list of them as an attribute."""
    if isinstance(x, str):
        return x
    if isinstance(x, (bool, np.bool_)):
        return "true" if x else "false"
    if np.ndim(x) == 0:
        return f"{x:.5g}"
    return " ".join(f"{v:.5g}" for v in x)


def element(name, attributes, children=()):
    pairs = " ".join(f'{k.rstrip("_")}="{text(v)}"' for k, v in attributes.items() if v is not None)
    head = f"<{name} {pairs}".rstrip()
    if not children:
        return [head + "/>"]
    return [head + ">", *("  " + line for c in children for line in c), f"</{name}>"]


class Generator:
    """Draws a model. It uses only features that `docs/reference/mjcf.md` lists as supported."""

    def __init__(self, seed):
        self.seed = seed
        self.rng = np.random.default_rng([2026, seed])
        # the solver's caps use a separate random stream, because low caps were added later
        self.caps = np.random.default_rng([2029, seed])
        # so do features that were added later still
        self.late = np.random.default_rng([2035, seed])
        self.path, self.moved_by = [], {}
        self.count = {}
        self.joints, self.bodies, self.geoms, self.sites, self.tendons, self.actuators = [], [], [], [], [], []
        self.limited, self.limited_tendons = set(), set()
        self.cameras = []
        self.links = {}

    # draws

    def maybe(self, p, value=True):
        """`value()` or `value` with probability p, else None."""
        if self.rng.random() >= p:
            return None
        return value() if callable(value) else value

    def pick(self, *choices):
        return choices[self.rng.integers(len(choices))]

    def among(self, items, n=1):
        return [items[i] for i in self.rng.choice(len(items), size=n, replace=False)]

    def u(self, low, high, n=None):
        return self.rng.uniform(low, high, n)

    def log(self, low, high):
        return float(np.exp(self.rng.uniform(np.log(low), np.log(high))))

    def vector(self, scale, n=3):
        return self.rng.normal(size=n) * scale

    def name(self, kind):
        self.count[kind] = self.count.get(kind, 0) + 1
        return f"{kind}{self.count[kind]}"

    def angle(self, x):
        return np.asarray(x) * (180 / np.pi if self.degrees else 1.0)

    # parts

    def orientation(self, p=0.6):
        """An orientation in one of its forms."""
        if not self.maybe(p):
            return {}
        form = self.pick("quat", "euler", "axisangle", "xyaxes", "zaxis", "turn")
        if form == "quat":
            return {"quat": self.vector(1.0, 4)}
        if form == "euler":
            return {"euler": self.angle(self.u(-3, 3, 3))}
        if form == "axisangle":
            return {"axisangle": [*self.vector(1.0), self.angle(self.u(-3, 3))]}
        if form == "xyaxes":
            return {"xyaxes": self.vector(1.0, 6)}
        if form == "zaxis":
            return {"zaxis": self.vector(1.0)}
        # quarter turns are what people write
        axis = np.zeros(3)
        axis[self.rng.integers(3)] = self.pick(-1, 1)
        return {"axisangle": [*axis, self.angle(self.pick(0.5, 1.0, 1.5) * np.pi)]}

    def solver(self, suffix=""):
        """Solver parameters, sometimes."""
        out = {}
        if self.maybe(0.3):
            standard = [self.log(0.005, 0.1), self.u(0.3, 1.5)]
            out["solref" + suffix] = standard if self.maybe(0.7) else [-self.log(50, 3000), -self.log(1, 80)]
        if self.maybe(0.3):
            low = self.u(0.1, 0.95)
            high = self.u(low, 0.99)
            out["solimp" + suffix] = [low, high, self.log(1e-3, 0.1), self.u(0.1, 0.9), self.pick(1, 2, 3, self.u(1, 4))]
        return out

    def contact(self):
        """Contact parameters, sometimes."""
        return {
            "condim": self.maybe(0.6, lambda: self.pick(1, 3, 4, 6)),
            "friction": self.maybe(0.5, lambda: [self.u(0, 1.5), self.log(1e-3, 0.1), self.log(1e-4, 0.05)]),
            "margin": self.maybe(0.25, lambda: self.u(0, 0.05)),
            "gap": self.maybe(0.1, lambda: self.u(0, 0.03)),
            "priority": self.maybe(0.1, lambda: self.pick(-1, 1, 2)),
            "solmix": self.maybe(0.1, lambda: self.pick(0, self.u(0.1, 3))),
            **self.solver(),
        }

    def size(self, kind, scale=1.0):
        n = {"sphere": 1, "capsule": 2, "cylinder": 2, "ellipsoid": 3, "box": 3}[kind]
        return self.u(0.04, 0.15, n) * scale

    def geom(self, moving, kinds=("sphere", "capsule", "box", "cylinder", "ellipsoid")):
        kind = self.pick(*kinds)
        name = self.name("g")
        out = {"name": name, "type": kind if kind != "sphere" or self.maybe(0.7) else None}
        if kind in ("capsule", "cylinder", "box", "ellipsoid") and self.maybe(0.2):
            ends = self.vector(0.1, 6)
            out["fromto"] = ends
            n = 1 if kind in ("capsule", "cylinder") else 2
            out["size"] = self.u(0.04, 0.1, n)
        else:
            out.update(size=self.size(kind), pos=self.maybe(0.6, lambda: self.vector(0.1)), **self.orientation(0.5))
        # which shapes meet: 1 round ones and boxes, 2 what meets planes only, 4 height fields, 8 spheres with cylinders
        if kind in ("cylinder", "ellipsoid"):
            contype, conaffinity = 2, 0
            if kind == "cylinder" and self.maybe(0.5):
                contype |= 8
        else:
            contype, conaffinity = 1, 1
            if kind != "box":
                contype |= 4
            if kind == "sphere":
                conaffinity |= 8
        if self.maybe(0.15):
            contype = conaffinity = 0
        out.update(contype=contype, conaffinity=conaffinity, **self.contact())
        if moving and self.late.random() < 0.1:
            out["fluidshape"] = "ellipsoid"
            out["fluidcoef"] = self.late.uniform(0, 2, self.late.integers(1, 6)) if self.late.random() < 0.5 else None
        if moving:
            out["mass"] = self.maybe(0.4, lambda: self.log(0.05, 5))
            out["density"] = self.maybe(0.2, lambda: self.log(200, 3000)) if out["mass"] is None else None
        out["rgba"] = self.maybe(0.1, lambda: [*self.u(0, 1, 3), self.pick(0, 0.5, 1)])
        out["group"] = self.maybe(0.1, lambda: self.pick(0, 1, 2, 3))
        self.geoms.append((name, kind, bool(contype & 1)))
        return element("geom", out)

    def site(self):
        kind = self.pick("sphere", "capsule", "box", "cylinder", "ellipsoid")
        name = self.name("s")
        self.sites.append(name)
        self.moved_by[name] = list(self.path)
        out = {"name": name, "type": kind, "size": self.size(kind), "pos": self.vector(0.1), **self.orientation(0.5)}
        return element("site", out)

    def camera(self):
        name = self.name("cam")
        self.cameras.append(name)
        return element("camera", {"name": name, "pos": self.vector(0.3), **self.orientation()})

    def joint(self, kind, name, place, heavy):
        """A joint; `place` counts those of its body, whose axes must differ; a `heavy` one has armature."""
        out = {"name": name, "type": kind}
        self.moved_by[name] = list(self.path)
        out["actuatorgravcomp"] = True if self.late.random() < 0.1 else None
        if kind in ("hinge", "slide"):
            axis = np.zeros(3)
            axis[place % 3] = self.pick(-1, 1)
            out["axis"] = axis if self.maybe(0.5) else axis + self.vector(0.3)
        if kind in ("hinge", "ball"):
            out["pos"] = self.maybe(0.4, lambda: self.vector(0.1))
        rotates = kind != "slide"
        turn = (lambda x: self.angle(x)) if rotates else (lambda x: x)
        span = 1.0 if rotates else 0.2
        if kind in ("hinge", "slide"):
            out["ref"] = self.maybe(0.15, lambda: turn(self.u(-0.5, 0.5) * span))
            out["springref"] = self.maybe(0.2, lambda: turn(self.u(-0.5, 0.5) * span))
        if self.maybe(0.35):
            if kind == "ball":
                out["range"] = [0, turn(self.u(0.2, 2.5))]
            else:
                out["range"] = turn(np.array([-self.u(0.05, 1), self.u(0.05, 1)]) * span)
            out["margin"] = self.maybe(0.3, lambda: turn(self.u(0, 0.1) * span))
            out.update(self.solver("limit"))
            self.limited.add(name)
            if not self.autolimits:
                out["limited"] = True
        out["stiffness"] = self.maybe(0.3, lambda: self.log(0.1, 50))
        out["damping"] = self.maybe(0.5, lambda: self.log(0.01, 3))
        if out["stiffness"] is not None and self.maybe(0.1):
            out["springdamper"] = [self.log(0.05, 0.5), self.u(0.3, 1.5)]
        out["armature"] = self.maybe(1.0 if heavy else 0.4, lambda: self.log(1e-3, 0.1))
        out["frictionloss"] = self.maybe(0.15, lambda: self.log(0.01, 1))
        if out["frictionloss"]:
            out.update(self.solver("friction"))
        if kind in ("hinge", "slide"):
            out["actuatorfrcrange"] = self.maybe(0.1, lambda: [-self.u(0.1, 3), self.u(0.1, 3)])
            if out["actuatorfrcrange"] is not None and not self.autolimits:
                out["actuatorfrclimited"] = True
        return element("joint", out)

    def joint_kinds(self, depth):
        if depth == 0 and self.maybe(0.55):
            return ["free"]
        kinds = self.pick(
            ["hinge"], ["hinge"], ["hinge"], ["slide"], ["ball"], ["hinge", "hinge"], ["slide", "hinge"],
            ["hinge", "slide"], ["slide", "ball"], ["hinge", "ball"], ["hinge", "hinge", "hinge"],
            ["slide", "slide", "hinge"], ["slide", "slide", "slide", "ball"],
        )
        return [] if depth > 0 and self.maybe(0.2) else list(kinds)

    def inertial(self):
        out = {"pos": self.vector(0.05), "mass": self.log(0.1, 5)}
        a, b = self.log(1e-3, 0.1), self.log(1e-3, 0.1)
        if self.maybe(0.5):
            out.update(diaginertia=[a, b, self.u(abs(a - b) + 1e-4, a + b)], **self.orientation(0.5))
        else:
            # a positive definite matrix whose moments satisfy the triangle inequality
            m = self.vector(1.0, 9).reshape(3, 3)
            s = m @ m.T * a
            full = np.trace(s) * np.eye(3) - 0.99 * s
            out["fullinertia"] = [full[0, 0], full[1, 1], full[2, 2], full[0, 1], full[0, 2], full[1, 2]]
        return element("inertial", out)

    def body(self, depth, top=None, mocap=False):
        name = self.name("b")
        kinds = [] if mocap else self.joint_kinds(depth)
        self.bodies.append(name)
        out = {"name": name, "pos": top if top is not None else self.vector(0.2), **self.orientation(0.5)}
        out["mocap"] = mocap or None
        out["gravcomp"] = self.maybe(0.12, lambda: self.pick(1, 0.5, self.u(-0.5, 1.5)))
        children = []
        self.path.append(name if kinds else None)
        free = kinds == ["free"]
        if free and self.maybe(0.7):
            joint = self.name("j")
            self.joints.append((joint, "free"))
            children.append(element("freejoint", {"name": joint}))
        else:
            first = self.rng.integers(3)
            for place, kind in enumerate(kinds, first):
                joint = self.name("j")
                self.joints.append((joint, kind))
                if free:
                    plain = {"name": joint, "type": "free", "damping": self.maybe(0.5, lambda: self.log(0.01, 1))}
                    plain["stiffness"] = self.maybe(0.4, lambda: self.log(0.1, 20))
                    plain["armature"] = self.maybe(0.3, lambda: self.log(1e-3, 0.1))
                    plain["frictionloss"] = self.maybe(0.1, lambda: self.log(0.01, 1))
                    children.append(element("joint", plain))
                else:
                    children.append(self.joint(kind, joint, place, "hinge" in kinds and "ball" in kinds))
        if not mocap and self.maybe(0.2):
            children.append(self.inertial())
        for _ in range(self.pick(1, 1, 1, 2, 3)):
            geom = self.geom(not mocap)
            wrap = self.maybe(0.1)
            if wrap:
                geom = element("frame", {"pos": self.vector(0.05), **self.orientation()}, [geom])
            children.append(geom)
        for _ in range(self.pick(0, 0, 1, 2)):
            children.append(self.site())
        if self.maybe(0.1):
            children.append(self.camera())
        if depth < 3 and self.left > 0:
            for _ in range(self.pick(0, 1, 1, 2)):
                if self.left > 0:
                    self.left -= 1
                    children.append(self.body(depth + 1))
        self.path.pop()
        return element("body", out, children)

    def world(self):
        children = []
        if self.maybe(0.75):
            plane = {"name": self.name("g"), "type": "plane", "size": "5 5 0.1", "contype": 1, "conaffinity": 3}
            if self.maybe(0.3):
                plane.update(pos=self.vector(0.1), zaxis=[*self.vector(0.3, 2), 1])
            elif self.maybe(0.3):
                plane["pos"] = [0, 0, self.u(-0.2, 0.2)]
            plane.update(self.contact())
            children.append(element("geom", plane))
            self.geoms.append((plane["name"], "plane", False))
        if self.field:
            out = {"name": self.name("g"), "type": "hfield", "hfield": "terrain", "contype": 0, "conaffinity": 4}
            out["pos"] = [*self.vector(0.2, 2), self.u(-0.3, 0)]
            if self.maybe(0.3):
                out["euler"] = self.angle(self.u(-0.3, 0.3, 3))
            out.update(self.contact())
            children.append(element("geom", out))
        for _ in range(self.pick(0, 0, 1, 2)):
            children.append(self.geom(False, ("sphere", "capsule", "box", "cylinder")))
        if self.maybe(0.3):
            children.append(self.site())
        if self.maybe(0.15):
            # a body that stands still, with another welded to it
            name = self.name("b")
            self.bodies.append(name)
            inner = element("body", {"pos": self.vector(0.2), **self.orientation()}, [self.geom(False), self.site()])
            out = {"name": name, "pos": self.vector(0.4), **self.orientation()}
            children.append(element("body", out, [self.geom(False), inner]))
        self.left = self.pick(1, 2, 3, 4, 6)
        trees = self.pick(1, 1, 2, 3)
        for _ in range(trees):
            place = [*self.vector(0.25, 2), self.u(0, 0.7)]
            children.append(self.body(0, place))
        if self.maybe(0.25):
            self.left += 1
            children.append(self.body(0, [*self.vector(0.3, 2), self.u(0, 0.5)], mocap=True))
        return children

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

    def model(self):
        self.degrees, self.autolimits = bool(self.maybe(0.7)), bool(self.maybe(0.9))
        self.field = bool(self.maybe(0.15))
        self.world_sites = []
        compiler = {
            "angle": self.maybe(1.0 if not self.degrees else 0.3, "degree" if self.degrees else "radian"),
            "autolimits": None if self.autolimits else False,
            "eulerseq": self.maybe(0.2, lambda: self.pick("xyz", "zyx", "ZXZ", "XYZ", "yxZ")),
            "boundmass": self.maybe(0.1, lambda: self.log(0.01, 0.3)),
            "boundinertia": self.maybe(0.1, lambda: self.log(1e-4, 1e-2)),
            "balanceinertia": self.maybe(0.1),
            "settotalmass": self.maybe(0.1, lambda: self.log(1, 30)),
            "inertiafromgeom": self.maybe(0.1, lambda: self.pick("true", "auto")),
        }
        parts = [element("compiler", compiler), self.option()]
        if self.maybe(0.3):
            parts.append(element("default", {}, [
                element("geom", {"density": self.log(300, 2000), **self.solver()}),
                element("joint", {"armature": self.log(1e-3, 0.05)}),
            ]))
        if self.field:
            rows, columns = self.rng.integers(2, 8, 2)
            # its orientation and the asset's size are MuJoCo's; elevations are normalized by both sides
            parts.append(element("asset", {}, [element("hfield", {
                "name": "terrain", "nrow": rows, "ncol": columns, "size": [*self.u(0.6, 1.5, 2), self.u(0.02, 0.2), 0.1],
                "elevation": self.u(0, 1, rows * columns),
            })]))
        world = self.world()
        parts.append(element("worldbody", {}, world))
        self.world_sites = [s for s in self.sites if any(f'name="{s}"' in c[0] for c in world if c[0].startswith("<site"))]
        sections = [("tendon", self.tendon_section), ("actuator", self.actuator_section),
                    ("equality", self.equality_section), ("contact", self.contact_section), ("sensor", self.sensor_section)]
        drawn = [(name, section()) for name, section in sections]
        strings = string_generator.sections(self, self.seed, element)
        drives = drive_generator.sections(self, self.seed, element)
        for name, children in [*drawn, *strings.items(), *drives.items()]:
            if children:
                parts.append(element(name, {}, children))
        return "\n".join(element("mujoco", {"model": "random"}, parts)) + "\n"


def with_keyframe(xml, rng):
    """The model with a keyframe, for which its sizes must be known."""
    model = mujoco.MjModel.from_xml_string(xml)
    if rng.random() < 0.2:
        q = text(rng.normal(size=model.nq)) if model.nq else None
        v = text(rng.normal(size=rng.integers(1, model.nv + 1))) if model.nv else None
        key = element("keyframe", {}, [element("key", {"name": "k", "qpos": q, "qvel": v, "time": 0.5})])
        xml = xml.replace("</mujoco>", "\n".join("  " + line for line in key) + "\n</mujoco>")
    return xml


def random_model(seed):
    xml = Generator(seed).model()
    return with_keyframe(xml, np.random.default_rng([2027, seed]))

"""Draws models in MJCF that use everything Marathon supports, in any combination. A seed's model depends on nothing else."""

import mujoco
import numpy as np

import drive_generator
import string_generator
from random_draws import element, text
from section_generator import Sections


class Generator(Sections):
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

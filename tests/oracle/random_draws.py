"""Elements of MJCF, and draws from a stream of random numbers: the base of all generators of random models."""

import numpy as np


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


class Draws:
    """Draws from `self.rng`. `self.count` numbers the names, `self.degrees` is the unit of angles."""

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

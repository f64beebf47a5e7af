//! Parts of the tree of bodies: bodies, joints, geoms, sites.

use super::kind::Kind;
use super::part::{Draft, part};
use super::value::AttrValue;
use crate::model::{Quat, Vec3};

part! {
    /// A body. Its mass comes from its geoms, unless `inertiafromgeom` or an `<inertial>` says otherwise.
    Body: Body in BodyPart {
        /// A body with a name, at the origin of its parent.
        pub fn new(name: &str) -> Self {
            Body(Draft::new("body").with("name", name))
        }

        /// Position in its parent's frame, m.
        pub fn pos(self, pos: Vec3) -> Self {
            self.set("pos", pos)
        }

        /// Orientation in its parent's frame, `[w, x, y, z]`.
        pub fn quat(self, quat: Quat) -> Self {
            self.set("quat", quat)
        }

        /// Default class of everything in it that names no other.
        pub fn childclass(self, class: &str) -> Self {
            self.set("childclass", class)
        }
    }
}

part! {
    /// A joint: the degrees of freedom between a body and its parent.
    Joint: Joint in BodyPart {
        /// A rotation about an axis of the body.
        pub fn hinge(axis: Vec3) -> Self {
            Joint(Draft::new("joint").with("type", "hinge").with("axis", axis))
        }

        /// A translation along an axis of the body.
        pub fn slide(axis: Vec3) -> Self {
            Joint(Draft::new("joint").with("type", "slide").with("axis", axis))
        }

        /// Any rotation about a point.
        pub fn ball() -> Self {
            Joint(Draft::new("joint").with("type", "ball"))
        }

        /// Any motion; for children of the world. Default classes do not apply to it.
        pub fn free() -> Self {
            Joint(Draft::new("freejoint"))
        }

        /// Name.
        pub fn name(self, name: &str) -> Self {
            self.set("name", name)
        }

        /// Default class.
        pub fn class(self, class: &str) -> Self {
            self.set("class", class)
        }

        /// The point that a hinge or ball turns about, in the body's frame, m.
        pub fn pos(self, pos: Vec3) -> Self {
            self.set("pos", pos)
        }

        /// Lowest and highest position: m for a slide, else in the angle unit of the model's `<compiler>`, degrees by default.
        pub fn range(self, range: [f64; 2]) -> Self {
            self.set("range", range)
        }

        /// Damping, N s/m or N m s/rad.
        pub fn damping(self, damping: f64) -> Self {
            self.set("damping", damping)
        }

        /// Stiffness of its spring, N/m or N m/rad.
        pub fn stiffness(self, stiffness: f64) -> Self {
            self.set("stiffness", stiffness)
        }

        /// Inertia of its rotor, kg or kg m^2.
        pub fn armature(self, armature: f64) -> Self {
            self.set("armature", armature)
        }
    }
}

part! {
    /// A shape that collides and weighs.
    Geom: Geom in BodyPart {
        /// A ball of a radius in m.
        pub fn sphere(radius: f64) -> Self {
            Geom(Draft::new("geom").with("type", "sphere").with("size", radius))
        }

        /// A capsule from point to point, of a radius, all in m.
        pub fn capsule(from: Vec3, to: Vec3, radius: f64) -> Self {
            let ends = [from, to].concat();
            Geom(Draft::new("geom").with("type", "capsule").with("fromto", ends.as_slice()).with("size", radius))
        }

        /// A cylinder from point to point, of a radius, all in m.
        pub fn cylinder(from: Vec3, to: Vec3, radius: f64) -> Self {
            let ends = [from, to].concat();
            Geom(Draft::new("geom").with("type", "cylinder").with("fromto", ends.as_slice()).with("size", radius))
        }

        /// An ellipsoid, given half of its axes in m.
        pub fn ellipsoid(half_axes: Vec3) -> Self {
            Geom(Draft::new("geom").with("type", "ellipsoid").with("size", half_axes))
        }

        /// A box, given half of its sides in m.
        pub fn cuboid(half_sides: Vec3) -> Self {
            Geom(Draft::new("geom").with("type", "box").with("size", half_sides))
        }

        /// An infinite plane that looks along +z; for the world.
        pub fn plane() -> Self {
            Geom(Draft::new("geom").with("type", "plane").with("size", [0.0, 0.0, 1.0]))
        }

        /// Terrain in the shape of a height field, see [`HField`](super::HField).
        pub fn hfield(field: &str) -> Self {
            Geom(Draft::new("geom").with("type", "hfield").with("hfield", field))
        }

        /// A mesh of the model. It collides as its convex hull.
        pub fn mesh(mesh: &str) -> Self {
            Geom(Draft::new("geom").with("type", "mesh").with("mesh", mesh))
        }

        /// Name.
        pub fn name(self, name: &str) -> Self {
            self.set("name", name)
        }

        /// Default class.
        pub fn class(self, class: &str) -> Self {
            self.set("class", class)
        }

        /// Position of its center in the body's frame, m.
        pub fn pos(self, pos: Vec3) -> Self {
            self.set("pos", pos)
        }

        /// Orientation in the body's frame, `[w, x, y, z]`.
        pub fn quat(self, quat: Quat) -> Self {
            self.set("quat", quat)
        }

        /// Mass, kg.
        pub fn mass(self, mass: f64) -> Self {
            self.set("mass", mass)
        }

        /// Mass by its density, kg/m^3.
        pub fn density(self, density: f64) -> Self {
            self.set("density", density)
        }

        /// Friction coefficients: sliding, torsional (m), rolling (m).
        pub fn friction(self, friction: [f64; 3]) -> Self {
            self.set("friction", friction)
        }

        /// Bit masks of collision. Two geoms collide if the `contype` of one shares a bit with the `conaffinity` of the other.
        pub fn collision(self, contype: i32, conaffinity: i32) -> Self {
            self.set("contype", contype).set("conaffinity", conaffinity)
        }

        /// Color with opacity, 0 to 1.
        pub fn rgba(self, rgba: [f64; 4]) -> Self {
            self.set("rgba", rgba)
        }
    }
}

part! {
    /// A place on a body that sensors and constraints refer to.
    Site: Site in BodyPart {
        /// A small ball with a name, at the body's origin.
        pub fn new(name: &str) -> Self {
            Site(Draft::new("site").with("name", name))
        }

        /// Default class.
        pub fn class(self, class: &str) -> Self {
            self.set("class", class)
        }

        /// Position in the body's frame, m.
        pub fn pos(self, pos: Vec3) -> Self {
            self.set("pos", pos)
        }

        /// Orientation in the body's frame, `[w, x, y, z]`.
        pub fn quat(self, quat: Quat) -> Self {
            self.set("quat", quat)
        }

        /// Size, m; what the numbers mean depends on its `type`.
        pub fn size(self, size: &[f64]) -> Self {
            self.set("size", size)
        }
    }
}

//! Parts of the model outside the tree of bodies: height fields, meshes, tendons, constraints, actuators, sensors, keyframes.

use super::kind::Kind;
use super::part::{Draft, part};
use super::value::AttrValue;
use crate::model::Vec3;

part! {
    /// A height field: a grid of elevations. [`Geom::hfield`](super::Geom::hfield) puts it into the world.
    HField: HField in ModelPart {
        /// A level field of `rows` along y times `cols` along x points. `size`: half its length along x and along y, height of
        /// elevation 1 above elevation 0, and thickness below elevation 0, all in m and positive.
        pub fn new(name: &str, rows: usize, cols: usize, size: [f64; 4]) -> Self {
            HField(Draft::new("hfield").with("name", name).with("nrow", rows).with("ncol", cols).with("size", size))
        }

        /// Elevations of all points, row by row from the largest y on. They are scaled to the range from 0 to 1.
        pub fn elevation(self, elevation: &[f64]) -> Self {
            self.set("elevation", elevation)
        }
    }
}

part! {
    /// A mesh of triangles. [`Geom::mesh`](super::Geom::mesh) puts it into the world.
    Mesh: Mesh in ModelPart {
        /// The mesh of a file (STL, OBJ or MSH), named relative to the model's folder of meshes.
        pub fn file(name: &str, file: &str) -> Self {
            Mesh(Draft::new("mesh").with("name", name).with("file", file))
        }

        /// The convex hull of at least four points in m, three numbers each.
        pub fn points(name: &str, points: &[f64]) -> Self {
            Mesh(Draft::new("mesh").with("name", name).with("vertex", points))
        }

        /// Factors of its coordinates.
        pub fn scale(self, scale: Vec3) -> Self {
            self.set("scale", scale)
        }
    }
}

part! {
    /// An actuator on a joint, a tendon, a site or the contacts of a body.
    Actuator: Actuator in ModelPart {
        /// Its force is the control times `gear`.
        pub fn motor(name: &str) -> Self {
            Actuator(Draft::new("motor").with("name", name))
        }

        /// A servo of stiffness `kp` (N/m or N m/rad) whose control is the target position.
        pub fn position(name: &str, kp: f64) -> Self {
            Actuator(Draft::new("position").with("name", name).with("kp", kp))
        }

        /// A servo of damping `kv` (N s/m or N m s/rad) whose control is the target velocity.
        pub fn velocity(name: &str, kv: f64) -> Self {
            Actuator(Draft::new("velocity").with("name", name).with("kv", kv))
        }

        /// Any gain and bias: `gaintype`, `gainprm`, `biastype`, `biasprm`, `dyntype`...
        pub fn general(name: &str) -> Self {
            Actuator(Draft::new("general").with("name", name))
        }

        /// Pulls a body towards what it touches. The force, the control times `gain`, is spread over the contacts.
        pub fn adhesion(name: &str, body: &str, gain: f64, ctrl_range: [f64; 2]) -> Self {
            let draft = Draft::new("adhesion").with("name", name).with("body", body);
            Actuator(draft.with("gain", gain).with("ctrlrange", ctrl_range))
        }

        /// The joint that it moves.
        pub fn joint(self, joint: &str) -> Self {
            self.set("joint", joint)
        }

        /// The tendon that it pulls.
        pub fn tendon(self, tendon: &str) -> Self {
            self.set("tendon", tendon)
        }

        /// The site that it pushes and turns, along the site's axes. `gear` has the force first, then the torque.
        pub fn site(self, site: &str, gear: [f64; 6]) -> Self {
            self.set("site", site).set("gear", gear)
        }

        /// The site whose axes the force and torque at its [`site`](Self::site) are along, and which takes their opposites.
        pub fn reference_site(self, site: &str) -> Self {
            self.set("refsite", site)
        }

        /// A rod of some length (m) from the site `crank` to a slider on the z axis of the site `slider`.
        pub fn slider_crank(self, crank: &str, slider: &str, rod: f64) -> Self {
            self.set("cranksite", crank).set("slidersite", slider).set("cranklength", rod)
        }

        /// Default class.
        pub fn class(self, class: &str) -> Self {
            self.set("class", class)
        }

        /// Ratio of the force at the joint or tendon to the force of the actuator.
        pub fn gear(self, gear: f64) -> Self {
            self.set("gear", gear)
        }

        /// Range that its control is clamped to.
        pub fn ctrl_range(self, range: [f64; 2]) -> Self {
            self.set("ctrllimited", true).set("ctrlrange", range)
        }

        /// Range that its force is clamped to, N or N m before the gear.
        pub fn force_range(self, range: [f64; 2]) -> Self {
            self.set("forcelimited", true).set("forcerange", range)
        }
    }
}

part! {
    /// A tendon whose length is a sum of joint positions.
    Tendon: Tendon in ModelPart {
        /// A tendon over no joints yet.
        pub fn fixed(name: &str) -> Self {
            Tendon(Draft::new("fixed").with("name", name))
        }

        /// Adds a hinge or slide, and what its position is multiplied by.
        pub fn joint(self, joint: &str, coef: f64) -> Self {
            Tendon(self.0.containing(Draft::new("joint").with("joint", joint).with("coef", coef)))
        }
    }
}

part! {
    /// An equality constraint.
    Equality: Equality in ModelPart {
        /// Holds a point of one body (in its frame, m) at the same place of another one; `world` is a body, too.
        pub fn connect(body1: &str, body2: &str, anchor: Vec3) -> Self {
            Equality(Draft::new("connect").with("body1", body1).with("body2", body2).with("anchor", anchor))
        }

        /// Holds two bodies as they are in the reference configuration; `world` is a body, too.
        pub fn weld(body1: &str, body2: &str) -> Self {
            Equality(Draft::new("weld").with("body1", body1).with("body2", body2))
        }

        /// Holds two joints at the same distance from their reference positions.
        pub fn joints(joint1: &str, joint2: &str) -> Self {
            Equality(Draft::new("joint").with("joint1", joint1).with("joint2", joint2))
        }

        /// Name.
        pub fn name(self, name: &str) -> Self {
            self.set("name", name)
        }
    }
}

part! {
    /// Two bodies that do not collide.
    ContactExclude: ContactExclude in ModelPart {
        /// The bodies.
        pub fn new(body1: &str, body2: &str) -> Self {
            ContactExclude(Draft::new("exclude").with("body1", body1).with("body2", body2))
        }

        /// Name.
        pub fn name(self, name: &str) -> Self {
            self.set("name", name)
        }
    }
}

part! {
    /// A sensor. Its type is its MJCF element.
    Sensor: Sensor in ModelPart {
        /// A sensor of a type, such as `touch`, and its name. `set` says what it measures: `.set("site", "foot")`.
        pub fn new(sensor: &str, name: &str) -> Self {
            Sensor(Draft::new(sensor).with("name", name))
        }
    }
}

part! {
    /// A keyframe: a state of the whole model.
    Keyframe: Keyframe in ModelPart {
        /// The reference configuration at rest.
        pub fn new(name: &str) -> Self {
            Keyframe(Draft::new("key").with("name", name))
        }

        /// Positions, one number per coordinate of `qpos`.
        pub fn qpos(self, qpos: &[f64]) -> Self {
            self.set("qpos", qpos)
        }

        /// Velocities, one number per degree of freedom.
        pub fn qvel(self, qvel: &[f64]) -> Self {
            self.set("qvel", qvel)
        }

        /// Controls, one number per actuator.
        pub fn ctrl(self, ctrl: &[f64]) -> Self {
            self.set("ctrl", ctrl)
        }
    }
}

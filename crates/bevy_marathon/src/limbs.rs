//! Limbs: the actuators of a model by the names and places of the bodies that they move.

use marathon_physics::Model;
use std::sync::Arc;

/// The actuators of a model and its tree of bodies.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Limbs {
    /// One per actuator.
    limbs: Vec<Limb>,
    /// One per body.
    bodies: Vec<Body>,
    /// Mass of the character, kg.
    pub mass: f64,
}

#[derive(Clone, Debug, PartialEq)]
struct Limb {
    name: String,
    /// Body that its joint moves; `None` for one that acts on a tendon.
    body: Option<usize>,
}

#[derive(Clone, Debug, PartialEq)]
struct Body {
    name: String,
    parent: usize,
    /// Mass, kg.
    mass: f64,
    /// Whether it belongs to a leg.
    leg: bool,
}

impl Limbs {
    /// The limbs of a model whose geoms `feet` may touch the ground.
    pub fn of(model: &Model, feet: &[Arc<str>]) -> Self {
        let limbs = model.actuators.iter().map(|actuator| Limb {
            name: actuator.name.clone(),
            body: actuator.joint().and_then(|joint| model.joints.get(joint)).map(|joint| joint.body),
        });
        let bodies = model.bodies.iter().map(|body| Body {
            name: body.name.clone(),
            parent: body.parent,
            mass: body.mass,
            leg: false,
        });
        let mut limbs = Limbs { limbs: limbs.collect(), bodies: bodies.collect(), mass: 0.0 };
        limbs.mass = limbs.bodies.iter().map(|body| body.mass).sum();
        for geom in model.geoms.iter().filter(|geom| feet.iter().any(|foot| **foot == *geom.name)) {
            limbs.mark_leg(geom.body);
        }
        limbs
    }

    /// Marks the bodies from a foot up to the one where the tree branches, or the root.
    fn mark_leg(&mut self, foot: usize) {
        let mut body = foot;
        while body != 0 && self.bodies[body].parent != 0 {
            let branches = self.bodies.iter().filter(|child| child.parent == body).count() > 1;
            if branches && body != foot {
                return;
            }
            self.bodies[body].leg = true;
            body = self.bodies[body].parent;
        }
    }

    /// Number of actuators.
    pub fn len(&self) -> usize {
        self.limbs.len()
    }

    /// The actuators of a name: its own, or all that move the body of this name.
    pub fn named<'a>(&'a self, name: &'a str) -> impl Iterator<Item = usize> + 'a {
        let is = move |limb: &Limb| {
            !name.is_empty() && (limb.name == name || limb.body.is_some_and(|body| self.bodies[body].name == name))
        };
        self.limbs.iter().enumerate().filter(move |(_, limb)| is(limb)).map(|(i, _)| i)
    }

    /// All names that [`Limbs::named`] knows: bodies with actuators, then the other actuators.
    pub fn names(&self) -> Vec<String> {
        let moved = (0..self.bodies.len()).filter(|body| self.limbs.iter().any(|limb| limb.body == Some(*body)));
        let mut names: Vec<String> = moved.map(|body| self.bodies[body].name.clone()).collect();
        names.extend(self.limbs.iter().map(|limb| limb.name.clone()));
        let mut known = Vec::with_capacity(names.len());
        names.retain(|name| {
            let new = !name.is_empty() && !known.contains(name);
            known.push(name.clone());
            new
        });
        names
    }

    /// Mass of a body, kg.
    pub fn body_mass(&self, body: usize) -> f64 {
        self.bodies.get(body).map_or(0.0, |body| body.mass)
    }

    /// Whether an actuator moves a leg.
    pub fn is_leg(&self, actuator: usize) -> bool {
        self.limbs[actuator].body.is_some_and(|body| self.bodies[body].leg)
    }

    /// Number of joints between a body and the body that an actuator moves. `None` if nothing connects them.
    pub fn distance(&self, actuator: usize, body: usize) -> Option<usize> {
        let up = |mut body: usize| {
            let mut way = vec![body];
            while body != 0 {
                body = self.bodies[body].parent;
                way.push(body);
            }
            way
        };
        let (from, to) = (up(self.limbs[actuator].body?), up(body));
        from.iter().enumerate().find_map(|(a, body)| {
            // the world connects nothing
            let b = to.iter().position(|other| other == body && *body != 0)?;
            Some(a + b)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limbs_have_the_names_and_the_places_of_their_bodies() -> Result<(), Box<dyn std::error::Error>> {
        let limb = |name: &str, inner: &str| {
            format!(
                "<body name='{name}'><joint name='{name}_joint'/><geom name='{name}_geom' size='.1'/>{inner}</body>"
            )
        };
        let legs = limb("left", &limb("left_foot", "")) + &limb("right", &limb("right_foot", ""));
        let text = format!(
            "<mujoco><worldbody><body name='root'><freejoint/><geom size='.1'/>{}{legs}</body></worldbody><actuator>\
            <motor name='bend' joint='arm_joint'/><motor joint='left_joint'/><motor joint='left_foot_joint'/>\
            </actuator></mujoco>",
            limb("arm", "")
        );
        let model = Model::from_xml_str(&text, "figure")?;
        let limbs = Limbs::of(&model, &["left_foot_geom".into(), "right_foot_geom".into()]);
        assert_eq!(limbs.names(), ["arm", "left", "left_foot", "bend"]);
        assert_eq!(limbs.named("bend").chain(limbs.named("left")).collect::<Vec<_>>(), [0, 1]);
        assert_eq!((limbs.named("").count(), limbs.named("root").count()), (0, 0));
        assert_eq!([0, 1, 2].map(|actuator| limbs.is_leg(actuator)), [false, true, true]);
        let body = |name: &str| model.bodies.iter().position(|body| body.name == name).unwrap_or(0);
        let far = ["arm", "root", "left_foot", "right_foot"].map(|name| limbs.distance(2, body(name)));
        assert_eq!(far, [Some(3), Some(2), Some(0), Some(4)]);
        Ok(())
    }
}

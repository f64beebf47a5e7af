//! The geom that stands for an agent's obstacles.

use super::super::custom::OBSTACLES;
use super::body_parts::Geom;
use super::part::Draft;
use super::{MjcfError, ModelSpec, Place};

/// Name of the geom.
const GEOM: &str = "obstacles";

impl ModelSpec {
    /// Lets agents of this model touch [obstacles](crate::Obstacle). They get no obstacles by this, and move as before.
    ///
    /// The world gets a small invisible geom `obstacles`. Contacts with obstacles have its friction and its other contact
    /// parameters, by default those that the floor has, and are reported as contacts with it. It touches nothing itself. In the
    /// file, `<custom><text name="marathon_obstacles" data="obstacles"/></custom>` names it, which MuJoCo ignores.
    ///
    /// Does nothing if the model has such a geom.
    ///
    /// # Errors
    /// If the model has another geom of the name `obstacles`.
    pub fn add_obstacles(&mut self) -> Result<&mut Self, MjcfError> {
        let there = self.root.children.iter().filter(|section| section.name == "custom");
        if there.flat_map(|section| &section.children).any(|e| e.name == "text" && e.text("name") == Some(OBSTACLES)) {
            return Ok(self);
        }
        let any = i32::MAX;
        let geom = Geom::sphere(1e-3).name(GEOM).set("contype", any).set("conaffinity", any).set("group", 5_i32);
        self.add_to("world", geom.rgba([0.0; 4]))?;
        let at = Place { line: 0, ..self.root.place.clone() };
        let text = Draft::new("text").with("name", OBSTACLES).with("data", GEOM).placed(&at);
        let section = self.section("custom");
        self.root.children[section].children.push(text);
        Ok(self)
    }
}

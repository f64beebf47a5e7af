//! The kinds of elements that have names, and where they stand in the document.

use super::super::asset;
use super::super::document::Element;

/// A kind of named element. Names are unique within a kind.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Kind {
    /// A body. The world is the body `world`.
    Body,
    /// A joint, free joints included.
    Joint,
    /// A geom.
    Geom,
    /// A site.
    Site,
    /// A camera.
    Camera,
    /// A light.
    Light,
    /// A height field: an asset that geoms refer to.
    HField,
    /// A mesh: an asset that geoms refer to.
    Mesh,
    /// A tendon.
    Tendon,
    /// An equality constraint.
    Equality,
    /// A pair of geoms with contact parameters of its own.
    ContactPair,
    /// A pair of bodies that do not collide.
    ContactExclude,
    /// An actuator of any type.
    Actuator,
    /// A sensor of any type.
    Sensor,
    /// A keyframe.
    Keyframe,
}

/// Name of the body that holds all others.
pub(super) const WORLD: &str = "world";

impl Kind {
    /// The section of the file.
    pub(super) fn section(self) -> &'static str {
        match self {
            Kind::Body | Kind::Joint | Kind::Geom | Kind::Site | Kind::Camera | Kind::Light => "worldbody",
            Kind::HField | Kind::Mesh => "asset",
            Kind::Tendon => "tendon",
            Kind::Equality => "equality",
            Kind::ContactPair | Kind::ContactExclude => "contact",
            Kind::Actuator => "actuator",
            Kind::Sensor => "sensor",
            Kind::Keyframe => "keyframe",
        }
    }

    /// The word for it in messages.
    pub(super) fn noun(self) -> &'static str {
        match self {
            Kind::Body => "body",
            Kind::Joint => "joint",
            Kind::Geom => "geom",
            Kind::Site => "site",
            Kind::Camera => "camera",
            Kind::Light => "light",
            Kind::HField => "height field",
            Kind::Mesh => "mesh",
            Kind::Tendon => "tendon",
            Kind::Equality => "constraint",
            Kind::ContactPair => "contact pair",
            Kind::ContactExclude => "contact exclude",
            Kind::Actuator => "actuator",
            Kind::Sensor => "sensor",
            Kind::Keyframe => "keyframe",
        }
    }

    /// Whether an element of this tag in the kind's section is of this kind.
    fn has(self, tag: &str) -> bool {
        match self {
            Kind::Body => tag == "body",
            Kind::Joint => matches!(tag, "joint" | "freejoint"),
            Kind::Geom => tag == "geom",
            Kind::Site => tag == "site",
            Kind::Camera => tag == "camera",
            Kind::Light => tag == "light",
            Kind::HField => tag == "hfield",
            Kind::Mesh => tag == "mesh",
            Kind::ContactPair => tag == "pair",
            Kind::ContactExclude => tag == "exclude",
            Kind::Keyframe => tag == "key",
            Kind::Tendon | Kind::Equality | Kind::Actuator | Kind::Sensor => true,
        }
    }

    /// The element's name, if it has one.
    pub(super) fn name(self, element: &Element) -> Option<&str> {
        match self {
            Kind::HField | Kind::Mesh => asset::given_name(element),
            _ => element.text("name").filter(|name| !name.is_empty()),
        }
    }

    /// The kind of an element in a section.
    pub(super) fn of(section: &str, tag: &str) -> Option<Kind> {
        const ALL: [Kind; 15] = [
            Kind::Body,
            Kind::Joint,
            Kind::Geom,
            Kind::Site,
            Kind::Camera,
            Kind::Light,
            Kind::HField,
            Kind::Mesh,
            Kind::Tendon,
            Kind::Equality,
            Kind::ContactPair,
            Kind::ContactExclude,
            Kind::Actuator,
            Kind::Sensor,
            Kind::Keyframe,
        ];
        ALL.into_iter().find(|kind| kind.section() == section && kind.has(tag))
    }
}

//! The contents of a picture: a model's visible geoms, and frames of one or several agents posed from `qpos`.

use std::collections::BTreeSet;
use std::sync::Arc;

use glam::{DMat3, DVec3};
use marathon_physics::model::{Geom, GeomType, Model};

use crate::error::RenderError;
use crate::ground::Marks;
use crate::kinematics::{self, Pose};
use crate::mesh::Triangles;
use crate::palette::{self, Side};
use crate::shape::{Plane, Shape, Solid};
use crate::terrain::Terrain;

/// MuJoCo's default color, which means that the model sets none.
const UNCHOSEN: [f32; 4] = [0.5, 0.5, 0.5, 1.0];
/// Opacity of a ghost that overlaps its agent.
const GHOST_ALPHA: f64 = 0.35;
/// First of the geom groups that MuJoCo's viewer hides by default.
const FIRST_HIDDEN_GROUP: i32 = 3;

/// A model prepared for drawing. Create it once, then one [`Frame`] per `qpos`.
#[derive(Clone, Debug)]
pub struct Scene {
    model: Model,
    shown: Vec<Shown>,
    planes: Vec<ShownPlane>,
    /// Geoms that are height fields.
    fields: Vec<usize>,
    /// Whether the character's geoms all have the same color.
    one_color: bool,
    spacing: f64,
    radius: f64,
    height: f64,
    marks: Marks,
    /// The agents' own ground, by agent and height field.
    grounds: Vec<Vec<Vec<f32>>>,
}

/// A visible geom, with the data that does not change between frames.
#[derive(Clone, Debug)]
struct Shown {
    geom: usize,
    /// Of a mesh, its box.
    shape: Shape,
    mesh: Option<Arc<Triangles>>,
    /// Own color in linear light, or `None` for the palette's.
    color: Option<DVec3>,
    alpha: f64,
    side: Side,
    moving: bool,
    /// Whether it is part of the first joint's kinematic tree: the character, not a prop.
    runner: bool,
}

#[derive(Clone, Debug)]
struct ShownPlane {
    geom: usize,
    half: [f64; 2],
}

/// The geometry of one picture in world coordinates.
#[derive(Clone, Debug)]
pub struct Frame {
    pub(crate) solids: Vec<Solid>,
    pub(crate) planes: Vec<Plane>,
    pub(crate) marks: Marks,
    agents: Vec<AgentView>,
}

/// Placement of the ghosts of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GhostPlace {
    /// At their `qpos`, overlapping the agents. They are translucent.
    Inside,
    /// Each in the lane behind its agent.
    Beside,
}

/// Position of an agent in a frame, lateral offset included.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AgentView {
    /// Position of its root body, m.
    pub root: [f64; 3],
    /// Its center of mass, m.
    pub com: [f64; 3],
}

impl Scene {
    /// Collects the visible geoms of `model`.
    ///
    /// It leaves out geoms with alpha 0, and MuJoCo's hidden groups 3 and up. A moving body that has only hidden geoms shows
    /// them, and all do where every geom of the moving bodies is hidden. Where a moving body has meshes that nothing touches, its
    /// colliding geoms without a color are left out. Meshes whose files were not found cannot be shown.
    pub fn new(model: &Model) -> Self {
        let moving = |geom: &Geom| model.bodies.get(geom.body).is_some_and(|body| body.weld_id != 0);
        let opaque = |geom: &Geom| geom.rgba[3] > 0.0;
        let listed = |geom: &Geom| geom.group < FIRST_HIDDEN_GROUP;
        let all_hidden = !model.geoms.iter().any(|geom| moving(geom) && opaque(geom) && listed(geom));
        let meshes: Vec<Option<Arc<Triangles>>> =
            model.meshes.iter().map(|mesh| Triangles::new(mesh).map(Arc::new)).collect();
        let mesh_of = |geom: &Geom| geom.mesh.and_then(|mesh| meshes[mesh].clone());
        let known = |geom: &Geom| geom.kind != GeomType::Mesh || mesh_of(geom).is_some();
        let drawn = |geom: &&Geom| opaque(geom) && listed(geom) && known(geom);
        let shows: BTreeSet<usize> = model.geoms.iter().filter(drawn).map(|geom| geom.body).collect();
        // bodies that have meshes for the eye only, whose other shapes are there to touch
        let collides = |geom: &Geom| geom.contype != 0 || geom.conaffinity != 0;
        let dress = |geom: &&Geom| geom.kind == GeomType::Mesh && !collides(geom) && drawn(geom);
        let dressed: BTreeSet<usize> = model.geoms.iter().filter(dress).map(|geom| geom.body).collect();
        let plain = |geom: &Geom| collides(geom) && geom.rgba == UNCHOSEN;
        let visible = |geom: &Geom| {
            opaque(geom)
                && (listed(geom) || moving(geom) && (all_hidden || !shows.contains(&geom.body)))
                && !(moving(geom) && dressed.contains(&geom.body) && plain(geom))
        };

        let tree = model.joints.first().and_then(|joint| model.bodies.get(joint.body)).map(|body| body.root_id);
        let rest = kinematics::pose(model, &model.qpos0, 0).ok();
        let mut shown = Vec::new();
        let mut planes = Vec::new();
        let mut fields = Vec::new();
        // what is seen and what is touched is often the same mesh twice
        let chosen = |(index, geom): &(usize, &Geom)| visible(geom) && !twin(model, *index, &visible);
        for (index, geom) in model.geoms.iter().enumerate().filter(chosen) {
            if geom.kind == GeomType::Plane {
                planes.push(ShownPlane { geom: index, half: [geom.size[0], geom.size[1]] });
            } else if geom.kind == GeomType::Hfield {
                fields.push(index);
            }
            let mesh = mesh_of(geom);
            if let Some(shape) = shape_of(geom, mesh.as_deref()) {
                let color = (geom.rgba != UNCHOSEN).then(|| {
                    let [r, g, b, _] = geom.rgba.map(f64::from);
                    DVec3::new(palette::to_linear(r), palette::to_linear(g), palette::to_linear(b))
                });
                let alpha = f64::from(geom.rgba[3]).min(1.0);
                let runner = moving(geom) && model.bodies.get(geom.body).map(|body| body.root_id) == tree;
                let side = side_of(model, geom, rest.as_ref().map(|pose| pose.geoms[index].pos[1]));
                shown.push(Shown { geom: index, shape, mesh, color, alpha, side, moving: moving(geom), runner });
            }
        }

        // the sides have different shades only if the model's own colors do not distinguish them
        let sides: Vec<_> = shown.iter().map(|shown| (shown.side, shown.color)).collect();
        for shown in &mut shown {
            let twin = |side| sides.contains(&(side, shown.color));
            if !(twin(Side::Left) && twin(Side::Right)) {
                shown.side = Side::Middle;
            }
        }
        let mut colors = shown.iter().filter(|shown| shown.runner).map(|shown| shown.color);
        let first = colors.next();
        let one_color = colors.all(|color| Some(color) == first);

        let (radius, height, half_width) = match &rest {
            Some(pose) => measure(&shown, pose),
            None => (1.0, 1.0, 0.5),
        };
        let spacing = 2.0 * half_width + 0.6 * radius;
        let marks = Marks::new(radius, half_width);
        Self {
            model: model.clone(),
            shown,
            planes,
            fields,
            one_color,
            spacing,
            radius,
            height,
            marks,
            grounds: Vec::new(),
        }
    }

    /// Sets the distance of agents in a row along y, m. 0 overlays them in one place.
    pub fn with_spacing(mut self, spacing: f64) -> Self {
        self.spacing = spacing;
        self
    }

    /// Sets the agents' own ground from the next frame on: per agent, the elevations of each of the model's height
    /// fields, by rows, m above the field's center. Agents without elevations have the model's ground.
    ///
    /// # Panics
    /// If the number of elevations differs from that of a field's points.
    pub fn set_grounds(&mut self, grounds: Vec<Vec<Vec<f32>>>) {
        for (own, field) in grounds.iter().flat_map(|own| own.iter().zip(&self.model.hfields)) {
            assert_eq!(own.len(), field.nrow * field.ncol, "one elevation per point of the grid");
        }
        self.grounds = grounds;
    }

    /// Shows or hides numbers and lines on the ground.
    pub fn with_marks(mut self, visible: bool) -> Self {
        self.marks.visible = visible;
        self
    }

    /// The model of the scene.
    pub fn model(&self) -> &Model {
        &self.model
    }

    /// Distance between neighbors of a row, m.
    pub fn spacing(&self) -> f64 {
        self.spacing
    }

    /// Radius of the ball about the center of mass that holds the agent in its reference pose, m.
    pub fn radius(&self) -> f64 {
        self.radius
    }

    /// Height of the agent in its reference pose from its lowest to its highest point, m.
    pub fn height(&self) -> f64 {
        self.height
    }

    /// World poses of all geoms of `model` at `qpos`.
    ///
    /// # Errors
    /// [`RenderError::QposLength`] and [`RenderError::NotFinite`].
    pub fn pose_from_qpos(model: &Model, qpos: &[f64]) -> Result<Pose, RenderError> {
        kinematics::pose(model, qpos, 0)
    }

    /// Places one agent per `qpos` side by side: the first on y = 0, each further one farther from the default camera.
    ///
    /// Planes are drawn once. Other static geoms are repeated in each agent's lane.
    ///
    /// # Errors
    /// [`RenderError::QposLength`] and [`RenderError::NotFinite`], with the agent's index.
    pub fn frame<Q: AsRef<[f64]>>(&self, qpos: &[Q]) -> Result<Frame, RenderError> {
        self.frame_with_ghosts(qpos, &[], GhostPlace::Inside)
    }

    /// Like [`Scene::frame`], with a ghost of each agent: the same character, pale and without a shadow, at another
    /// `qpos`. Ghosts beside their agents take every second lane. Cameras only follow the agents.
    ///
    /// # Errors
    /// [`RenderError::QposLength`] and [`RenderError::NotFinite`], with the agent's index.
    pub fn frame_with_ghosts<Q: AsRef<[f64]>>(
        &self,
        qpos: &[Q],
        ghosts: &[Q],
        place: GhostPlace,
    ) -> Result<Frame, RenderError> {
        let lanes = if place == GhostPlace::Beside { 2 } else { 1 };
        let mut frame = Frame { solids: Vec::new(), planes: Vec::new(), marks: self.marks, agents: Vec::new() };
        for (agent, qpos) in qpos.iter().enumerate() {
            let pose = kinematics::pose(&self.model, qpos.as_ref(), agent)?;
            self.add_agent(&mut frame, agent, self.lane(lanes * agent), &pose);
            self.add_fields(&mut frame, agent, self.lane(lanes * agent), &pose);
        }
        for (agent, qpos) in ghosts.iter().enumerate() {
            let pose = kinematics::pose(&self.model, qpos.as_ref(), agent)?;
            self.add_ghost(&mut frame, self.lane(lanes * agent + lanes - 1), &pose, place);
        }
        Ok(frame)
    }

    fn add_fields(&self, frame: &mut Frame, agent: usize, offset: DVec3, pose: &Pose) {
        let own = self.grounds.get(agent);
        for geom in &self.fields {
            let Some(number) = self.model.geoms[*geom].hfield else { continue };
            let (pos, rot) = placed(pose, *geom);
            let elevations = own.and_then(|own| own.get(number)).map(Vec::as_slice);
            let colors = palette::CHECKER.map(palette::linear);
            let field = &self.model.hfields[number];
            // adjacent strips do not overlap
            let half_width =
                if self.grounds.len() > 1 && self.spacing > 0.0 { 0.5 * self.spacing } else { f64::INFINITY };
            Terrain { field, elevations, pos: pos + offset, rot, half_width, colors }
                .add_to(&mut frame.solids, pose.com[0]);
        }
    }

    /// Offset of a lane of the row.
    fn lane(&self, lane: usize) -> DVec3 {
        DVec3::new(0.0, self.spacing * lane as f64, 0.0)
    }

    fn add_ghost(&self, frame: &mut Frame, offset: DVec3, pose: &Pose, place: GhostPlace) {
        let share = if place == GhostPlace::Inside { GHOST_ALPHA } else { 1.0 };
        for shown in self.shown.iter().filter(|shown| shown.runner) {
            let color = palette::sided(palette::linear(palette::GHOST), shown.side);
            let solid = shown.solid(pose, offset, color, share * shown.alpha);
            frame.solids.push(Solid { ghost: true, ..solid });
        }
    }

    fn add_agent(&self, frame: &mut Frame, agent: usize, offset: DVec3, pose: &Pose) {
        // overlaid agents share one world
        let repeat_world = agent == 0 || self.spacing != 0.0;
        for shown in self.shown.iter().filter(|shown| shown.moving || repeat_world) {
            let color = match (shown.color, shown.moving) {
                // a model with a single color gets the palette's colors to distinguish agents in a row
                (Some(_), true) if self.one_color && agent > 0 => palette::agent(agent, shown.side),
                (Some(own), true) => palette::sided(own, shown.side),
                (Some(own), false) => own,
                (None, true) => palette::agent(agent, shown.side),
                (None, false) => palette::linear(palette::WORLD),
            };
            frame.solids.push(shown.solid(pose, offset, color, shown.alpha));
        }
        if agent == 0 {
            for plane in &self.planes {
                let (pos, rot) = placed(pose, plane.geom);
                // a floor is infinite in the simulation, whatever its size for viewers
                let level = rot.z_axis.z > 0.999;
                let half = if level { [0.0; 2] } else { plane.half };
                frame.planes.push(Plane { pos, rot, half });
            }
        }
        let at = |p: [f64; 3]| (DVec3::from_array(p) + offset).to_array();
        frame.agents.push(AgentView { root: at(pose.root), com: at(pose.com) });
    }
}

impl Shown {
    /// The geom in the world, moved by `offset`.
    fn solid(&self, pose: &Pose, offset: DVec3, color: DVec3, alpha: f64) -> Solid {
        let (pos, rot) = placed(pose, self.geom);
        let middle = self.mesh.as_ref().map_or(DVec3::ZERO, |mesh| mesh.center);
        let solid = Solid::new(self.shape, pos + rot * middle + offset, rot, color, alpha);
        Solid { mesh: self.mesh.clone(), ..solid }
    }
}

impl Frame {
    /// The agents in the order of their `qpos`.
    pub fn agents(&self) -> &[AgentView] {
        &self.agents
    }

    /// Adds a shape that is not part of a model: a target, an arrow, an obstacle.
    ///
    /// `mat` is its rotation, rows of three; `rgba` is sRGB, each in `0..=1`.
    pub fn add(&mut self, shape: Shape, pos: [f64; 3], mat: [[f64; 3]; 3], rgba: [f32; 4]) {
        let [r, g, b, alpha] = rgba.map(f64::from);
        if alpha > 0.0 {
            let color = DVec3::new(palette::to_linear(r), palette::to_linear(g), palette::to_linear(b));
            let rot = DMat3::from_cols_array_2d(&mat).transpose();
            self.solids.push(Solid::new(shape, DVec3::from_array(pos), rot, color, alpha.min(1.0)));
        }
    }
}

fn placed(pose: &Pose, geom: usize) -> (DVec3, DMat3) {
    let pose = &pose.geoms[geom];
    (DVec3::from_array(pose.pos), DMat3::from_cols_array_2d(&pose.mat).transpose())
}

/// Whether an earlier visible geom is the same mesh in the same place.
fn twin(model: &Model, index: usize, visible: &impl Fn(&Geom) -> bool) -> bool {
    let geom = &model.geoms[index];
    let own = model.bodies[geom.body].geom_start..index;
    let same = |other: &Geom| other.mesh == geom.mesh && other.pos == geom.pos && other.quat == geom.quat;
    geom.mesh.is_some() && model.geoms[own].iter().any(|other| same(other) && visible(other))
}

fn shape_of(geom: &Geom, mesh: Option<&Triangles>) -> Option<Shape> {
    let [x, y, _] = geom.size;
    match geom.kind {
        GeomType::Sphere => Some(Shape::Sphere { radius: x }),
        GeomType::Capsule => Some(Shape::Capsule { radius: x, half: y }),
        GeomType::Ellipsoid => Some(Shape::Ellipsoid { semi: geom.size }),
        GeomType::Cylinder => Some(Shape::Cylinder { radius: x, half: y }),
        GeomType::Box => Some(Shape::Box { half: geom.size }),
        GeomType::Mesh => mesh.map(|mesh| Shape::Box { half: mesh.half.to_array() }),
        GeomType::Plane | GeomType::Hfield => None,
    }
}

/// Left or right by the geom's name, its bodies' names, or else its position in the reference pose.
fn side_of(model: &Model, geom: &Geom, rest_y: Option<f64>) -> Side {
    let named = |name: &str| {
        let name = name.to_ascii_lowercase();
        match (name.contains("left"), name.contains("right")) {
            (true, false) => Some(Side::Left),
            (false, true) => Some(Side::Right),
            _ => None,
        }
    };
    let mut found = named(&geom.name);
    let mut body = geom.body;
    while body != 0 && found.is_none() {
        found = named(&model.bodies[body].name);
        body = model.bodies[body].parent;
    }
    found.unwrap_or(match rest_y {
        Some(y) if y > 0.02 => Side::Left,
        Some(y) if y < -0.02 => Side::Right,
        _ => Side::Middle,
    })
}

/// Radius about the center of mass, height and half width of the character in its reference pose.
fn measure(shown: &[Shown], pose: &Pose) -> (f64, f64, f64) {
    let com = DVec3::from_array(pose.com);
    let (mut radius, mut half_width) = (0.0_f64, 0.0_f64);
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    for shown in shown.iter().filter(|shown| shown.runner) {
        let (a, b, r) = shown.solid(pose, DVec3::ZERO, DVec3::ZERO, 1.0).soft_rod();
        for end in [a, b] {
            radius = radius.max((end - com).length() + r);
            half_width = half_width.max((end.y - com.y).abs() + r);
            low = low.min(end.z - r);
            high = high.max(end.z + r);
        }
    }
    if radius > 0.0 { (radius, high - low, half_width) } else { (1.0, 1.0, 0.5) }
}

//! `<worldbody>`: the tree of bodies, read depth first.

use super::asset::Assets;
use super::compiler::Settings;
use super::defaults::Defaults;
use super::document::Element;
use super::error::MjcfError;
use super::geom::{GeomSpec, ShapeSpec};
use super::joint::JointSpec;
use super::math::*;
use super::orientation::orientation;
use super::settings::sections;
use super::value::Attrs;
use crate::model::{JointType, TrackMode, Vec3};

/// A body as the file describes it; its inertial properties are filled in later.
pub(crate) struct BodySpec<'a> {
    pub element: &'a Element,
    pub parent: usize,
    pub frame: Frame,
    pub mocap: bool,
    pub gravcomp: f64,
    /// `simple="auto"`: inverse weights may be those of a lone sliding body, see [`super::mass_matrix`].
    pub simple: bool,
    /// `<inertial>`, in the body's frame.
    pub inertial: Option<Inertial<'a>>,
    pub joints: Vec<JointSpec<'a>>,
    pub geoms: Vec<GeomSpec<'a>>,
    pub sites: Vec<SiteSpec<'a>>,
    pub cameras: Vec<CameraSpec<'a>>,
    pub lights: Vec<LightSpec<'a>>,
    /// Mass, frame of the principal axes and principal moments.
    pub mass: f64,
    pub iframe: Frame,
    pub inertia: Vec3,
}

/// `<inertial>`: center of mass, mass and moments in a frame of their own.
pub(crate) struct Inertial<'a> {
    pub element: &'a Element,
    pub frame: Frame,
    pub mass: f64,
    pub moments: Vec3,
}

/// `<site>`.
pub(crate) struct SiteSpec<'a> {
    pub element: &'a Element,
    pub shape: ShapeSpec,
    pub material: Option<&'a str>,
}

/// `<camera>`.
pub(crate) struct CameraSpec<'a> {
    pub element: &'a Element,
    pub frame: Frame,
    pub mode: TrackMode,
    pub fovy: f64,
}

/// `<light>`.
pub(crate) struct LightSpec<'a> {
    pub element: &'a Element,
    pub pos: Vec3,
    pub dir: Vec3,
    pub mode: TrackMode,
    pub directional: bool,
    pub diffuse: [f32; 3],
}

const MODES: [(&str, TrackMode); 5] = [
    ("fixed", TrackMode::Fixed),
    ("track", TrackMode::Track),
    ("trackcom", TrackMode::TrackCom),
    ("targetbody", TrackMode::TargetBody),
    ("targetbodycom", TrackMode::TargetBodyCom),
];

/// Reads all bodies; index 0 is the world.
pub(crate) fn read<'a>(
    root: &'a Element,
    defaults: &'a Defaults<'a>,
    settings: &Settings,
    assets: &Assets<'a>,
) -> Result<Vec<BodySpec<'a>>, MjcfError> {
    let mut reader =
        Reader { defaults, settings, assets, bodies: vec![BodySpec::new(root, 0, Frame::IDENTITY, Frame::IDENTITY)] };
    for section in sections(root, "worldbody") {
        if let Some(attr) = section.attrs.first() {
            return Err(section.invalid(format!("the world has no attributes, but there is '{}'", attr.name)));
        }
        reader.children(section, 0, None, &Frame::IDENTITY)?;
    }
    Ok(reader.bodies)
}

impl<'a> BodySpec<'a> {
    /// `own` is the frame from the body's attributes. `frame` is the same frame relative to the parent.
    fn new(element: &'a Element, parent: usize, own: Frame, frame: Frame) -> Self {
        BodySpec {
            element,
            parent,
            frame,
            mocap: false,
            gravcomp: 0.0,
            simple: true,
            inertial: None,
            joints: Vec::new(),
            geoms: Vec::new(),
            sites: Vec::new(),
            cameras: Vec::new(),
            lights: Vec::new(),
            mass: 0.0,
            // MuJoCo gives a body without mass its own frame here, without the enclosing `<frame>` elements
            iframe: own,
            inertia: [0.0; 3],
        }
    }
}

struct Reader<'a, 's> {
    defaults: &'a Defaults<'a>,
    settings: &'s Settings,
    assets: &'s Assets<'a>,
    bodies: Vec<BodySpec<'a>>,
}

impl<'a> Reader<'a, '_> {
    /// Reads the children of a body, the world or a frame. `frame` is that of enclosing frames within the body.
    fn children(
        &mut self,
        parent: &'a Element,
        body: usize,
        childclass: Option<&'a str>,
        frame: &Frame,
    ) -> Result<(), MjcfError> {
        for element in &parent.children {
            let attrs = || self.defaults.attrs(element, childclass);
            match element.name.as_str() {
                "body" => self.body(element, body, childclass, frame)?,
                "frame" => {
                    let plain = Attrs::plain(element);
                    let class = self.defaults.named(element, "childclass")?.or(childclass);
                    let inner = frame.compose(&self.frame(&plain)?);
                    self.children(element, body, class, &inner)?;
                }
                "inertial" => self.inertial(element, body, frame)?,
                "joint" => {
                    let attrs = attrs()?;
                    let joint = JointSpec::read(&attrs, frame, self.settings)?;
                    joint.check(&attrs, self.settings)?;
                    self.joint(joint, body)?;
                }
                "freejoint" => self.joint(JointSpec::free(element)?, body)?,
                "geom" => {
                    let geom = GeomSpec::read(&attrs()?, frame, self.settings, self.assets)?;
                    self.bodies[body].geoms.push(geom);
                }
                "site" => {
                    let site = SiteSpec::read(&attrs()?, frame, self.settings)?;
                    self.bodies[body].sites.push(site);
                }
                "camera" => {
                    let camera = CameraSpec::read(&attrs()?, frame, self.settings)?;
                    self.bodies[body].cameras.push(camera);
                }
                "light" => {
                    let light = LightSpec::read(&attrs()?, frame)?;
                    self.bodies[body].lights.push(light);
                }
                // the schema has refused everything else
                _ => {}
            }
        }
        Ok(())
    }

    /// `pos` and orientation of an element.
    fn frame(&self, attrs: &Attrs) -> Result<Frame, MjcfError> {
        let pos = attrs.array_or("pos", [0.0; 3])?;
        Ok(Frame { pos, quat: orientation(attrs, self.settings)?.unwrap_or(IDENTITY) })
    }

    fn body(
        &mut self,
        element: &'a Element,
        parent: usize,
        childclass: Option<&'a str>,
        frame: &Frame,
    ) -> Result<(), MjcfError> {
        let attrs = Attrs::plain(element);
        let class = self.defaults.named(element, "childclass")?.or(childclass);
        let own = self.frame(&attrs)?;
        let mut body = BodySpec::new(element, parent, own, frame.compose(&own));
        body.gravcomp = attrs.number_or("gravcomp", 0.0)?;
        body.mocap = attrs.flag_or("mocap", false)?;
        body.simple = attrs.keyword("simple", &[("false", false), ("auto", true)])?.unwrap_or(true);
        let index = self.bodies.len();
        self.bodies.push(body);
        self.children(element, index, class, &Frame::IDENTITY)?;

        let body = &self.bodies[index];
        if body.mocap && (parent != 0 || !body.joints.is_empty()) {
            return Err(element.invalid("a mocap body must be a child of the world and have no joints"));
        }
        let dofs: usize = body.joints.iter().map(|j| j.sizes().1).sum();
        if dofs > 6 {
            return Err(element.invalid(format!("the joints of a body have at most 6 degrees of freedom, not {dofs}")));
        }
        self.sleep(&attrs, index)
    }

    /// Checks the policy of sleep. Every policy simulates the body, but for the one that starts asleep.
    fn sleep(&self, attrs: &Attrs, body: usize) -> Result<(), MjcfError> {
        let element = attrs.element;
        let policies = ["auto", "never", "allowed", "init"].map(|policy| (policy, policy));
        let policy = attrs.keyword("sleep", &policies)?.unwrap_or("auto");
        let moves = |body: usize| !self.bodies[body].joints.is_empty();
        let mut above =
            std::iter::successors(Some(self.bodies[body].parent), |b| (*b > 0).then(|| self.bodies[*b].parent));
        if policy != "auto" && (!moves(body) || above.any(moves)) {
            let message = "'sleep' belongs to a body with joints that is in no other body with joints";
            return Err(element.invalid(message));
        }
        if policy == "init" && self.settings.sleep {
            let reason = "'init' is not supported: the body would start asleep; use 'auto', 'allowed' or 'never'";
            return Err(element.unsupported(Some("sleep"), reason));
        }
        Ok(())
    }

    fn inertial(&mut self, element: &'a Element, body: usize, frame: &Frame) -> Result<(), MjcfError> {
        if body == 0 {
            return Err(element.invalid("the world has no inertia"));
        }
        if self.bodies[body].inertial.is_some() {
            return Err(element.invalid("the body already has an <inertial>"));
        }
        let attrs = Attrs::plain(element);
        for name in ["pos", "mass"] {
            if !attrs.has(name) {
                return Err(element.invalid(format!("the attribute '{name}' is missing")));
            }
        }
        let mass = attrs.number_or("mass", 0.0)?;
        let mut local = self.frame(&attrs)?;
        let full: Option<[f64; 6]> = attrs.array("fullinertia")?;
        let moments = match (full, attrs.array::<3>("diaginertia")?) {
            (Some(_), Some(_)) => return Err(element.invalid("there are both 'fullinertia' and 'diaginertia'")),
            (None, diagonal) => diagonal.unwrap_or([0.0; 3]),
            (Some(full), None) => {
                if orientation(&attrs, self.settings)?.is_some() {
                    return Err(element.invalid("'fullinertia' leaves no room for an orientation"));
                }
                let (moments, quat) = principal_axes(full);
                if !(moments[2] >= EPS) {
                    return Err(element.invalid("'fullinertia' must have positive eigenvalues"));
                }
                local.quat = quat;
                moments
            }
        };
        self.bodies[body].inertial = Some(Inertial { element, frame: frame.compose(&local), mass, moments });
        Ok(())
    }

    fn joint(&mut self, joint: JointSpec<'a>, body: usize) -> Result<(), MjcfError> {
        let element = joint.element;
        if body == 0 {
            return Err(element.invalid("the world cannot have joints"));
        }
        let others = &self.bodies[body].joints;
        if joint.kind == JointType::Free {
            if self.bodies[body].parent != 0 {
                return Err(element.invalid("a free joint is allowed only in a child of the world"));
            }
            if !others.is_empty() {
                return Err(element.invalid("a free joint must be the only joint of its body"));
            }
        }
        if others.iter().any(|j| j.kind == JointType::Free) {
            return Err(element.invalid("the body has a free joint, which must be its only joint"));
        }
        let rotates = matches!(joint.kind, JointType::Ball | JointType::Hinge);
        if rotates && others.iter().any(|j| j.kind == JointType::Ball) {
            return Err(element.invalid("a body with a ball joint cannot have another joint that rotates after it"));
        }
        self.bodies[body].joints.push(joint);
        Ok(())
    }
}

impl SiteSpec<'_> {
    pub fn read<'a>(attrs: &Attrs<'a>, frame: &Frame, settings: &Settings) -> Result<SiteSpec<'a>, MjcfError> {
        let shape = ShapeSpec::read(attrs, frame, settings, [0.005; 3], None)?;
        Ok(SiteSpec { element: attrs.element, shape, material: attrs.text("material") })
    }
}

impl CameraSpec<'_> {
    pub fn read<'a>(attrs: &Attrs<'a>, frame: &Frame, settings: &Settings) -> Result<CameraSpec<'a>, MjcfError> {
        let pos = attrs.array_or("pos", [0.0; 3])?;
        let quat = orientation(attrs, settings)?.unwrap_or(IDENTITY);
        let fovy = Lens::read(attrs)?.fovy(attrs.element)?;
        Ok(CameraSpec { element: attrs.element, frame: frame.compose(&Frame { pos, quat }), mode: mode(attrs)?, fovy })
    }
}

/// Source of the field of view: an angle, or a sensor behind a lens.
pub(crate) struct Lens {
    fovy: f64,
    /// Width and height of the sensor, m; 0 without one.
    sensor: [f64; 2],
    /// Width and height of the sensor, pixels.
    resolution: [f64; 2],
    /// Focal lengths, m. The second one sets the vertical angle.
    focal: [f64; 2],
    /// Focal lengths, pixels. Nonzero values replace the lengths in meters.
    focal_pixel: [f64; 2],
    /// Whether the principal point is off center. The angle then is that of a centered one.
    off_center: bool,
}

impl Lens {
    pub fn read(attrs: &Attrs) -> Result<Self, MjcfError> {
        let own = |name: &str| attrs.element.attr(name).is_some();
        if own("fovy") && own("sensorsize") {
            return Err(attrs.element.invalid("there are both 'fovy' and 'sensorsize'"));
        }
        let points = [attrs.array_or("principal", [0.0; 2])?, attrs.array_or("principalpixel", [0.0; 2])?];
        Ok(Lens {
            off_center: points != [[0.0; 2]; 2],
            fovy: attrs.number_or("fovy", 45.0)?,
            sensor: attrs.array_or("sensorsize", [0.0; 2])?,
            resolution: attrs.array_or("resolution", [1.0; 2])?,
            focal: attrs.array_or("focal", [0.0; 2])?,
            focal_pixel: attrs.array_or("focalpixel", [0.0; 2])?,
        })
    }

    /// The vertical field of view for a centered principal point, degrees. For a sensor it is computed in single
    /// precision, as in MuJoCo.
    fn fovy(&self, element: &Element) -> Result<f64, MjcfError> {
        let fovy = self.fovy;
        if !(fovy > 0.0 && fovy < 180.0) {
            return Err(element.invalid(format!("fovy is {fovy}; expected degrees between 0 and 180")));
        }
        if !self.sensor.iter().all(|size| *size > 0.0) {
            if self.off_center || [self.focal, self.focal_pixel] != [[0.0; 2]; 2] {
                let message = "the focal length and the principal point need a 'sensorsize' of two positive numbers";
                return Err(element.invalid(message));
            }
            return Ok(fovy);
        }
        let [width, height] = self.resolution;
        if !(width >= 1.0 && height >= 1.0) {
            let message = format!("resolution is {width} x {height}; 'sensorsize' needs at least 1 x 1 pixels");
            return Err(element.invalid(message));
        }
        let (size, focal) = (self.sensor[1] as f32, self.focal[1] as f32);
        let per_pixel = height as f32 / size;
        let pixels = self.focal_pixel[1] as f32;
        let focal = if pixels == 0.0 { focal } else { pixels / per_pixel };
        Ok(f64::from(libm::atan2f(size / 2.0, focal)) * 360.0 / std::f64::consts::PI)
    }
}

impl LightSpec<'_> {
    pub fn read<'a>(attrs: &Attrs<'a>, frame: &Frame) -> Result<LightSpec<'a>, MjcfError> {
        let dir = rotate(frame.quat, attrs.array_or("dir", [0.0, 0.0, -1.0])?);
        let types = [("spot", false), ("directional", true), ("point", false), ("image", false)];
        let diffuse: Vec3 = attrs.array_or("diffuse", [0.7; 3])?;
        Ok(LightSpec {
            element: attrs.element,
            pos: frame.point(attrs.array_or("pos", [0.0; 3])?),
            dir: unit(dir).unwrap_or([0.0, 0.0, -1.0]),
            mode: mode(attrs)?,
            directional: attrs.flag_or("directional", false)? || attrs.keyword("type", &types)?.unwrap_or(false),
            diffuse: diffuse.map(|x| x as f32),
        })
    }
}

/// Tracking mode; the target modes stay where they are without a target.
fn mode(attrs: &Attrs) -> Result<TrackMode, MjcfError> {
    let mode = attrs.keyword("mode", &MODES)?.unwrap_or(TrackMode::Fixed);
    let aims = matches!(mode, TrackMode::TargetBody | TrackMode::TargetBodyCom);
    Ok(if aims && attrs.text("target").is_none() { TrackMode::Fixed } else { mode })
}

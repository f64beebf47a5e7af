//! From the parts of the file to the [`Model`].

use super::compiler::Settings;
use super::defaults::{ACTUATORS, Defaults};
use super::document::Element;
use super::error::MjcfError;
use super::file::ReadFile;
use super::geom::GeomSpec;
use super::joint::JointSpec;
use super::math::{Frame, IDENTITY, MIN_VAL};
use super::names::{Names, Registry};
use super::room::Room;
use super::settings::entries;
use super::tree::{BodySpec, CameraSpec, LightSpec, SiteSpec};
use super::value::Attrs;
use super::{
    actuator, asset, contact, custom, equality, fluid, geom, inertia, mass_matrix, mesh, pose, schema, sensor,
    settings, statistics, tendon, tree,
};
use crate::hint::{did_you_mean, nearest};
use crate::model::*;
use std::collections::BTreeMap;

/// Compiles the document. `file` reads the files that it names, and `room` counts the memory that it needs.
pub(crate) fn compile(root: &Element, file: &ReadFile, room: &Room) -> Result<Model, MjcfError> {
    schema::check(root)?;
    let opt = settings::options(root)?;
    let mut settings = Settings::read(root)?;
    settings.sleep = settings::sleep(root);
    let given = settings::statistics(root)?;
    let defaults = Defaults::read(root, room)?;
    check_defaults(&defaults, &settings)?;

    let assets = asset::read(root, &defaults, &settings, file, room)?;
    let mut bodies = tree::read(root, &defaults, &settings, &assets)?;
    inertia::compile(&mut bodies, &settings)?;
    let materials = materials(root, &defaults)?;
    let mut model = Model {
        name: root.text("model").filter(|n| !n.is_empty()).unwrap_or("MuJoCo Model").to_owned(),
        opt,
        nq: 0,
        nv: 0,
        nu: 0,
        na: 0,
        bodies: Vec::new(),
        joints: Vec::new(),
        dofs: Vec::new(),
        geoms: Vec::new(),
        sites: Vec::new(),
        cameras: Vec::new(),
        lights: Vec::new(),
        hfields: Vec::new(),
        meshes: Vec::new(),
        hulls: Vec::new(),
        tendons: Vec::new(),
        equalities: Vec::new(),
        actuators: Vec::new(),
        sensors: Vec::new(),
        keyframes: Vec::new(),
        pairs: Vec::new(),
        excludes: Vec::new(),
        numerics: custom::numerics(root, room)?,
        obstacles: None,
        qpos0: Vec::new(),
        qpos_spring: Vec::new(),
        stat: Statistics { mean_inertia: 1.0, mean_mass: 1.0, extent: 2.0, center: [0.0; 3] },
    };
    for (index, body) in bodies.iter().enumerate() {
        add_body(&mut model, index, body, &materials)?;
    }
    for index in (1..model.bodies.len()).rev() {
        let (parent, mass) = (model.bodies[index].parent, model.bodies[index].subtree_mass);
        model.bodies[parent].subtree_mass += mass;
    }

    let names = registry(root, &bodies)?;
    check_targets(&bodies, &names)?;
    model.hfields = assets.hfields;
    model.tendons = tendon::compile(root, &defaults, &names, &settings, &model, room)?;
    model.pairs = contact::pairs(root, &defaults, &names, &model.geoms)?;
    model.excludes = contact::excludes(root, &names)?;
    model.obstacles = custom::obstacles(root, &names, &model.geoms)?;
    mesh::add(&mut model, &assets.meshes, room)?;
    actuator::compile(root, &defaults, &names, &settings, &mut model, room)?;
    model.sensors = sensor::compile(root, &names, &model, room)?;
    model.keyframes = custom::keyframes(root, &model, room)?;

    let pose = pose::Pose::new(&model);
    model.equalities = equality::compile(root, &defaults, &names, &model, &pose)?;
    tendon::measure(&mut model, &pose);
    let moments = tendon::moments(&model, &pose);
    let simple: Vec<bool> = bodies.iter().map(|b| b.simple).collect();
    let mass_matrix = mass_matrix::inverse_weights(&mut model, &pose, &simple, &moments, room)
        .map_err(|e| bodies[e.body()].element.invalid(e.to_string()))?;
    statistics::compute(&mut model, &pose, &mass_matrix.diagonal, &given);
    mass_matrix::tendon_inverse_weights(&mut model, &mass_matrix, &moments);
    actuator::resolve(&mut model, &pose, &mass_matrix, &moments);
    spring_dampers(&mut model, &bodies);
    check_finite(&model, &bodies)?;
    Ok(model)
}

/// Numbers of the file are finite; what follows from extreme ones may not be.
fn check_finite(model: &Model, bodies: &[BodySpec]) -> Result<(), MjcfError> {
    let finite = |numbers: &[f64]| numbers.iter().all(|x| x.is_finite());
    for (body, spec) in model.bodies.iter().zip(bodies) {
        let geoms = &model.geoms[body.geom_start..body.geom_start + body.geom_count];
        let joints = &model.joints[body.joint_start..body.joint_start + body.joint_count];
        let dofs = &model.dofs[body.dof_start..body.dof_start + body.dof_count];
        let sound = finite(&[body.pos, body.ipos, body.inertia].concat())
            && finite(&[body.quat, body.iquat].concat())
            && finite(&body.invweight0)
            && finite(&[body.mass, body.subtree_mass])
            && geoms.iter().all(|g| finite(&g.pos) && finite(&g.quat) && finite(&g.size))
            && joints.iter().all(|j| finite(&j.pos) && finite(&[j.stiffness]) && finite(&j.range))
            && dofs.iter().all(|d| finite(&[d.invweight0, d.damping, d.armature]) && finite(&d.damping_poly));
        if !sound {
            return Err(spec.element.invalid("its numbers are too large to compute with"));
        }
    }
    let root = bodies[0].element;
    let stat = &model.stat;
    if !finite(&[stat.mean_inertia, stat.mean_mass, stat.extent]) || !finite(&stat.center) {
        return Err(root.invalid("the extent of the model is too large to compute with"));
    }
    let strong = |m: &Option<Muscle>| m.is_none_or(|m| finite(&[m.force]));
    let sound = |a: &Actuator| {
        finite(&a.bias)
            && finite(&a.ctrl_range)
            && finite(&a.act_range)
            && strong(&a.gain_muscle)
            && strong(&a.bias_muscle)
    };
    if !model.actuators.iter().all(sound) {
        return Err(root.invalid("the damping, force or range of an actuator is too large to compute with"));
    }
    let sound = |t: &Tendon| {
        finite(&t.spring_length) && finite(&[t.length0, t.invweight0, t.armature, t.damping]) && finite(&t.damping_poly)
    };
    if let Some(tendon) = model.tendons.iter().find(|t| !sound(t)) {
        return Err(root.invalid(format!("the numbers of tendon '{}' are too large to compute with", tendon.name)));
    }
    let sound = |e: &Equality| match &e.kind {
        EqualityKind::Connect { anchors, .. } => finite(&anchors.concat()),
        EqualityKind::Weld { anchors, quats, .. } => finite(&anchors.concat()) && finite(&quats.concat()),
        EqualityKind::Joint { .. } | EqualityKind::Tendon { .. } => true,
    };
    if let Some(equality) = model.equalities.iter().find(|e| !sound(e)) {
        return Err(
            root.invalid(format!("the numbers of constraint '{}' are too large to compute with", equality.name))
        );
    }
    Ok(())
}

/// Reads every setting of every class once, so that a mistake is found even if nothing uses the class.
fn check_defaults(defaults: &Defaults, settings: &Settings) -> Result<(), MjcfError> {
    let frame = Frame::IDENTITY;
    let check = |attrs: Attrs| match attrs.element.name.as_str() {
        "joint" => JointSpec::read(&attrs, &frame, settings).map(|_| ()),
        "geom" | "site" => geom::check_default(&attrs, settings),
        "camera" => tree::Lens::read(&attrs).map(|_| ()),
        "pair" => contact::check_default(&attrs),
        "equality" => equality::check_default(&attrs),
        "tendon" => tendon::check_default(&attrs),
        name if ACTUATORS.contains(&name) => actuator::check_default(&attrs),
        _ => Ok(()),
    };
    defaults.all().try_for_each(|attrs| schema::tolerate(check(attrs)))
}

fn name(element: &Element) -> String {
    element.text("name").unwrap_or_default().to_owned()
}

/// Colors of the materials by name.
fn materials<'a>(root: &'a Element, defaults: &Defaults) -> Result<BTreeMap<&'a str, Option<[f32; 4]>>, MjcfError> {
    let elements = || entries(root, "asset").filter(|e| e.name == "material");
    Names::collect("material", elements())?;
    elements()
        .map(|element| {
            let Some(name) = element.text("name").filter(|n| !n.is_empty()) else {
                return Err(element.invalid("the attribute 'name' is missing"));
            };
            Ok((name, defaults.attrs(element, None)?.rgba()?))
        })
        .collect()
}

fn add_body(
    model: &mut Model,
    index: usize,
    spec: &BodySpec,
    materials: &BTreeMap<&str, Option<[f32; 4]>>,
) -> Result<(), MjcfError> {
    let moves = !spec.joints.is_empty() || spec.mocap;
    let parent = spec.parent;
    let body = Body {
        name: if index == 0 { "world".to_owned() } else { name(spec.element) },
        parent,
        pos: spec.frame.pos,
        quat: spec.frame.quat,
        ipos: spec.iframe.pos,
        iquat: spec.iframe.quat,
        mass: spec.mass,
        inertia: spec.inertia,
        subtree_mass: spec.mass,
        joint_start: model.joints.len(),
        joint_count: spec.joints.len(),
        dof_start: model.dofs.len(),
        dof_count: spec.joints.iter().map(|j| j.sizes().1).sum(),
        geom_start: model.geoms.len(),
        geom_count: spec.geoms.len(),
        weld_id: if index == 0 {
            0
        } else if moves {
            index
        } else {
            model.bodies[parent].weld_id
        },
        root_id: if index == 0 {
            0
        } else if parent == 0 {
            index
        } else {
            model.bodies[parent].root_id
        },
        invweight0: [0.0; 2],
        gravcomp: spec.gravcomp,
        mocap: spec.mocap,
    };
    let weld = body.weld_id;
    model.bodies.push(body);
    for joint in &spec.joints {
        add_joint(model, index, joint);
    }
    for geom in &spec.geoms {
        if geom.shape.kind == GeomType::Plane && weld != 0 && !model.bodies[weld].mocap {
            return Err(geom
                .element
                .invalid("a plane must belong to the world, to a body fixed in it, or to a mocap body"));
        }
        model.geoms.push(convert_geom(geom, index, materials)?);
    }
    for site in &spec.sites {
        model.sites.push(convert_site(site, index, materials)?);
    }
    model.cameras.extend(spec.cameras.iter().map(|c| convert_camera(c, index)));
    model.lights.extend(spec.lights.iter().map(|l| convert_light(l, index)));
    Ok(())
}

fn add_joint(model: &mut Model, body: usize, spec: &JointSpec) {
    let (coordinates, velocities) = spec.sizes();
    let (qpos_adr, dof_adr, joint) = (model.qpos0.len(), model.dofs.len(), model.joints.len());
    model.joints.push(Joint {
        name: name(spec.element),
        kind: spec.kind,
        body,
        pos: spec.pos,
        axis: spec.axis,
        qpos_adr,
        dof_adr,
        limited: spec.limited,
        range: spec.range,
        margin: spec.margin,
        stiffness: spec.stiffness.0,
        stiffness_poly: spec.stiffness.1,
        solref_limit: spec.solref_limit,
        solimp_limit: spec.solimp_limit,
        actuator_force_range: spec.actuator_force_range,
        actuator_gravcomp: spec.actuator_gravcomp,
        group: spec.group,
    });
    let rest = match spec.kind {
        JointType::Free => {
            let Body { pos, quat, .. } = &model.bodies[body];
            [pos.as_slice(), quat.as_slice()].concat()
        }
        JointType::Ball => IDENTITY.to_vec(),
        JointType::Slide | JointType::Hinge => vec![spec.reference],
    };
    model.qpos_spring.extend_from_slice(if coordinates == 1 {
        std::slice::from_ref(&spec.spring_reference)
    } else {
        &rest
    });
    model.qpos0.extend(rest);
    for _ in 0..velocities {
        let parent = model.dofs.len().checked_sub(1).filter(|&last| last >= dof_adr);
        let parent = parent.or_else(|| last_dof_above(model, body, dof_adr));
        model.dofs.push(Dof {
            body,
            joint,
            parent,
            armature: spec.armature,
            damping: spec.damping.0,
            damping_poly: spec.damping.1,
            geared: false,
            frictionloss: spec.frictionloss,
            solref_friction: spec.solref_friction,
            solimp_friction: spec.solimp_friction,
            invweight0: 0.0,
        });
    }
    model.nq = model.qpos0.len();
    model.nv = model.dofs.len();
}

/// The dof before `first` on the way from `body` to the root.
fn last_dof_above(model: &Model, body: usize, first: usize) -> Option<usize> {
    if first > model.bodies[body].dof_start {
        return Some(first - 1);
    }
    let above = &model.bodies[model.bodies[model.bodies[body].parent].weld_id];
    (above.dof_count > 0).then(|| above.dof_start + above.dof_count - 1)
}

/// Own color, else that of the material.
fn color(
    shape: &super::geom::ShapeSpec,
    element: &Element,
    material: Option<&str>,
    materials: &BTreeMap<&str, Option<[f32; 4]>>,
) -> Result<[f32; 4], MjcfError> {
    let Some(name) = material else { return Ok(shape.rgba) };
    match materials.get(name) {
        Some(Some(color)) if shape.colorless() => Ok(*color),
        Some(None) if shape.colorless() => Ok([1.0; 4]),
        Some(_) => Ok(shape.rgba),
        None => {
            let hint = did_you_mean(nearest(name, materials.keys().copied()));
            Err(element.invalid(format!("there is no material '{}'{hint}", super::error::shorten(name))))
        }
    }
}

fn convert_geom(spec: &GeomSpec, body: usize, materials: &BTreeMap<&str, Option<[f32; 4]>>) -> Result<Geom, MjcfError> {
    Ok(Geom {
        name: name(spec.element),
        kind: spec.shape.kind,
        body,
        pos: spec.shape.frame.pos,
        quat: spec.shape.frame.quat,
        size: spec.shape.size,
        hfield: spec.shape.hfield,
        hull: None,
        mesh: spec.shape.solid.map(|solid| solid.mesh),
        contype: spec.surface.contype,
        conaffinity: spec.surface.conaffinity,
        condim: spec.surface.condim,
        priority: spec.surface.priority,
        friction: spec.surface.friction,
        solmix: spec.surface.solmix,
        solref: spec.surface.solref,
        solimp: spec.surface.solimp,
        margin: spec.surface.margin,
        gap: spec.surface.gap,
        rgba: color(&spec.shape, spec.element, spec.material, materials)?,
        material: spec.material.map(str::to_owned),
        group: spec.shape.group,
        fluid: spec.fluid.and_then(|given| fluid::ellipsoid(spec.shape.kind, spec.shape.size, given)),
    })
}

fn convert_site(spec: &SiteSpec, body: usize, materials: &BTreeMap<&str, Option<[f32; 4]>>) -> Result<Site, MjcfError> {
    Ok(Site {
        name: name(spec.element),
        kind: spec.shape.kind,
        body,
        pos: spec.shape.frame.pos,
        quat: spec.shape.frame.quat,
        size: spec.shape.size,
        rgba: color(&spec.shape, spec.element, spec.material, materials)?,
        group: spec.shape.group,
    })
}

fn convert_camera(spec: &CameraSpec, body: usize) -> Camera {
    Camera {
        name: name(spec.element),
        body,
        pos: spec.frame.pos,
        quat: spec.frame.quat,
        mode: spec.mode,
        fovy: spec.fovy,
    }
}

fn convert_light(spec: &LightSpec, body: usize) -> Light {
    Light {
        name: name(spec.element),
        body,
        pos: spec.pos,
        dir: spec.dir,
        mode: spec.mode,
        directional: spec.directional,
        diffuse: spec.diffuse,
    }
}

/// The names of everything, each checked to be unique.
fn registry<'a>(root: &'a Element, bodies: &[BodySpec<'a>]) -> Result<Registry<'a>, MjcfError> {
    let mut body_names = Names::new("body");
    body_names.reserve("world", 0);
    for (index, body) in bodies.iter().enumerate().skip(1) {
        body_names.add(body.element, index)?;
    }
    Names::collect("light", bodies.iter().flat_map(|b| &b.lights).map(|l| l.element))?;
    Ok(Registry {
        bodies: body_names,
        joints: Names::collect("joint", bodies.iter().flat_map(|b| &b.joints).map(|j| j.element))?,
        geoms: Names::collect("geom", bodies.iter().flat_map(|b| &b.geoms).map(|g| g.element))?,
        sites: Names::collect("site", bodies.iter().flat_map(|b| &b.sites).map(|s| s.element))?,
        cameras: Names::collect("camera", bodies.iter().flat_map(|b| &b.cameras).map(|c| c.element))?,
        tendons: Names::collect("tendon", tendon::elements(root))?,
        actuators: Names::collect("actuator", actuator::elements(root))?,
    })
}

/// Cameras and lights may look at bodies.
fn check_targets(bodies: &[BodySpec], names: &Registry) -> Result<(), MjcfError> {
    let cameras = bodies.iter().flat_map(|b| &b.cameras).map(|c| c.element);
    let lights = bodies.iter().flat_map(|b| &b.lights).map(|l| l.element);
    for element in cameras.chain(lights).filter(|e| e.text("target").is_some_and(|t| !t.is_empty())) {
        names.bodies.required(element, "target")?;
    }
    Ok(())
}

/// Stiffness and damping of joints with `springdamper`, from their mean inverse weight `1/m`.
///
/// With time constant `t` and damping ratio `z`: stiffness `m / (t z)^2`, damping `2 m / t`. Source: MuJoCo.
fn spring_dampers(model: &mut Model, bodies: &[BodySpec]) {
    let specs = bodies.iter().flat_map(|b| &b.joints);
    for (joint, spec) in model.joints.iter_mut().zip(specs) {
        let Some([time, ratio]) = spec.springdamper else { continue };
        let dofs = joint.dof_adr..joint.dof_adr + spec.sizes().1;
        let weights = model.dofs[dofs.clone()].iter().map(|d| d.invweight0);
        let mass = dofs.len() as f64 / weights.sum::<f64>().max(MIN_VAL);
        joint.stiffness = mass / (time * time * ratio * ratio).max(MIN_VAL);
        for dof in &mut model.dofs[dofs] {
            // what actuators add stays
            dof.damping += 2.0 * mass / time.max(MIN_VAL) - spec.damping.0;
        }
    }
}

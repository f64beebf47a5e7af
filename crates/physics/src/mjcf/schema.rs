// one file: the table of all MJCF elements and attributes
//! Which elements and attributes MJCF has (MuJoCo 4.0), and which of them this engine takes.
//!
//! Everything in a file is either read, or known to leave the dynamics alone, or refused with its file and line.
//! Nothing is skipped silently.

use super::document::{Attr, Element};
use super::error::{MjcfError, MjcfErrorKind, shorten};
use super::value::Attrs;
use crate::hint::nearest;

/// One element that may stand inside another.
struct Rule {
    name: &'static str,
    /// Attributes that are read.
    reads: &'static str,
    /// Attributes that do not change the dynamics.
    ignores: &'static str,
    /// Attributes that would change the dynamics, as `name` or `name=value` with the values that leave it alone,
    /// separated by `|`.
    refuses: &'static str,
    inside: Inside,
}

/// Allowed children of an element.
enum Inside {
    /// The elements of this list.
    Rules(&'static [Rule]),
    /// Children of the world, see [`BODY`].
    Bodies,
    /// Anything: the element is of no consequence.
    Anything,
    /// The element itself is refused.
    Refused(&'static str),
}

const NOTHING: Inside = Inside::Rules(&[]);

const fn rule(name: &'static str, reads: &'static str, ignores: &'static str, refuses: &'static str) -> Rule {
    Rule { name, reads, ignores, refuses, inside: NOTHING }
}

const fn section(name: &'static str, reads: &'static str, rules: &'static [Rule]) -> Rule {
    Rule { name, reads, ignores: "", refuses: "", inside: Inside::Rules(rules) }
}

const fn anything(name: &'static str) -> Rule {
    Rule { name, reads: "", ignores: "", refuses: "", inside: Inside::Anything }
}

const fn refused(name: &'static str, reason: &'static str) -> Rule {
    Rule { name, reads: "", ignores: "", refuses: "", inside: Inside::Refused(reason) }
}

const fn containing(rule: Rule, rules: &'static [Rule]) -> Rule {
    Rule { inside: Inside::Rules(rules), ..rule }
}

const fn world_like(rule: Rule) -> Rule {
    Rule { inside: Inside::Bodies, ..rule }
}

/// Attribute of bodies that [`ModelSpec::to_xml`](super::spec::ModelSpec::to_xml) writes where MJCF cannot say how their mass is found.
pub(crate) const OTHER_MASS: &str = "masses";
const NO_PLUGIN: Rule = refused("plugin", "plugins are not supported");
const EXPAND: &str = "this engine does not expand models; save the expanded model from MuJoCo and load that";
const NO_FLEX: &str = "deformable bodies are not supported";

const TOP: &[Rule] = &[
    containing(
        rule(
            "compiler",
            "angle assetdir autolimits balanceinertia boundinertia boundmass coordinate eulerseq inertiafromgeom \
             inertiagrouprange meshdir settotalmass strippath fitaabb",
            "conflict discardvisual passthrough savecanonical savecompiled saveinertial texturedir usethread",
            "alignfree=false fusestatic=false",
        ),
        &[rule(
            "lengthrange",
            "mode useexisting uselimit",
            "accel interval inttotal maxforce timeconst timestep tolrange",
            "",
        )],
    ),
    containing(
        rule(
            "option",
            "timestep gravity density viscosity wind magnetic integrator cone impratio iterations ls_iterations \
             ls_tolerance tolerance noslip_iterations noslip_tolerance ccd_iterations ccd_tolerance solver jacobian \
             o_margin o_solref o_solimp o_friction",
            // each of these has an effect only together with something that is refused, or that bodies do not do: sleep
            "sdf_initpoints sdf_iterations sleep_tolerance",
            "actuatorgroupdisable",
        ),
        &[rule(
            "flag",
            "constraint equality limit contact frictionloss spring damper gravity clampctrl warmstart actuation \
             refsafe eulerdamp filterparent island midphase multiccd nativeccd override",
            "autoreset energy fwdinv invdiscrete sleep",
            "sensor=enable diagexact=disable ipc=disable \
             speculative=disable",
        )],
    ),
    rule(
        "size",
        "nkey",
        "memory nconmax njmax nstack nuser_actuator nuser_body nuser_cam nuser_geom nuser_jnt nuser_sensor \
         nuser_site nuser_tendon nuserdata",
        "",
    ),
    rule("statistic", "center extent meaninertia meanmass meansize", "", ""),
    section("visual", "", VISUAL),
    section("default", "class", &[]),
    // a plugin has an effect only through an instance or an element that uses it
    section("extension", "", &[section("plugin", "plugin", &[refused("instance", "plugins are not supported")])]),
    section("asset", "", ASSET),
    section("worldbody", "", BODY),
    section("deformable", "", &[refused("flex", NO_FLEX), anything("skin")]),
    section("contact", "", CONTACT),
    section("tendon", "", TENDON),
    section("equality", "", EQUALITY),
    section("actuator", "", ACTUATOR),
    section("sensor", "", SENSOR),
    section("custom", "", CUSTOM),
    section("keyframe", "", &[rule("key", "name time qpos qvel act ctrl mpos mquat", "", "plastic")]),
];

const VISUAL: &[Rule] = &[
    rule(
        "global",
        "",
        "azimuth bvactive cameraid elevation ellipsoidinertia fovy glow ipd linewidth offheight offwidth \
         orthographic realtime",
        "",
    ),
    rule("quality", "", "numquads numslices numstacks offsamples shadowsize", ""),
    rule("headlight", "", "active ambient diffuse specular", ""),
    rule(
        "map",
        "",
        "actuatortendon alpha fogend fogstart force haze shadowclip shadowscale stiffness stiffnessrot torque zfar \
         znear",
        "",
    ),
    rule(
        "scale",
        "",
        "actuatorlength actuatorwidth camera com connect constraint contactheight contactwidth forcewidth \
         framelength framewidth frustum jointlength jointwidth light selectpoint slidercrank",
        "",
    ),
    rule(
        "rgba",
        "",
        "actuator actuatornegative actuatorpositive bv bvactive camera com connect constraint contactforce \
         contactfriction contactgap contactpoint contacttorque crankbroken fog force frustum haze inertia joint \
         light rangefinder selectpoint slidercrank",
        "",
    ),
];

// assets that nothing refers to are of no consequence
const ASSET: &[Rule] = &[
    containing(
        rule(
            "mesh",
            "name class file content_type vertex face scale refpos refquat maxhullvert inertia builtin params material",
            "smoothnormal normal texcoord",
            "",
        ),
        &[NO_PLUGIN],
    ),
    rule("hfield", "name nrow ncol size elevation file content_type", "", ""),
    anything("skin"),
    rule("model", "name file content_type", "", ""),
    rule(
        "texture",
        "name class",
        "builtin colorspace content_type embed file fileback filedown filefront fileleft fileright fileup \
         gridlayout gridsize height hflip mark markrgb nchannel random rgb1 rgb2 type vflip width",
        "",
    ),
    containing(
        rule(
            "material",
            "name class rgba",
            "emission metallic reflectance roughness shininess specular texrepeat texture texuniform",
            "",
        ),
        &[rule("layer", "", "role texture", "")],
    ),
];

const BODY: &[Rule] = &[
    world_like(rule(
        "body",
        "name childclass mocap gravcomp simple sleep pos quat axisangle euler xyaxes zaxis",
        "user fuse",
        OTHER_MASS,
    )),
    world_like(rule(
        "frame",
        "name childclass pos quat axisangle euler xyaxes zaxis",
        "scaling",
        "scale=1 massscale=1",
    )),
    rule("inertial", "pos mass diaginertia fullinertia quat axisangle euler xyaxes zaxis", "", ""),
    rule(
        "joint",
        "name class type pos axis range limited margin ref springref stiffness damping armature frictionloss \
         springdamper solreflimit solimplimit solreffriction solimpfriction actuatorfrcrange actuatorfrclimited \
         actuatorgravcomp group",
        "user",
        "springyield=0",
    ),
    rule("freejoint", "name group", "", "align=false|auto"),
    containing(
        rule(
            "geom",
            "name class type pos quat axisangle euler xyaxes zaxis fromto size mass density contype conaffinity \
             condim priority friction solmix solref solimp margin gap group rgba material \
             hfield mesh fitscale fluidshape fluidcoef",
            "castshadow user",
            "adhesion=0 surfacevel=0 shellinertia=false",
        ),
        &[NO_PLUGIN],
    ),
    rule(
        "site",
        "name class type pos quat axisangle euler xyaxes zaxis fromto size group rgba material",
        "user",
        "mesh",
    ),
    rule(
        "camera",
        "name class pos quat axisangle euler xyaxes zaxis mode target fovy focal focalpixel principal \
         principalpixel resolution sensorsize",
        "ipd output projection user",
        "",
    ),
    rule(
        "light",
        "name class pos dir mode target directional type diffuse",
        "active ambient attenuation bulbradius castshadow cutoff exponent intensity range softness specular texture",
        "",
    ),
    NO_PLUGIN,
    ATTACH,
    REPLICATE,
    refused("composite", EXPAND),
    refused("flexcomp", NO_FLEX),
];

const CONTACT: &[Rule] = &[
    rule("pair", "name class condim friction gap geom1 geom2 margin solimp solref", "", "adhesion=0 solreffriction=0"),
    rule("exclude", "name body1 body2", "", ""),
];

/// Attributes of every tendon.
macro_rules! tendon_reads {
    () => {
        "name class stiffness damping frictionloss armature limited range margin springlength actuatorfrclimited \
         actuatorfrcrange solreflimit solimplimit solreffriction solimpfriction group"
    };
}
const TENDON: &[Rule] = &[
    containing(
        rule("spatial", tendon_reads!(), "material rgba user width", "springyield=0"),
        &[rule("site", "site", "", ""), rule("geom", "geom", "sidesite", ""), rule("pulley", "", "divisor", "")],
    ),
    containing(rule("fixed", tendon_reads!(), "user", "springyield=0"), &[rule("joint", "joint coef", "", "")]),
];

const EQUALITY: &[Rule] = &[
    rule("connect", "name class active solref solimp body1 body2 site1 site2 anchor", "", ""),
    rule("weld", "name class active solref solimp body1 body2 site1 site2 anchor relpose torquescale", "", ""),
    rule("joint", "name class active solref solimp joint1 joint2 polycoef", "", ""),
    rule("tendon", "name class active solref solimp tendon1 tendon2 polycoef", "", ""),
    refused("flex", NO_FLEX),
    refused("flexstrain", NO_FLEX),
];

/// Attributes of every actuator that have an effect only with something that is refused.
macro_rules! actuator_ignores {
    () => {
        "group interp user"
    };
}
/// Attributes of every actuator that are refused: delay.
macro_rules! actuator_refuses {
    () => {
        "delay=0 nsample=0"
    };
}
/// Attributes of every actuator that are read, but for those of sites.
macro_rules! muscle_reads {
    () => {
        "name class joint jointinparent tendon cranksite slidersite cranklength gear ctrllimited ctrlrange forcelimited \
         forcerange lengthrange damping armature"
    };
}
/// Attributes of every actuator but the muscle that are read.
macro_rules! actuator_reads {
    () => {
        concat!(muscle_reads!(), " site refsite")
    };
}
/// The reason for refusing other actuators.
pub(crate) const NO_ACTUATOR: &str = "only the actuators motor, position, velocity, intvelocity, damper, cylinder, muscle, adhesion and general \
     are supported";
const ACTUATOR: &[Rule] = &[
    rule(
        "general",
        concat!(
            actuator_reads!(),
            " gainprm gaintype biasprm biastype dynprm dyntype actdim actearly actlimited actrange inheritrange input body"
        ),
        // only unsupported laws use the inputs that these two ranges limit
        concat!(actuator_ignores!(), " ffrange velrange"),
        actuator_refuses!(),
    ),
    rule("motor", actuator_reads!(), actuator_ignores!(), actuator_refuses!()),
    rule(
        "position",
        concat!(actuator_reads!(), " kp kv dampratio timeconst inheritrange"),
        actuator_ignores!(),
        actuator_refuses!(),
    ),
    rule("velocity", concat!(actuator_reads!(), " kv"), actuator_ignores!(), actuator_refuses!()),
    rule(
        "intvelocity",
        concat!(actuator_reads!(), " kp kv dampratio actlimited actrange inheritrange"),
        actuator_ignores!(),
        actuator_refuses!(),
    ),
    // MuJoCo's damper has no switch for its control range
    rule("damper", concat!(actuator_reads!(), " kv"), actuator_ignores!(), actuator_refuses!()),
    rule(
        "cylinder",
        concat!(actuator_reads!(), " timeconst area diameter bias"),
        actuator_ignores!(),
        actuator_refuses!(),
    ),
    refused("orientation", NO_ACTUATOR),
    refused("pid", NO_ACTUATOR),
    rule(
        "muscle",
        concat!(muscle_reads!(), " timeconst tausmooth range force scale lmin lmax vmax fpmax fvmax"),
        actuator_ignores!(),
        actuator_refuses!(),
    ),
    rule(
        "adhesion",
        "name class body gain ctrlrange forcelimited forcerange",
        "group interp user",
        actuator_refuses!(),
    ),
    refused("dcmotor", NO_ACTUATOR),
    NO_PLUGIN,
];

const fn sensor(name: &'static str, reads: &'static str) -> Rule {
    rule(name, reads, "name cutoff delay interval interp noise nsample user", "")
}
const FRAME: &str = "objtype objname reftype refname";
const PAIR: &str = "body1 body2 geom1 geom2";
const SENSOR: &[Rule] = &[
    sensor("touch", "site"),
    sensor("accelerometer", "site"),
    sensor("velocimeter", "site"),
    sensor("gyro", "site"),
    sensor("force", "site"),
    sensor("torque", "site"),
    sensor("magnetometer", "site"),
    sensor("camprojection", "site camera"),
    sensor("rangefinder", "site camera data"),
    sensor("jointpos", "joint"),
    sensor("jointvel", "joint"),
    sensor("tendonpos", "tendon"),
    sensor("tendonvel", "tendon"),
    sensor("actuatorpos", "actuator"),
    sensor("actuatorvel", "actuator"),
    sensor("actuatorfrc", "actuator"),
    sensor("jointactuatorfrc", "joint"),
    sensor("tendonactuatorfrc", "tendon"),
    sensor("ballquat", "joint"),
    sensor("ballangvel", "joint"),
    sensor("jointlimitpos", "joint"),
    sensor("jointlimitvel", "joint"),
    sensor("jointlimitfrc", "joint"),
    sensor("tendonlimitpos", "tendon"),
    sensor("tendonlimitvel", "tendon"),
    sensor("tendonlimitfrc", "tendon"),
    sensor("framepos", FRAME),
    sensor("framequat", FRAME),
    sensor("framexaxis", FRAME),
    sensor("frameyaxis", FRAME),
    sensor("framezaxis", FRAME),
    sensor("framelinvel", FRAME),
    sensor("frameangvel", FRAME),
    sensor("framelinacc", "objtype objname"),
    sensor("frameangacc", "objtype objname"),
    sensor("subtreecom", "body"),
    sensor("subtreelinvel", "body"),
    sensor("subtreeangmom", "body"),
    sensor("insidesite", "site objtype objname enclosed"),
    sensor("distance", PAIR),
    sensor("normal", PAIR),
    sensor("fromto", PAIR),
    sensor("contact", "body1 body2 geom1 geom2 data num reduce site subtree1 subtree2"),
    sensor("e_potential", ""),
    sensor("e_kinetic", ""),
    sensor("clock", ""),
    sensor("user", "datatype dim needstage objtype objname"),
    refused("tactile", "this sensor is not supported"),
    NO_PLUGIN,
];

const CUSTOM: &[Rule] = &[
    rule("numeric", "name data size", "", ""),
    rule("text", "name data", "", ""),
    section("tuple", "name", &[rule("element", "objname objtype prm", "", "")]),
];

/// It is expanded before the rest of the model is checked. MuJoCo 4 accepts a prefix and does not use it.
const REPLICATE: Rule = world_like(rule("replicate", "count offset euler sep childclass", "prefix", ""));

/// It is expanded as well.
const ATTACH: Rule = rule("attach", "model body frame prefix", "", "");

/// Checks the names of the attributes of a `<replicate>`, an `<attach>` or a `<model>`, which are gone when the rest is checked.
pub(crate) fn check_expanded(element: &Element) -> Result<(), MjcfError> {
    let rules = [&REPLICATE, &ATTACH].into_iter().chain(ASSET);
    match rules.into_iter().find(|rule| rule.name == element.name) {
        Some(rule) => attributes(element, rule, ""),
        None => Ok(()),
    }
}

/// Checks the names of all elements and attributes.
pub(crate) fn check(root: &Element) -> Result<(), MjcfError> {
    attributes(root, &section("mujoco", "model", TOP), "")?;
    root.children.iter().try_for_each(|child| element(child, root, TOP))
}

/// Checks the names of one element, given the way to it from the root. With `inside` it also checks what the element contains.
pub(crate) fn check_at(root: &Element, path: &[usize], inside: bool) -> Result<(), MjcfError> {
    let Some((last, above)) = path.split_last() else { return Ok(()) };
    let (mut parent, mut rules) = (root, TOP);
    for step in above {
        parent = &parent.children[*step];
        rules = match rules.iter().find(|r| r.name == parent.name).map(|r| &r.inside) {
            Some(Inside::Rules(inner)) => inner,
            Some(Inside::Bodies) => BODY,
            _ => &[],
        };
    }
    let child = &parent.children[*last];
    match rules.iter().find(|r| r.name == child.name) {
        _ if parent.name == "default" => default(child, parent),
        Some(rule) if !inside => checked(child, rule, ""),
        _ => element(child, parent, rules),
    }
}

/// Names of the sections that a model can have.
pub(crate) fn section_names() -> impl Iterator<Item = &'static str> {
    TOP.iter().map(|rule| rule.name)
}

fn element(element: &Element, parent: &Element, rules: &'static [Rule]) -> Result<(), MjcfError> {
    let Some(rule) = rules.iter().find(|r| r.name == element.name) else {
        return Err(unknown_element(element, parent, rules.iter().map(|r| r.name)));
    };
    checked(element, rule, "")?;
    match &rule.inside {
        Inside::Bodies => descend(element, BODY),
        _ if rule.name == "default" => element.children.iter().try_for_each(|child| default(child, element)),
        Inside::Rules(inner) => descend(element, inner),
        _ => Ok(()),
    }
}

fn descend(parent: &Element, rules: &'static [Rule]) -> Result<(), MjcfError> {
    parent.children.iter().try_for_each(|child| element(child, parent, rules))
}

/// Attributes that belong to one element and not to a class.
const NOT_IN_CLASSES: &str = "name class target joint jointinparent tendon geom1 geom2 site refsite slidersite cranksite body lengthrange tausmooth";

/// Elements that set defaults, apart from actuators and elements with their own rules.
const DEFAULTS: [&str; 8] = ["joint", "geom", "site", "camera", "light", "pair", "material", "texture"];
const DEFAULT: Rule = section("default", "class", &[]);
const EQUALITY_DEFAULT: Rule = rule("equality", "active solref solimp", "", "");
/// Defaults of an unsupported actuator still set the attributes that all actuators share.
const ACTUATOR_DEFAULT: Rule = rule("actuator", "", "", actuator_refuses!());

/// The rule for an element that sets defaults.
fn rule_of_default(name: &str) -> Option<&'static Rule> {
    match name {
        "default" => return Some(&DEFAULT),
        "equality" => return Some(&EQUALITY_DEFAULT),
        "tendon" => return TENDON.first(),
        // it has no effect unless an element uses it, which is refused
        "mesh" => return ASSET.iter().find(|r| r.name == name),
        _ => {}
    }
    let tables = [BODY, CONTACT, ASSET].map(|t| t.iter()).into_iter().flatten();
    tables.filter(|r| DEFAULTS.contains(&r.name)).chain(ACTUATOR).find(|r| r.name == name)
}

/// Checks an element in a `<default>` class, which has the attributes of a model element except its own identity.
///
/// An unsupported setting is refused only where an element uses it, see [`check_inherited`].
fn default(child: &Element, parent: &Element) -> Result<(), MjcfError> {
    let Some(rule) = rule_of_default(&child.name) else {
        let names = ACTUATOR.iter().map(|r| r.name).chain(DEFAULTS).chain(["default", "mesh", "equality", "tendon"]);
        return Err(unknown_element(child, parent, names));
    };
    match &rule.inside {
        Inside::Refused(_) | Inside::Anything => return Ok(()),
        Inside::Rules(_) | Inside::Bodies => {}
    }
    let except = if rule.name == "default" { "" } else { NOT_IN_CLASSES };
    tolerate(attributes(child, rule, except))?;
    match &rule.inside {
        _ if rule.name == "default" => child.children.iter().try_for_each(|inner| default(inner, child)),
        Inside::Rules(inner) => tolerate(descend(child, inner)),
        _ => Ok(()),
    }
}

/// Accepts unsupported settings in a class, because elements may not use them.
pub(crate) fn tolerate<T>(outcome: Result<T, MjcfError>) -> Result<(), MjcfError> {
    match outcome {
        Err(error) if !matches!(error.kind, MjcfErrorKind::Unsupported { .. }) => Err(error),
        _ => Ok(()),
    }
}

/// Refuses unsupported settings that an element of the model inherits from its classes and does not replace.
pub(crate) fn check_inherited(attrs: &Attrs) -> Result<(), MjcfError> {
    for (i, layer) in attrs.defaults.iter().enumerate() {
        let Some(rule) = rule_of_default(&layer.name) else { continue };
        let rule = if matches!(rule.inside, Inside::Refused(_)) { &ACTUATOR_DEFAULT } else { rule };
        let words = |attr: &Attr| attr.value.split_ascii_whitespace().count();
        for (name, neutral) in refuses(rule) {
            let Some(attr) = layer.attr(name).filter(|attr| !is_neutral(attr, neutral)) else { continue };
            // a shorter list would replace only some of the numbers
            let later = attrs.chain().skip(i + 1).filter_map(|e| e.attr(name));
            if !later.into_iter().any(|own| words(own) >= words(attr)) {
                return Err(not_supported(layer, attr, neutral));
            }
        }
        if let Inside::Rules(inner) = &rule.inside {
            descend(layer, inner)?;
        }
    }
    Ok(())
}

/// Names of the attributes that a rule refuses, each with the values that equal the default.
fn refuses(rule: &Rule) -> impl Iterator<Item = (&'static str, &'static str)> + use<> {
    rule.refuses.split_ascii_whitespace().map(|r| r.split_once('=').unwrap_or((r, "")))
}

fn not_supported(element: &Element, attr: &Attr, neutral: &str) -> MjcfError {
    let reason = match neutral.split('|').next().unwrap_or_default() {
        "" => "it is not supported".to_owned(),
        value => format!("'{}' is not supported, only '{value}'", shorten(&attr.value)),
    };
    element.unsupported(Some(&attr.name), reason)
}

fn unknown_element<'a>(element: &Element, parent: &Element, names: impl Iterator<Item = &'a str>) -> MjcfError {
    element.place.error(MjcfErrorKind::UnknownElement {
        element: element.label(),
        parent: shorten(&parent.name),
        nearest: nearest(&element.name, names).map(Into::into),
    })
}

fn checked(element: &Element, rule: &Rule, except: &str) -> Result<(), MjcfError> {
    match rule.inside {
        Inside::Refused(reason) => Err(element.unsupported(None, reason)),
        Inside::Anything => Ok(()),
        Inside::Rules(_) | Inside::Bodies => attributes(element, rule, except),
    }
}

/// Checks the attributes of one element; those in `except` do not exist here.
fn attributes(element: &Element, rule: &Rule, except: &str) -> Result<(), MjcfError> {
    let known = || {
        let plain = rule.reads.split_ascii_whitespace().chain(rule.ignores.split_ascii_whitespace());
        plain.filter(|name| !except.split_ascii_whitespace().any(|e| e == *name))
    };
    for attr in &element.attrs {
        if known().any(|name| name == attr.name) {
            continue;
        }
        let refuses = || refuses(rule).filter(|(name, _)| !except.split_ascii_whitespace().any(|e| e == *name));
        match refuses().find(|(name, _)| *name == attr.name) {
            Some((_, neutral)) if is_neutral(attr, neutral) => {}
            Some((_, neutral)) => return Err(not_supported(element, attr, neutral)),
            None => {
                let names = known().chain(refuses().map(|(name, _)| name));
                return Err(attr.place.error(MjcfErrorKind::UnknownAttribute {
                    element: element.label(),
                    attribute: shorten(&attr.name),
                    nearest: nearest(&attr.name, names).map(Into::into),
                }));
            }
        }
    }
    Ok(())
}

/// Whether every word of the value is one of the neutral ones, as a word or as a number.
fn is_neutral(attr: &Attr, neutral: &str) -> bool {
    attr.value.split_ascii_whitespace().all(|word| {
        neutral
            .split('|')
            .any(|n| n == word || matches!((n.parse::<f64>(), word.parse::<f64>()), (Ok(a), Ok(b)) if a == b))
    })
}

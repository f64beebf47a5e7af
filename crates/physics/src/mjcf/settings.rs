//! `<compiler>`, `<option>`, `<size>` and `<statistic>`: what holds for the whole model.

use super::compiler::{LengthRange, Settings, Tristate, Turn};
use super::document::Element;
use super::error::MjcfError;
use super::solver_params::{SOLIMP, SOLREF};
use super::value::Attrs;
use crate::model::{Cone, ContactOverride, Flags, Integrator, Options, Solver, Vec3};

impl Settings {
    /// The settings for an element: its own ones if it was attached from another model.
    pub fn of<'s>(&'s self, element: &'s Element) -> &'s Settings {
        element.settings.as_deref().unwrap_or(self)
    }

    /// Reads all `<compiler>` sections; of an attribute given several times the last counts.
    pub fn read(root: &Element) -> Result<Self, MjcfError> {
        let mut settings = Settings {
            degree: true,
            autolimits: true,
            eulerseq: [0, 1, 2].map(|axis| Turn { axis, fixed: false }),
            boundmass: 0.0,
            boundinertia: 0.0,
            balanceinertia: false,
            settotalmass: -1.0,
            inertiafromgeom: Tristate::Auto,
            inertiagrouprange: [0, 5],
            meshdir: String::new(),
            sleep: false,
            strippath: false,
            fitaabb: false,
            lengthrange: LengthRange::DEFAULT,
            folder: String::new(),
        };
        for element in sections(root, "compiler") {
            settings.section(element)?;
        }
        Ok(settings)
    }

    fn section(&mut self, element: &Element) -> Result<(), MjcfError> {
        let attrs = Attrs::plain(element);
        if attrs.keyword("coordinate", &[("local", false), ("global", true)])? == Some(true) {
            let reason = "global coordinates are not supported; MuJoCo 2.3.3 and older can convert the file";
            return Err(element.unsupported(Some("coordinate"), reason));
        }
        self.degree = attrs.keyword("angle", &[("radian", false), ("degree", true)])?.unwrap_or(self.degree);
        self.autolimits = attrs.flag_or("autolimits", self.autolimits)?;
        self.boundmass = attrs.number_or("boundmass", self.boundmass)?;
        self.boundinertia = attrs.number_or("boundinertia", self.boundinertia)?;
        self.balanceinertia = attrs.flag_or("balanceinertia", self.balanceinertia)?;
        self.settotalmass = attrs.number_or("settotalmass", self.settotalmass)?;
        if attrs.has("inertiafromgeom") {
            self.inertiafromgeom = attrs.tristate("inertiafromgeom")?;
        }
        if let Some(range) = attrs.array::<2>("inertiagrouprange")? {
            self.inertiagrouprange = range.map(|x| x as i32);
        }
        // meshdir takes precedence over assetdir
        for name in ["assetdir", "meshdir"] {
            if let Some(folder) = element.text(name) {
                self.meshdir = folder.to_owned();
            }
        }
        self.strippath = attrs.flag_or("strippath", self.strippath)?;
        self.fitaabb = attrs.flag_or("fitaabb", self.fitaabb)?;
        for range in element.children.iter().filter(|e| e.name == "lengthrange") {
            self.lengthrange.apply(range)?;
        }
        if let Some(attr) = element.attr("eulerseq") {
            let turn = |c: char| {
                let axis = "xyz".find(c.to_ascii_lowercase())?;
                Some(Turn { axis, fixed: c.is_ascii_uppercase() })
            };
            let turns: Option<Vec<Turn>> = attr.value.chars().map(turn).collect();
            self.eulerseq = turns
                .and_then(|t| t.try_into().ok())
                .ok_or_else(|| element.bad_value(attr, "three letters out of x, y, z, X, Y, Z"))?;
        }
        Ok(())
    }
}

/// Sections of the model with the given name, in document order.
pub(crate) fn sections<'a>(root: &'a Element, name: &'a str) -> impl Iterator<Item = &'a Element> {
    root.children.iter().filter(move |e| e.name == name)
}

/// All children of the sections with the given name, in document order.
pub(crate) fn entries<'a>(root: &'a Element, name: &'a str) -> impl Iterator<Item = &'a Element> {
    sections(root, name).flat_map(|section| section.children.iter())
}

/// Reads `<option>` with its `<flag>`.
pub(crate) fn options(root: &Element) -> Result<Options, MjcfError> {
    let mut opt = Options {
        timestep: 0.002,
        gravity: [0.0, 0.0, -9.81],
        density: 0.0,
        viscosity: 0.0,
        wind: [0.0; 3],
        magnetic: [0.0, -0.5, 0.0],
        integrator: Integrator::Euler,
        cone: Cone::Pyramidal,
        impratio: 1.0,
        iterations: 100,
        ls_iterations: 50,
        tolerance: 1e-8,
        ls_tolerance: 0.01,
        noslip_iterations: 0,
        noslip_tolerance: 1e-6,
        ccd_iterations: 35,
        ccd_tolerance: 1e-6,
        solver: Solver::Newton,
        contact_override: None,
        flags: Flags {
            constraint: true,
            equality: true,
            limit: true,
            contact: true,
            frictionloss: true,
            spring: true,
            damper: true,
            gravity: true,
            clampctrl: true,
            warmstart: true,
            actuation: true,
            refsafe: true,
            eulerdamp: true,
            filterparent: true,
            multiccd: true,
            nativeccd: true,
            island: true,
            midphase: true,
        },
    };
    // the parameters of the override are read whether it is on or not
    let mut given =
        ContactOverride { margin: 0.0, solref: SOLREF, solimp: SOLIMP, friction: [1.0, 1.0, 0.005, 0.0001, 0.0001] };
    let mut replace = false;
    for element in sections(root, "option") {
        option(element, &mut opt, &mut given)?;
        for flag in element.children.iter().filter(|e| e.name == "flag") {
            replace = flags(flag, &mut opt.flags)?.unwrap_or(replace);
        }
    }
    opt.contact_override = replace.then_some(given);
    Ok(opt)
}

fn option(element: &Element, opt: &mut Options, given: &mut ContactOverride) -> Result<(), MjcfError> {
    let attrs = Attrs::plain(element);
    let at_least_zero = |name: &str, value: f64| match element.attr(name) {
        Some(attr) if value < 0.0 => Err(element.bad_value(attr, "a number that is not negative")),
        _ => Ok(value),
    };
    opt.timestep = attrs.number_or("timestep", opt.timestep)?;
    if let Some(attr) = element.attr("timestep").filter(|_| opt.timestep <= 0.0) {
        return Err(element.bad_value(attr, "a number greater than zero"));
    }
    opt.gravity = attrs.array_or("gravity", opt.gravity)?;
    opt.density = at_least_zero("density", attrs.number_or("density", opt.density)?)?;
    opt.viscosity = at_least_zero("viscosity", attrs.number_or("viscosity", opt.viscosity)?)?;
    opt.wind = attrs.array_or("wind", opt.wind)?;
    opt.magnetic = attrs.array_or("magnetic", opt.magnetic)?;
    given.margin = attrs.number_or("o_margin", given.margin)?;
    given.solref = attrs.partial_or("o_solref", given.solref)?;
    given.solimp = attrs.partial_or("o_solimp", given.solimp)?;
    given.friction = attrs.partial_or("o_friction", given.friction)?;
    opt.impratio = attrs.number_or("impratio", opt.impratio)?;
    if let Some(attr) = element.attr("impratio").filter(|_| opt.impratio <= 0.0) {
        return Err(element.bad_value(attr, "a number greater than zero"));
    }
    opt.tolerance = at_least_zero("tolerance", attrs.number_or("tolerance", opt.tolerance)?)?;
    opt.ls_tolerance = at_least_zero("ls_tolerance", attrs.number_or("ls_tolerance", opt.ls_tolerance)?)?;
    opt.noslip_tolerance =
        at_least_zero("noslip_tolerance", attrs.number_or("noslip_tolerance", opt.noslip_tolerance)?)?;
    opt.ccd_tolerance = at_least_zero("ccd_tolerance", attrs.number_or("ccd_tolerance", opt.ccd_tolerance)?)?;
    let counts = [
        ("iterations", &mut opt.iterations),
        ("ls_iterations", &mut opt.ls_iterations),
        ("noslip_iterations", &mut opt.noslip_iterations),
        ("ccd_iterations", &mut opt.ccd_iterations),
    ];
    for (name, value) in counts {
        if let Some(attr) = element.attr(name) {
            let given = attrs.integer_or(name, 0)?;
            *value = usize::try_from(given).map_err(|_| element.bad_value(attr, "an integer that is not negative"))?;
        }
    }
    let integrators = [
        ("Euler", Some(Integrator::Euler)),
        ("RK4", Some(Integrator::Rk4)),
        ("implicit", Some(Integrator::Implicit)),
        ("implicitfast", Some(Integrator::ImplicitFast)),
        ("discrete", None),
    ];
    match attrs.keyword("integrator", &integrators)? {
        Some(Some(integrator)) => opt.integrator = integrator,
        Some(None) => {
            let reason = "the integrator 'discrete' is not supported; use Euler or RK4";
            return Err(element.unsupported(Some("integrator"), reason));
        }
        None => {}
    }
    let cones = [("pyramidal", Cone::Pyramidal), ("elliptic", Cone::Elliptic)];
    opt.cone = attrs.keyword("cone", &cones)?.unwrap_or(opt.cone);
    let solvers = [("PGS", Solver::Pgs), ("CG", Solver::Cg), ("Newton", Solver::Newton)];
    opt.solver = attrs.keyword("solver", &solvers)?.unwrap_or(opt.solver);
    attrs.keyword("jacobian", &[("dense", ()), ("sparse", ()), ("auto", ())])?;
    Ok(())
}

/// Whether bodies at rest fall asleep in MuJoCo.
pub(crate) fn sleep(root: &Element) -> bool {
    entries(root, "option").filter_map(|flag| flag.text("sleep")).last() == Some("enable")
}

/// Reads `<flag>`; returns whether the contact override is on, if the element says so.
fn flags(element: &Element, flags: &mut Flags) -> Result<Option<bool>, MjcfError> {
    let attrs = Attrs::plain(element);
    let mut replace = None;
    for attr in &element.attrs {
        let slot = match attr.name.as_str() {
            "constraint" => Some(&mut flags.constraint),
            "equality" => Some(&mut flags.equality),
            "limit" => Some(&mut flags.limit),
            "contact" => Some(&mut flags.contact),
            "frictionloss" => Some(&mut flags.frictionloss),
            "spring" => Some(&mut flags.spring),
            "damper" => Some(&mut flags.damper),
            "gravity" => Some(&mut flags.gravity),
            "clampctrl" => Some(&mut flags.clampctrl),
            "warmstart" => Some(&mut flags.warmstart),
            "actuation" => Some(&mut flags.actuation),
            "refsafe" => Some(&mut flags.refsafe),
            "eulerdamp" => Some(&mut flags.eulerdamp),
            "filterparent" => Some(&mut flags.filterparent),
            "multiccd" => Some(&mut flags.multiccd),
            "nativeccd" => Some(&mut flags.nativeccd),
            "island" => Some(&mut flags.island),
            "midphase" => Some(&mut flags.midphase),
            _ => None,
        };
        let value = attrs.keyword(&attr.name, &[("disable", false), ("enable", true)])?;
        if attr.name == "override" {
            replace = value;
        }
        if let (Some(slot), Some(value)) = (slot, value) {
            *slot = value;
        }
    }
    Ok(replace)
}

/// `<statistic>`: only what the file gives.
#[derive(Default)]
pub(crate) struct GivenStatistics {
    pub mean_inertia: Option<f64>,
    pub mean_mass: Option<f64>,
    pub extent: Option<f64>,
    pub center: Option<Vec3>,
}

/// Reads all `<statistic>` sections.
pub(crate) fn statistics(root: &Element) -> Result<GivenStatistics, MjcfError> {
    let mut given = GivenStatistics::default();
    for element in sections(root, "statistic") {
        let attrs = Attrs::plain(element);
        for (name, slot) in [
            ("meaninertia", &mut given.mean_inertia),
            ("meanmass", &mut given.mean_mass),
            ("extent", &mut given.extent),
        ] {
            let Some(attr) = element.attr(name) else { continue };
            let value = attrs.number_or(name, 0.0)?;
            if value <= 0.0 {
                return Err(element.bad_value(attr, "a number greater than zero"));
            }
            *slot = Some(value);
        }
        given.center = attrs.array("center")?.or(given.center);
    }
    Ok(given)
}

//! Gain, bias and activation of actuators, assembled from classes and shortcuts.

use super::compiler::Tristate;
use super::document::{Attr, Element};
use super::error::MjcfError;
use super::muscle;
use super::schema::NO_ACTUATOR;
use super::value::Attrs;
use crate::hint::{did_you_mean, nearest};
use crate::model::Dynamics;
use std::f64::consts::PI;

/// Kind of activation dynamics; their numbers are kept apart, as in MuJoCo.
#[derive(Clone, Copy, PartialEq)]
enum Activation {
    None,
    Integrator,
    Filter,
    FilterExact,
    Muscle,
}

/// Kind of a gain or a bias.
#[derive(Clone, Copy, PartialEq)]
enum Law {
    /// A constant gain, and no bias.
    Plain,
    Affine,
    Muscle,
}

/// The numbers of a gain or a bias; most laws use only the first.
type Numbers = [f64; 10];

/// Three numbers, and none of the others.
fn three([a, b, c]: [f64; 3]) -> Numbers {
    [a, b, c, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]
}

/// Gain, bias and activation as the elements of a class and the actuator itself set them, one after the other.
#[derive(Clone, Copy)]
pub(crate) struct ActuatorParams<'a> {
    /// Element that set the parameters last.
    element: &'a str,
    gain: Numbers,
    gain_law: Law,
    bias: Numbers,
    bias_law: Law,
    activation: Activation,
    /// Time constant of a filter; those of a muscle, and the width of the transition between them.
    times: [f64; 3],
    /// Part of the range of the joint or tendon that a position servo takes over; 0: none.
    pub inherited_range: f64,
    /// Unsupported settings, by the part of the parameters that may still replace them.
    refused: [Option<Refused<'a>>; PARTS],
}

/// An unsupported attribute, or an unsupported element if there is no attribute, with the reason.
#[derive(Clone, Copy)]
struct Refused<'a> {
    element: &'a Element,
    attribute: Option<&'static str>,
    reason: &'static str,
}

/// Parts that can be unsupported: the element, then the attributes of `<general>`, the kind of gain first.
const PARTS: usize = 1 + ATTRIBUTES.len();
const ATTRIBUTES: [&str; 4] = ["gaintype", "biastype", "dyntype", "input"];
/// The reason for refusing other kinds of gain and bias.
const LAWS: &str = "only constant and affine laws and muscles are supported";

impl<'a> ActuatorParams<'a> {
    const GENERAL: ActuatorParams<'static> = ActuatorParams {
        element: "general",
        gain: [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        gain_law: Law::Plain,
        bias: [0.0; 10],
        bias_law: Law::Plain,
        activation: Activation::None,
        times: [1.0, 0.0, 0.0],
        inherited_range: 0.0,
        refused: [None; PARTS],
    };
    const MUSCLE: ActuatorParams<'static> = ActuatorParams {
        element: "muscle",
        gain: muscle::NUMBERS,
        gain_law: Law::Muscle,
        bias: muscle::NUMBERS,
        bias_law: Law::Muscle,
        activation: Activation::Muscle,
        times: muscle::TIMES,
        ..ActuatorParams::GENERAL
    };

    /// The parameters of an actuator: the classes' elements in order, then its own.
    ///
    /// `ends` counts the elements up to the end of each class, outermost first.
    pub fn compile(attrs: &Attrs<'a>, ends: &[usize]) -> Result<Self, MjcfError> {
        let mut params: ActuatorParams = ActuatorParams::GENERAL;
        let mut enclosing: Vec<ActuatorParams> = Vec::new();
        for (i, element) in attrs.chain().enumerate() {
            // the element's own class, the last one, stays open for it
            while enclosing.len() + 1 < ends.len() && ends[enclosing.len()] <= i {
                enclosing.push(params);
            }
            params.apply(element, &enclosing)?;
        }
        if let Some(refused) = params.refused.iter().flatten().next() {
            return Err(refused.element.unsupported(refused.attribute, refused.reason));
        }
        Ok(params)
    }

    /// Coefficients of an affine gain, or a constant one. Other numbers have no effect, so they are left out.
    pub fn gain(&self) -> [f64; 3] {
        let [constant, length, velocity, ..] = self.gain;
        match self.gain_law {
            Law::Plain => [constant, 0.0, 0.0],
            Law::Affine => [constant, length, velocity],
            Law::Muscle => [0.0; 3],
        }
    }

    /// Coefficients of an affine bias.
    pub fn bias(&self) -> [f64; 3] {
        let [constant, length, velocity, ..] = self.bias;
        if self.bias_law == Law::Affine { [constant, length, velocity] } else { [0.0; 3] }
    }

    /// Numbers of a muscle's active and passive force.
    pub fn muscles(&self) -> [Option<Numbers>; 2] {
        let of = |law: Law, numbers: Numbers| (law == Law::Muscle).then_some(numbers);
        [of(self.gain_law, self.gain), of(self.bias_law, self.bias)]
    }

    /// How the activation follows the control.
    pub fn dynamics(&self) -> Dynamics {
        let [time_constant, deactivation, smoothing] = self.times;
        match self.activation {
            Activation::None => Dynamics::None,
            Activation::Integrator => Dynamics::Integrator,
            Activation::Filter => Dynamics::Filter { time_constant },
            Activation::FilterExact => Dynamics::FilterExact { time_constant },
            Activation::Muscle => Dynamics::Muscle { activation: time_constant, deactivation, smoothing },
        }
    }

    /// Whether this is a servo that drives the length to its input, which may inherit a range.
    pub fn is_position_servo(&self) -> bool {
        self.gain_law == Law::Plain && self.bias_law == Law::Affine && self.gain[0] == -self.bias[1]
    }

    /// Whether a shortcut element can start from these parameters.
    fn serves(&self, shortcut: &str) -> bool {
        let law = match shortcut {
            "muscle" => Law::Muscle,
            "damper" => Law::Affine,
            _ => Law::Plain,
        };
        self.element == shortcut || (self.element == "general" && self.gain_law == law && self.refused[1].is_none())
    }

    /// Replaces an unsupported attribute.
    fn set_part(&mut self, attribute: &'static str, element: &'a Element, reason: Option<&'static str>) {
        if let Some(at) = ATTRIBUTES.iter().position(|a| *a == attribute) {
            self.refused[1 + at] = reason.map(|reason| Refused { element, attribute: Some(attribute), reason });
        }
    }

    /// Applies one element. A shortcut takes the parameters that it does not set from those so far, else from
    /// the nearest enclosing class with an element of its own kind or a general one.
    fn apply(&mut self, element: &'a Element, enclosing: &[ActuatorParams<'a>]) -> Result<(), MjcfError> {
        let attrs = Attrs::plain(element);
        let name = element.name.as_str();
        if name == "general" {
            self.general(element, &attrs)?;
            return self.inherit(element, &attrs);
        }
        if !self.serves(name) {
            let own = if name == "muscle" { ActuatorParams::MUSCLE } else { ActuatorParams::GENERAL };
            *self = enclosing.iter().rev().find(|params| params.serves(name)).copied().unwrap_or(own);
        }
        // of the activation of a general actuator a shortcut keeps only what it could have set itself
        let known =
            matches!(name, "cylinder" | "muscle") || (name == "position" && self.activation == Activation::FilterExact);
        if self.element != name && !known {
            (self.activation, self.times) = (Activation::None, ActuatorParams::GENERAL.times);
        }
        // the shortcut sets all parts itself, but keeps unknown parts of an unsupported element
        let unknown = self.refused[0].filter(|_| self.element == "general");
        self.refused = [None; PARTS];
        self.refused[0] = unknown;
        let kept = self.gain[0];
        match name {
            "position" | "intvelocity" => self.servo(element, &attrs)?,
            "velocity" => {
                let kv = attrs.number_or("kv", kept)?;
                (self.gain, self.bias) = (three([kv, 0.0, 0.0]), three([0.0, 0.0, -kv]));
                self.activation = Activation::None;
            }
            "damper" => {
                let kept = if self.gain_law == Law::Affine { -self.gain[2] } else { 0.0 };
                let kv = attrs.number_or("kv", kept)?;
                if kv < 0.0 {
                    return Err(element.invalid("kv must not be negative"));
                }
                (self.gain, self.bias) = (three([0.0, 0.0, -kv]), [0.0; 10]);
                self.activation = Activation::None;
            }
            "cylinder" => {
                let area = attrs.number_or("area", kept)?;
                let area =
                    attrs.array::<1>("diameter")?.map_or(area, |[d]| if d >= 0.0 { PI / 4.0 * d * d } else { area });
                let [a, b, c, ..] = self.bias;
                (self.gain, self.bias) = (three([area, 0.0, 0.0]), three(attrs.array_or("bias", [a, b, c])?));
                self.times = [attrs.number_or("timeconst", self.times[0])?, 0.0, 0.0];
                self.activation = Activation::Filter;
            }
            "motor" => *self = ActuatorParams::GENERAL,
            "adhesion" => {
                let gain = attrs.number_or("gain", kept)?;
                if gain < 0.0 {
                    return Err(element.invalid("gain must not be negative"));
                }
                (self.gain, self.bias) = (three([gain, 0.0, 0.0]), [0.0; 10]);
            }
            "muscle" => {
                muscle::read(&attrs, &mut self.gain, &mut self.times)?;
                self.bias = self.gain;
                self.activation = Activation::Muscle;
            }
            // the class's settings, which the element may replace
            _ => {
                *self = ActuatorParams::GENERAL;
                let refused = Some(Refused { element, attribute: None, reason: NO_ACTUATOR });
                self.refused[0] = refused;
                self.refused[1] = refused;
                self.element = name;
                return Ok(());
            }
        }
        self.element = name;
        (self.gain_law, self.bias_law) = match name {
            "motor" | "adhesion" => (Law::Plain, Law::Plain),
            "damper" => (Law::Affine, Law::Plain),
            "muscle" => (Law::Muscle, Law::Muscle),
            _ => (Law::Plain, Law::Affine),
        };
        Ok(())
    }

    /// `<position>` and `<intvelocity>`: a servo on the length, and the same driven by the integral of the control.
    fn servo(&mut self, element: &'a Element, attrs: &Attrs) -> Result<(), MjcfError> {
        let kp = attrs.number_or("kp", self.gain[0])?;
        let kv: Option<[f64; 1]> = attrs.array("kv")?;
        let ratio: Option<[f64; 1]> = attrs.array("dampratio")?;
        let damping = match (kv, ratio) {
            (Some(_), Some(_)) => return Err(element.invalid("there are both 'kv' and 'dampratio'")),
            (Some([kv]), None) if kv < 0.0 => return Err(element.invalid("kv must not be negative")),
            (None, Some([r])) if r < 0.0 => return Err(element.invalid("dampratio must not be negative")),
            (Some([kv]), None) => -kv,
            // a positive number marks a damping ratio, which the inertia turns into damping later
            (None, Some([ratio])) => ratio,
            (None, None) => self.bias[2],
        };
        (self.gain, self.bias) = (three([kp, 0.0, 0.0]), three([0.0, -kp, damping]));
        if let Some([time]) = attrs.array("timeconst")? {
            if time < 0.0 {
                return Err(element.invalid("timeconst must not be negative"));
            }
            self.times = [time, 0.0, 0.0];
            self.activation = if time == 0.0 { Activation::None } else { Activation::FilterExact };
        }
        if element.name == "intvelocity" {
            self.activation = Activation::Integrator;
        }
        self.inherit(element, attrs)
    }

    /// `inheritrange`, unless a range of its own comes later: that of the control, or of the integrated activation.
    fn inherit(&mut self, element: &'a Element, attrs: &Attrs) -> Result<(), MjcfError> {
        let own = if self.activation == Activation::Integrator { "actrange" } else { "ctrlrange" };
        let part = attrs.array::<1>("inheritrange")?.map_or(0.0, |p| p[0]);
        if part < 0.0 {
            return Err(element.invalid("inheritrange must not be negative"));
        }
        match (part > 0.0, element.attr(own).is_some()) {
            (true, true) if element.name != "general" => {
                return Err(element.invalid(format!("there are both '{own}' and 'inheritrange'")));
            }
            (true, _) => self.inherited_range = part,
            (false, true) => self.inherited_range = 0.0,
            (false, false) => {}
        }
        Ok(())
    }

    /// `<general>` changes what it gives and keeps the rest.
    fn general(&mut self, element: &'a Element, attrs: &Attrs) -> Result<(), MjcfError> {
        self.element = "general";
        attrs.overlay("gainprm", 0, &mut self.gain)?;
        attrs.overlay("biasprm", 0, &mut self.bias)?;
        let mut dynamics = [0.0; 10];
        dynamics[..3].copy_from_slice(&self.times);
        attrs.overlay("dynprm", 0, &mut dynamics)?;
        self.times.copy_from_slice(&dynamics[..3]);
        let gains = [
            ("fixed", Some(Law::Plain)),
            ("affine", Some(Law::Affine)),
            ("muscle", Some(Law::Muscle)),
            ("dcmotor", None),
            ("so3", None),
            ("pid", None),
            ("user", None),
        ];
        let biases = [
            ("none", Some(Law::Plain)),
            ("affine", Some(Law::Affine)),
            ("muscle", Some(Law::Muscle)),
            ("dcmotor", None),
            ("so3", None),
            ("user", None),
        ];
        let activations = [
            ("none", Some(Activation::None)),
            ("integrator", Some(Activation::Integrator)),
            ("filter", Some(Activation::Filter)),
            ("filterexact", Some(Activation::FilterExact)),
            ("muscle", Some(Activation::Muscle)),
            ("dcmotor", None),
            ("pid", None),
            ("user", None),
        ];
        if let Some(kind) = attrs.keyword("gaintype", &gains)? {
            self.gain_law = kind.unwrap_or(Law::Plain);
            self.set_part("gaintype", element, kind.is_none().then_some(LAWS));
        }
        if let Some(kind) = attrs.keyword("biastype", &biases)? {
            self.bias_law = kind.unwrap_or(Law::Plain);
            self.set_part("biastype", element, kind.is_none().then_some(LAWS));
        }
        if let Some(kind) = attrs.keyword("dyntype", &activations)? {
            self.activation = kind.unwrap_or(Activation::None);
            let reason = "only none, integrator, filter, filterexact and muscle are supported";
            self.set_part("dyntype", element, kind.is_none().then_some(reason));
        }
        if let Some(attr) = element.attr("input") {
            let refused = input(element, attr)?;
            self.set_part("input", element, refused);
        }
        Ok(())
    }
}

/// The reason for refusing the inputs in `<general>`, if they are not supported. An actuator with one control has one input,
/// and the input's name changes nothing.
fn input(element: &Element, attr: &Attr) -> Result<Option<&'static str>, MjcfError> {
    const INPUTS: [&str; 8] = ["pos", "vel", "ff", "voltage", "pressure", "none", "expmap", "quat"];
    let words: Vec<&str> = attr.value.split_ascii_whitespace().collect();
    if let Some(word) = words.iter().find(|word| !INPUTS.contains(word)) {
        let hint = did_you_mean(nearest(word, INPUTS));
        return Err(element.bad_value(attr, format!("'pos', 'vel' or 'pressure'{hint}")));
    }
    let one = matches!(words.as_slice(), [] | ["pos" | "vel" | "pressure"]);
    Ok((!one).then_some("only one input is supported: 'pos', 'vel' or 'pressure'"))
}

/// Limits of control and activation, and switches that shortcuts set whatever came before them.
pub(crate) struct Limits {
    /// Whether the control is limited.
    pub ctrl_limited: Tristate,
    /// `ctrlrange`.
    pub ctrl_range: [f64; 2],
    /// Whether the activation is limited.
    pub act_limited: Tristate,
    /// `actrange`.
    pub act_range: [f64; 2],
    /// `actearly`.
    pub act_early: bool,
}

impl Limits {
    /// Follows the classes' elements in order, then the actuator's own.
    pub fn read(attrs: &Attrs) -> Result<Self, MjcfError> {
        let mut all = Limits {
            ctrl_limited: Tristate::Auto,
            ctrl_range: [0.0; 2],
            act_limited: Tristate::Auto,
            act_range: [0.0; 2],
            act_early: false,
        };
        attrs.chain().try_for_each(|element| all.apply(element))?;
        Ok(all)
    }

    fn apply(&mut self, element: &Element) -> Result<(), MjcfError> {
        let own = Attrs::plain(element);
        for (name, switch) in [("ctrllimited", &mut self.ctrl_limited), ("actlimited", &mut self.act_limited)] {
            if element.attr(name).is_some() {
                *switch = own.tristate(name)?;
            }
        }
        self.ctrl_range = own.array_or("ctrlrange", self.ctrl_range)?;
        self.act_range = own.array_or("actrange", self.act_range)?;
        self.act_early = own.flag_or("actearly", self.act_early)?;
        if element.name != "general" {
            (self.act_limited, self.act_early) = (Tristate::Auto, false);
        }
        // a range that is to be inherited replaces the one so far
        let inherits = own.number_or("inheritrange", 0.0)? > 0.0;
        match element.name.as_str() {
            "position" if inherits => self.ctrl_range = [0.0; 2],
            "intvelocity" if inherits => self.act_range = [0.0; 2],
            "damper" | "adhesion" if self.ctrl_range.iter().any(|x| *x < 0.0) => {
                let owner = if element.name == "damper" { "a damper" } else { "adhesion" };
                let message = format!("the control range of {owner} must not be negative");
                return Err(element.invalid(message));
            }
            "damper" | "adhesion" => self.ctrl_limited = Tristate::True,
            _ => {}
        }
        Ok(())
    }
}

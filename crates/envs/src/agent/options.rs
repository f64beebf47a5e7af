//! Named arguments of agents: `ctrl_cost_weight = 0.01`, `healthy_z_range = (0.8, 2)`.
//!
//! An agent that takes arguments is a struct declared with [`options!`](crate::options!): one list says the names, types,
//! defaults and meanings, and [`Agent::options`](crate::Agent::options) returns it to code that makes environments by
//! name. The error for an unknown name suggests the nearest one in the list.

use std::collections::BTreeMap;
use std::sync::Arc;

use marathon_motion::Clip;
use marathon_physics::budget::VIDEO_SECONDS;

pub use super::clips::{Clips, NamedClip};
pub use super::value::Value;

/// Arguments that only help training: outside of training, policies run with their defaults.
pub const OF_LEARNING: [&str; 3] = ["end_on_fall_prob", "start_pushed_prob", "replay_falls_prob"];

/// Arguments by name, in the order in which they were given. Equal ones may have been given in another order.
#[derive(Clone, Debug, Default)]
pub struct Options(Vec<(String, Value)>);

impl PartialEq for Options {
    fn eq(&self, other: &Self) -> bool {
        self.0.len() == other.0.len() && self.iter().all(|(name, value)| other.get(name) == Some(value))
    }
}

impl Options {
    /// No arguments.
    pub fn new() -> Self {
        Options::default()
    }

    /// These and one more, or one replaced.
    pub fn with(mut self, name: &str, value: impl Into<Value>) -> Self {
        self.set(name, value);
        self
    }

    /// Adds an argument, or replaces its value. Clips whose names other arguments' clips have get other names.
    pub fn set(&mut self, name: &str, value: impl Into<Value>) {
        let mut value = value.into();
        if let Value::Clips(clips) = value {
            let others = self.iter().filter(|(known, _)| *known != name);
            let others: Vec<NamedClip> = others.filter_map(|(_, value)| Clips::read(value)).flatten().collect();
            value = clips.beside(&others).into();
        }
        match self.0.iter_mut().find(|(known, _)| known == name) {
            Some((_, old)) => *old = value,
            None => self.0.push((name.into(), value)),
        }
    }

    /// Value of an argument, if it is given.
    pub fn get(&self, name: &str) -> Option<&Value> {
        self.0.iter().find(|(known, _)| known == name).map(|(_, value)| value)
    }

    /// All names and values.
    pub fn iter(&self) -> impl Iterator<Item = (&str, &Value)> {
        self.0.iter().map(|(name, value)| (name.as_str(), value))
    }

    /// The given clips of all arguments by their names. Clips that come with Marathon have a name alone.
    pub fn given_clips(&self) -> BTreeMap<&str, &Arc<Clip>> {
        let clips = self.0.iter().filter_map(|(_, value)| match value {
            Value::Clips(clips) => Some(clips.given()),
            _ => None,
        });
        clips.flatten().collect()
    }

    /// The same with clips in place of their names, as they were before they were stored.
    pub fn bind_clips(mut self, given: &[NamedClip]) -> Self {
        for (_, value) in &mut self.0 {
            if let Value::Text(names) = value
                && names.split(',').any(|name| given.iter().any(|clip| clip.name() == name.trim()))
            {
                *value = Clips::named(names).bound(given).into();
            }
        }
        self
    }

    /// These without some.
    pub fn without(mut self, names: &[&str]) -> Self {
        self.0.retain(|(name, _)| !names.contains(&name.as_str()));
        self
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }
}

impl FromIterator<(String, Value)> for Options {
    fn from_iter<I: IntoIterator<Item = (String, Value)>>(list: I) -> Self {
        let mut options = Options::new();
        for (name, value) in list {
            options.set(&name, value);
        }
        options
    }
}

/// An argument that an agent takes.
#[derive(Clone, Debug)]
pub struct OptionInfo {
    /// Name.
    pub name: &'static str,
    /// Value that this agent has for it.
    pub value: Value,
    /// Allowed values, such as `a number`.
    pub expected: &'static str,
    /// Its meaning.
    pub about: &'static str,
    /// Whether it takes a value, see [`OptionInfo::takes`].
    pub reads: fn(&Value) -> bool,
}

impl OptionInfo {
    /// Whether the argument can have a value.
    pub fn takes(&self, value: &Value) -> bool {
        (self.reads)(value)
    }
}

/// A type that an argument can have.
pub trait OptionValue: Sized {
    /// Allowed values, for error messages.
    const EXPECTED: &'static str;
    /// As a value.
    fn value(&self) -> Value;
    /// From a value; `None` for what is not allowed.
    fn read(value: &Value) -> Option<Self>;
}

/// A type with a few values, each with a name: that is how an argument of it is given.
pub trait Choice: Copy + PartialEq + 'static {
    /// The names, for error messages.
    const EXPECTED: &'static str;
    /// All values with their names.
    const NAMED: &'static [(Self, &'static str)];
}

impl<T: Choice> OptionValue for T {
    const EXPECTED: &'static str = <T as Choice>::EXPECTED;
    fn value(&self) -> Value {
        let known = Self::NAMED.iter().find(|(choice, _)| choice == self);
        known.map_or(Value::Text(String::new()), |(_, name)| (*name).into())
    }
    fn read(value: &Value) -> Option<Self> {
        Self::NAMED.iter().find(|(_, name)| Value::from(*name) == *value).map(|(choice, _)| *choice)
    }
}

impl OptionValue for bool {
    const EXPECTED: &'static str = "true or false";
    fn value(&self) -> Value {
        Value::Bool(*self)
    }
    fn read(value: &Value) -> Option<Self> {
        match value {
            Value::Bool(x) => Some(*x),
            // Python's callers write 0 and 1 too
            Value::Number(x) if *x == 0.0 || *x == 1.0 => Some(*x == 1.0),
            _ => None,
        }
    }
}

impl OptionValue for f64 {
    const EXPECTED: &'static str = "a number";
    fn value(&self) -> Value {
        Value::Number(*self)
    }
    fn read(value: &Value) -> Option<Self> {
        match value {
            Value::Number(x) if !x.is_nan() => Some(*x),
            _ => None,
        }
    }
}

/// A number that cannot be negative, such as the width of a distribution.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scale(pub f64);

impl OptionValue for Scale {
    const EXPECTED: &'static str = "a finite number, 0 or more";
    fn value(&self) -> Value {
        Value::Number(self.0)
    }
    fn read(value: &Value) -> Option<Self> {
        match value {
            Value::Number(x) if *x >= 0.0 && x.is_finite() => Some(Scale(*x)),
            _ => None,
        }
    }
}

/// A fraction from 0 to 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Share(pub f64);

impl OptionValue for Share {
    const EXPECTED: &'static str = "a number from 0 to 1";
    fn value(&self) -> Value {
        Value::Number(self.0)
    }
    fn read(value: &Value) -> Option<Self> {
        match value {
            Value::Number(x) if (0.0..=1.0).contains(x) => Some(Share(*x)),
            _ => None,
        }
    }
}

/// A duration, s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Seconds(pub f64);

impl OptionValue for Seconds {
    const EXPECTED: &'static str = "seconds, from 0 to the limit 'video_seconds' (3600)";
    fn value(&self) -> Value {
        Value::Number(self.0)
    }
    fn read(value: &Value) -> Option<Self> {
        match value {
            Value::Number(x) if *x >= 0.0 && VIDEO_SECONDS.check(*x).is_ok() => Some(Seconds(*x)),
            _ => None,
        }
    }
}

impl OptionValue for usize {
    const EXPECTED: &'static str = "a whole number, 0 or more";
    fn value(&self) -> Value {
        Value::Number(*self as f64)
    }
    fn read(value: &Value) -> Option<Self> {
        match value {
            // beyond this a double does not count every whole number
            Value::Number(x) if x.fract() == 0.0 && (0.0..9e15).contains(x) => Some(*x as usize),
            _ => None,
        }
    }
}

impl OptionValue for [f64; 2] {
    const EXPECTED: &'static str = "two numbers, the lower one first";
    fn value(&self) -> Value {
        Value::Pair(*self)
    }
    fn read(value: &Value) -> Option<Self> {
        match value {
            // NaN is not in order either
            Value::Pair(x) if x[0] <= x[1] => Some(*x),
            _ => None,
        }
    }
}

impl OptionValue for String {
    const EXPECTED: &'static str = "a text";
    fn value(&self) -> Value {
        Value::Text(self.clone())
    }
    fn read(value: &Value) -> Option<Self> {
        match value {
            Value::Text(x) => Some(x.clone()),
            _ => None,
        }
    }
}

impl OptionValue for Clips {
    const EXPECTED: &'static str = "the name of a clip, several with commas between them, or all";
    fn value(&self) -> Value {
        self.clone().into()
    }
    fn read(value: &Value) -> Option<Self> {
        match value {
            Value::Text(names) => Some(Clips::named(names)),
            Value::Clips(clips) => Some(clips.clone()),
            _ => None,
        }
    }
}

/// A struct whose fields are arguments. Implemented by [`options!`](crate::options!).
pub trait OptionSet: Clone {
    /// All arguments with their present values.
    fn infos(&self) -> Vec<OptionInfo>;
    /// Sets one by name; `false` if there is none of this name or its type does not fit.
    fn put(&mut self, name: &str, value: &Value) -> bool;

    /// The same with some arguments set. Unknown names and values of the wrong type are ignored; the registry refuses
    /// them earlier.
    fn with(&self, options: &Options) -> Self {
        let mut set = self.clone();
        for (name, value) in options.iter() {
            set.put(name, value);
        }
        set
    }
}

/// Declares a struct whose fields are the named arguments of an agent, with their defaults. The comment of a field is what
/// the argument's users read.
///
/// ```
/// use marathon_envs::options::{OptionSet, Options};
///
/// marathon_envs::options! {
///     /// Something that jumps.
///     pub struct Jumper {
///         /// Reward per meter.
///         height_weight: f64 = 2.0,
///         /// Whether a fall ends the episode.
///         terminate_when_fallen: bool = true,
///     }
/// }
///
/// let high = Jumper::default().with(&Options::new().with("height_weight", 3.0));
/// assert_eq!((high.height_weight, high.terminate_when_fallen), (3.0, true));
/// ```
#[macro_export]
macro_rules! options {
    (
        $(#[$outer:meta])*
        $vis:vis struct $name:ident {
            $($(#[doc = $about:literal])+ $field:ident: $type:ty = $default:expr),* $(,)?
        }
    ) => {
        $(#[$outer])*
        #[derive(Clone, Debug, PartialEq)]
        $vis struct $name {
            $($(#[doc = $about])+ pub $field: $type,)*
        }

        impl Default for $name {
            fn default() -> Self {
                $name { $($field: $default,)* }
            }
        }

        impl $crate::agent::options::OptionSet for $name {
            fn infos(&self) -> Vec<$crate::agent::options::OptionInfo> {
                vec![$($crate::agent::options::OptionInfo {
                    name: stringify!($field),
                    value: <$type as $crate::agent::options::OptionValue>::value(&self.$field),
                    expected: <$type as $crate::agent::options::OptionValue>::EXPECTED,
                    about: concat!($($about),+).trim(),
                    reads: |value| <$type as $crate::agent::options::OptionValue>::read(value).is_some(),
                },)*]
            }
            fn put(&mut self, name: &str, value: &$crate::agent::options::Value) -> bool {
                match name {
                    $(stringify!($field) => match <$type as $crate::agent::options::OptionValue>::read(value) {
                        Some(x) => {
                            self.$field = x;
                            true
                        }
                        None => false,
                    },)*
                    _ => false,
                }
            }
        }
    };
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_read_from_text() {
        let read = |text: &str| text.parse::<Value>().unwrap_or_else(|e| match e {});
        assert_eq!(read("True"), Value::Bool(true));
        assert_eq!(read("-1e-3"), Value::Number(-1e-3));
        assert_eq!(read("inf"), Value::Number(f64::INFINITY));
        assert_eq!(read("(0.7, inf)"), Value::Pair([0.7, f64::INFINITY]));
        assert_eq!(read("[1,2]"), Value::Pair([1.0, 2.0]));
        assert_eq!(read("nan"), Value::Text("nan".into()));
        assert_eq!(read("bodies/my ant.xml"), Value::Text("bodies/my ant.xml".into()));
    }

    options! {
        struct Sample {
            /// A count
            /// of things.
            count: usize = 3,
            /// A range.
            range: [f64; 2] = [0.0, f64::INFINITY],
            /// A name.
            name: String = "ant.xml".into(),
            /// A switch.
            on: bool = true,
            /// A width.
            width: Scale = Scale(1.0),
            /// A fraction.
            part: Share = Share(0.5),
            /// A duration.
            time: Seconds = Seconds(20.0),
        }
    }

    #[test]
    fn types_are_checked() {
        let mut x = Sample::default();
        assert!(x.put("count", &5.0.into()) && x.put("on", &0.0.into()) && x.put("range", &[1.0, 2.0].into()));
        assert!(x.put("part", &1.0.into()) && x.put("time", &3600.0.into()));
        for (name, value) in [
            ("part", Value::from(1.5)),
            ("part", (-0.1).into()),
            ("part", 1e18.into()),
            ("time", 1e300.into()),
            ("time", f64::INFINITY.into()),
            ("time", (-1.0).into()),
            ("count", Value::from(-1.0)),
            ("count", 0.5.into()),
            ("count", f64::INFINITY.into()),
            ("range", 1.0.into()),
            ("range", [f64::NAN, 0.0].into()),
            ("range", [2.0, 1.0].into()),
            ("width", (-0.1).into()),
            ("width", f64::INFINITY.into()),
            ("name", 1.0.into()),
            ("on", 2.0.into()),
            ("off", true.into()),
        ] {
            assert!(!x.put(name, &value), "{name} {value}");
        }
        let (part, time) = (Share(1.0), Seconds(3600.0));
        let expected = Sample { count: 5, range: [1.0, 2.0], on: false, part, time, ..Sample::default() };
        assert_eq!(x, expected);
        assert_eq!(x.infos()[0].about, "A count of things.");
    }
}

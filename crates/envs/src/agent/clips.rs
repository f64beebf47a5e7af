//! Motion clips as values of options.

use std::fmt;
use std::path::Path;
use std::sync::Arc;

use marathon_motion::{Clip, MotionError};

/// Ending of the names of clips that do not come with Marathon.
const ENDING: &str = ".motion";

/// Name of a clip whose own name is empty.
const UNNAMED: &str = "clip";

/// A motion clip by its name: one that comes with Marathon, or a given one.
#[derive(Clone, Debug)]
pub struct NamedClip {
    name: String,
    clip: Option<Arc<Clip>>,
}

impl PartialEq for NamedClip {
    fn eq(&self, other: &Self) -> bool {
        let same = match (&self.clip, &other.clip) {
            // clips are long: look at their numbers only if they are not the same object
            (Some(a), Some(b)) => Arc::ptr_eq(a, b) || a == b,
            (a, b) => a.is_none() && b.is_none(),
        };
        same && self.name == other.name
    }
}

/// A clip under its own name.
impl From<Clip> for NamedClip {
    fn from(clip: Clip) -> Self {
        let name = clip.about().name.clone();
        NamedClip::new(&name, clip)
    }
}

impl NamedClip {
    /// A given clip. Run folders hold it in a file, so its name becomes a [file name](NamedClip::file_name).
    pub fn new(name: &str, clip: impl Into<Arc<Clip>>) -> Self {
        NamedClip { name: Self::file_name(name), clip: Some(clip.into()) }
    }

    /// The clip of this name that comes with Marathon. The task looks it up when it is made.
    pub fn shipped(name: impl Into<String>) -> Self {
        NamedClip { name: name.into(), clip: None }
    }

    /// A given clip from the bytes of a `.motion` file.
    ///
    /// # Errors
    /// If they are no clip.
    pub fn parse(name: &str, bytes: &[u8]) -> Result<Self, MotionError> {
        Ok(NamedClip::new(name, Clip::parse(Path::new(name), bytes)?))
    }

    /// The name of a file for a clip: `jump` becomes `jump.motion`. Slashes, commas and control characters become underscores.
    pub fn file_name(name: &str) -> String {
        let name = name.trim();
        let stem = name.strip_suffix(ENDING).unwrap_or(name);
        let plain = |c: char| if c.is_control() || "/\\,".contains(c) { '_' } else { c };
        let stem: String = stem.chars().map(plain).collect();
        format!("{}{ENDING}", if stem.is_empty() { UNNAMED } else { &stem })
    }

    /// Its name.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The clip, if it is given.
    pub fn clip(&self) -> Option<&Arc<Clip>> {
        self.clip.as_ref()
    }

    /// The same clip with a number in its name, if another clip has the name.
    fn beside(self, others: &[NamedClip]) -> Self {
        if self.clip.is_none() {
            return self;
        }
        let stem = self.name.trim_end_matches(ENDING).to_string();
        let numbered = (2..).map(|i| format!("{stem}-{i}{ENDING}"));
        let names = std::iter::once(self.name.clone()).chain(numbered);
        let mut all = names.map(|name| NamedClip { name, clip: self.clip.clone() });
        let free = |clip: &NamedClip| others.iter().all(|other| other.name != clip.name || other == clip);
        all.find(free).unwrap_or(self)
    }
}

/// Clips in an order; a clip may be in it several times. Different clips have different names.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Clips(Vec<NamedClip>);

/// The names with commas between them.
impl fmt::Display for Clips {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let names: Vec<&str> = self.iter().map(NamedClip::name).collect();
        f.write_str(&names.join(","))
    }
}

impl FromIterator<NamedClip> for Clips {
    fn from_iter<I: IntoIterator<Item = NamedClip>>(clips: I) -> Self {
        let mut all = Clips::default();
        clips.into_iter().for_each(|clip| all.push(clip));
        all
    }
}

impl IntoIterator for Clips {
    type Item = NamedClip;
    type IntoIter = std::vec::IntoIter<NamedClip>;
    fn into_iter(self) -> Self::IntoIter {
        self.0.into_iter()
    }
}

impl Clips {
    /// Most clips of a task. A clip may be named several times.
    pub const MOST: usize = 1000;

    /// The clips of these names, with commas between them, that come with Marathon.
    pub fn named(names: &str) -> Self {
        names.split(',').map(|name| NamedClip::shipped(name.trim())).collect()
    }

    /// Adds a clip. If another clip has its name, it gets a number: `jump-2.motion`.
    pub fn push(&mut self, clip: NamedClip) {
        let clip = clip.beside(&self.0);
        self.0.push(clip);
    }

    /// All of them.
    pub fn iter(&self) -> std::slice::Iter<'_, NamedClip> {
        self.0.iter()
    }

    /// Names and clips of the given ones.
    pub fn given(&self) -> impl Iterator<Item = (&str, &Arc<Clip>)> {
        self.iter().filter_map(|clip| Some((clip.name(), clip.clip()?)))
    }

    /// Whether one of them is given.
    pub fn has_given(&self) -> bool {
        self.given().next().is_some()
    }

    /// The same with other names for clips that others have the names of.
    pub(super) fn beside(self, others: &[NamedClip]) -> Self {
        self.0.into_iter().map(|clip| clip.beside(others)).collect()
    }

    /// The same with given clips in place of their names.
    pub(super) fn bound(self, given: &[NamedClip]) -> Self {
        let bound = |clip: NamedClip| given.iter().find(|given| given.name == clip.name).cloned().unwrap_or(clip);
        self.0.into_iter().map(bound).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use marathon_motion::{About, JointKind, Layout};

    fn clip(name: &str, angle: f64) -> NamedClip {
        let about = About { name: name.into(), ..About::default() };
        let layout = Layout::new([("hip".into(), JointKind::Hinge)]);
        NamedClip::from(Clip::new(Path::new(name), about, layout, 0.1, None, &[vec![0.0], vec![angle]]).unwrap())
    }

    #[test]
    fn names_of_given_clips_are_file_names() {
        let named = ["jump", " jump.motion ", "../a,b", "", ".motion", "a\nb"].map(NamedClip::file_name);
        assert_eq!(named, ["jump.motion", "jump.motion", ".._a_b.motion", "clip.motion", "clip.motion", "a_b.motion"]);
        assert!(named.iter().all(|name| NamedClip::file_name(name) == *name), "{named:?}");
    }

    #[test]
    fn different_clips_have_different_names() {
        let all = [clip("a", 1.0), clip("a", 2.0), clip("a", 1.0), NamedClip::shipped("a"), clip("a", 3.0)];
        let all: Clips = all.into_iter().collect();
        assert_eq!(all.to_string(), "a.motion,a-2.motion,a.motion,a,a-3.motion");
        assert_eq!(all.given().count(), 4);
    }
}

//! The numbers of `<compiler>`, which [`settings`](super::settings) reads.

/// A switch that may be left to the compiler.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Tristate {
    False,
    True,
    Auto,
}

/// `<compiler><lengthrange>`: where the range of a muscle's lengths is from.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LengthRange {
    /// Whether anything but the file may set it.
    pub computed: bool,
    /// Whether a range in the file counts.
    pub existing: bool,
    /// Whether the limits of the joint or tendon count.
    pub limits: bool,
}

impl LengthRange {
    pub const DEFAULT: LengthRange = LengthRange { computed: true, existing: true, limits: false };
}

/// One of the three Euler rotations.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Turn {
    /// 0, 1, 2 for x, y, z.
    pub axis: usize,
    /// About the parent's axis instead of the rotating frame's.
    pub fixed: bool,
}

/// `<compiler>` after defaults are applied.
#[derive(Debug)]
pub(crate) struct Settings {
    pub degree: bool,
    pub autolimits: bool,
    pub eulerseq: [Turn; 3],
    pub boundmass: f64,
    pub boundinertia: f64,
    pub balanceinertia: bool,
    pub settotalmass: f64,
    pub inertiafromgeom: Tristate,
    pub inertiagrouprange: [i32; 2],
    /// Folder of height fields and meshes, relative to the model.
    pub meshdir: String,
    /// Bodies at rest may fall asleep in MuJoCo.
    pub sleep: bool,
    /// Files are looked up by their last path component.
    pub strippath: bool,
    /// Primitives are fitted to the bounding box of a mesh instead of its inertia.
    pub fitaabb: bool,
    /// Where the ranges of the lengths of muscles are from.
    pub lengthrange: LengthRange,
    /// Folder of the model's file, relative to the model that it is attached to; empty or with a slash at the end.
    pub folder: String,
}

impl Settings {
    /// Whether bodies have the same masses as with other settings.
    pub fn gives_masses_like(&self, other: &Settings) -> bool {
        let masses = |s: &Settings| {
            (s.boundmass, s.boundinertia, s.balanceinertia, s.inertiafromgeom, s.inertiagrouprange, s.fitaabb)
        };
        masses(self) == masses(other)
    }

    /// The angle in radians.
    pub fn angle(&self, given: f64) -> f64 {
        if self.degree { given * std::f64::consts::PI / 180.0 } else { given }
    }

    /// Path of a mesh or height field file, relative to the model.
    pub fn asset_path(&self, file: &str) -> String {
        let file = if self.strippath { file.rsplit(['/', '\\']).next().unwrap_or(file) } else { file };
        if file.starts_with('/') {
            return file.to_owned();
        }
        let folder = if self.meshdir.starts_with('/') { "" } else { &self.folder };
        match self.meshdir.trim_end_matches(['/', '\\']) {
            _ if self.meshdir.is_empty() => format!("{folder}{file}"),
            meshdir => format!("{folder}{meshdir}/{file}"),
        }
    }
}

//! Errors of generating a skin.

/// An error of [`skin`](crate::skin). All errors name the model.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum SkinError {
    /// No body has a geom that can become skin.
    #[error(
        "model '{model}': no body below the world has a sphere, capsule, box, cylinder or ellipsoid, found {found}; \
         expected at least one"
    )]
    NoGeoms {
        /// Name of the model.
        model: String,
        /// The geoms that the model has instead.
        found: String,
    },
    /// The character has more bodies than a skinned mesh can have joints.
    #[error(
        "model '{model}': the character '{root}' has {found} bodies, expected at most {max}, one per joint of the skin"
    )]
    TooManyBodies {
        /// Name of the model.
        model: String,
        /// First body of the character.
        root: String,
        /// Number of its bodies.
        found: usize,
        /// Largest number of joints.
        max: usize,
    },
    /// A number of the model is infinite, or so large that lengths overflow.
    #[error("model '{model}', geom '{geom}': its place or size is not a number that a mesh can have")]
    NotFinite {
        /// Name of the model.
        model: String,
        /// Name of the geom.
        geom: String,
    },
    /// An option is outside its range.
    #[error("triangles is {found}, expected {min} to {max}")]
    Triangles {
        /// The value found.
        found: usize,
        /// Smallest value.
        min: usize,
        /// Largest value.
        max: usize,
    },
}

//! Errors of model files, with file and line.

use crate::hint::did_you_mean;
use std::fmt;

/// An error in an MJCF model: the file, the line and what was found there.
///
/// Its text reads `hopper.xml:12: <geom name="foot"> has no attribute 'siez'; did you mean 'size'?`.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub struct MjcfError {
    /// File as it was named to the loader, or the name given with the text.
    pub file: String,
    /// Line, counted from 1; 0 when the error concerns the file as a whole.
    pub line: usize,
    /// The problem.
    pub kind: MjcfErrorKind,
}

impl fmt::Display for MjcfError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.line {
            0 => write!(f, "{}: {}", self.file, self.kind),
            line => write!(f, "{}:{}: {}", self.file, line, self.kind),
        }
    }
}

/// The kinds of [`MjcfError`]. `element` is the start tag with its name, such as `<geom name="foot">`.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum MjcfErrorKind {
    /// The file could not be read.
    #[error("cannot read the file: {0}")]
    Read(String),
    /// The file is not well-formed XML, or it is not an MJCF file.
    #[error("{0}")]
    Syntax(String),
    /// MJCF has no such element at this place.
    #[error("{element} is not an element of <{parent}>{}", did_you_mean(.nearest.as_ref()))]
    UnknownElement {
        /// The element found.
        element: String,
        /// Name of the enclosing element.
        parent: String,
        /// The most similar valid name.
        nearest: Option<String>,
    },
    /// MJCF has no such attribute in this element.
    #[error("{element} has no attribute '{attribute}'{}", did_you_mean(.nearest.as_ref()))]
    UnknownAttribute {
        /// The element found.
        element: String,
        /// The attribute found.
        attribute: String,
        /// The most similar valid name.
        nearest: Option<String>,
    },
    /// Valid MJCF that would change the dynamics and that this engine does not have.
    #[error("{element}{}: {reason}", in_attribute(.attribute))]
    Unsupported {
        /// The element found.
        element: String,
        /// The attribute, unless the whole element is meant.
        attribute: Option<String>,
        /// Why it is refused, and what to do instead where there is something.
        reason: String,
    },
    /// An attribute's text is not what the attribute takes.
    #[error("{element} attribute '{attribute}' is '{found}'; expected {expected}")]
    BadValue {
        /// The element found.
        element: String,
        /// The attribute.
        attribute: String,
        /// Its text (shortened when long).
        found: String,
        /// Expected value.
        expected: String,
    },
    /// An attribute refers to something that does not exist.
    #[error("{element} attribute '{attribute}': there is no {kind} '{found}'{}", did_you_mean(.nearest.as_ref()))]
    UnknownName {
        /// The element found.
        element: String,
        /// The attribute.
        attribute: String,
        /// Kind of the missing name: `joint`, `site`, `default class`...
        kind: String,
        /// The name found.
        found: String,
        /// The most similar existing name.
        nearest: Option<String>,
    },
    /// An edit names something that the model does not have.
    #[error("there is no {kind} '{found}'{}", did_you_mean(.nearest.as_ref()))]
    NotFound {
        /// Kind of the missing name: `body`, `geom`, `section`...
        kind: String,
        /// The name given.
        found: String,
        /// The most similar existing name.
        nearest: Option<String>,
    },
    /// The element contradicts itself or the rest of the model.
    #[error("{element}: {message}")]
    Invalid {
        /// The element found.
        element: String,
        /// The problem.
        message: String,
    },
}

fn in_attribute(attribute: &Option<String>) -> String {
    attribute.as_ref().map(|a| format!(" attribute '{a}'")).unwrap_or_default()
}

/// `text`, shortened to what fits in a message.
pub(crate) fn shorten(text: &str) -> String {
    const LONGEST: usize = 60;
    if text.chars().count() <= LONGEST {
        return text.to_owned();
    }
    let head: String = text.chars().take(LONGEST).collect();
    format!("{head}...")
}

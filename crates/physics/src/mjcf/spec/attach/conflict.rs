//! Merges the `<option>` of an attached model, as `<compiler conflict>` of the enclosing model says.
//!
//! | `conflict` | only the attached model sets it | both set it, to different values |
//! |---|---|---|
//! | `warning`, the default | the enclosing model's value | the enclosing model's value |
//! | `merge` | the attached model's value | the smaller or larger one where that is safe, else an error |
//! | `error` | the enclosing model's value | an error |
//!
//! With `merge`, flags that either model sets are set.

use super::super::super::document::{Attr, Element};
use super::super::super::error::{MjcfError, shorten};
use super::super::super::settings::{entries, sections};
use super::super::super::value::keyword;
use super::super::last_section;
use super::super::part::{Draft, set};

/// The value of both.
#[derive(Clone, Copy, PartialEq)]
enum Merge {
    Least,
    Most,
    Never,
}
use Merge::{Least, Most, Never};

#[derive(Clone, Copy, PartialEq)]
enum Policy {
    Warning,
    Merge,
    Error,
}
const POLICIES: [(&str, Policy); 3] =
    [("warning", Policy::Warning), ("merge", Policy::Merge), ("error", Policy::Error)];

/// Attributes of sections with their defaults; those without effect on the dynamics are there for their errors.
const ATTRIBUTES: [(&str, &str, Merge, &str); 35] = [
    ("option", "timestep", Least, "0.002"),
    ("option", "tolerance", Least, "1e-8"),
    ("option", "ls_tolerance", Least, "0.01"),
    ("option", "noslip_tolerance", Least, "1e-6"),
    ("option", "ccd_tolerance", Least, "1e-6"),
    ("option", "sleep_tolerance", Least, "1e-3"),
    ("option", "iterations", Most, "100"),
    ("option", "ls_iterations", Most, "50"),
    ("option", "noslip_iterations", Most, "0"),
    ("option", "ccd_iterations", Most, "35"),
    ("option", "sdf_iterations", Most, "10"),
    ("option", "sdf_initpoints", Most, "40"),
    ("option", "impratio", Never, "1"),
    ("option", "density", Never, "0"),
    ("option", "viscosity", Never, "0"),
    ("option", "o_margin", Never, "0"),
    ("option", "integrator", Never, "Euler"),
    ("option", "cone", Never, "pyramidal"),
    ("option", "jacobian", Never, "auto"),
    ("option", "solver", Never, "Newton"),
    ("option", "gravity", Never, "0 0 -9.81"),
    ("option", "wind", Never, "0 0 0"),
    ("option", "magnetic", Never, "0 -0.5 0"),
    ("option", "o_solref", Never, "0.02 1"),
    ("option", "o_solimp", Never, "0.9 0.95 0.001 0.5 2"),
    ("option", "o_friction", Never, "1 1 0.005 0.0001 0.0001"),
    ("size", "nuserdata", Most, "0"),
    ("size", "nkey", Most, "0"),
    ("size", "nuser_body", Most, "-1"),
    ("size", "nuser_jnt", Most, "-1"),
    ("size", "nuser_geom", Most, "-1"),
    ("size", "nuser_site", Most, "-1"),
    ("size", "nuser_cam", Most, "-1"),
    ("size", "nuser_tendon", Most, "-1"),
    ("size", "nuser_actuator", Most, "-1"),
];

/// Flags that are off unless a model turns them on; the others are on.
const OFF: [&str; 8] = ["override", "energy", "fwdinv", "invdiscrete", "sleep", "diagexact", "ipc", "speculative"];

/// Applies the options of an attached model to the enclosing one.
pub(super) fn resolve(root: &mut Element, child: &Element, attach: &Element) -> Result<(), MjcfError> {
    let compilers = sections(root, "compiler").filter_map(|c| Some((c, c.attr("conflict")?)));
    let policy = match compilers.last() {
        Some((compiler, attr)) => keyword(compiler, attr, &POLICIES)?,
        None => Policy::Warning,
    };
    if policy == Policy::Warning {
        return Ok(());
    }
    for (section, name, merge, default) in ATTRIBUTES {
        let Some(theirs) = last(child, section, name) else { continue };
        let own = last(root, section, name);
        if equal(own.map_or(default, |own| &own.value), &theirs.value, default) {
            continue;
        }
        let value = match (own, policy, merge) {
            (None, Policy::Merge, _) => theirs.value.clone(),
            (None, ..) => continue,
            (Some(own), Policy::Merge, Least | Most) => {
                let theirs_is_less = number(&theirs.value) < number(&own.value);
                if theirs_is_less != (merge == Least) {
                    continue;
                }
                theirs.value.clone()
            }
            (Some(own), ..) => return Err(conflict(attach, own, theirs)),
        };
        let i = last_section(root, section);
        set(&mut root.children[i], name, value.into());
    }
    flags(root, child, attach, policy)
}

fn flags(root: &mut Element, child: &Element, attach: &Element, policy: Policy) -> Result<(), MjcfError> {
    for theirs in entries(child, "option").flat_map(|flag| &flag.attrs) {
        let own = entries(root, "option").filter_map(|flag| flag.attr(&theirs.name)).last();
        match policy {
            Policy::Error => {
                if let Some(own) = own.filter(|own| own.value != theirs.value) {
                    return Err(conflict(attach, own, theirs));
                }
            }
            // a flag that is set is one that is not at its default
            _ if (theirs.value == "enable") == OFF.contains(&theirs.name.as_str()) => {
                let i = last_section(root, "option");
                let mut flag = Draft::new("flag").placed(&root.children[i].place);
                set(&mut flag, &theirs.name, theirs.value.as_str().into());
                root.children[i].children.push(flag);
            }
            _ => {}
        }
    }
    Ok(())
}

/// The attribute that counts among all sections of a name.
fn last<'e>(root: &'e Element, section: &str, name: &str) -> Option<&'e Attr> {
    root.children.iter().rev().filter(|s| s.name == section).find_map(|s| s.attr(name))
}

/// Whether two lists are the same. A short one goes on as the default.
fn equal(a: &str, b: &str, default: &str) -> bool {
    let words = |text: &str| -> Vec<String> {
        let given = text.split_ascii_whitespace();
        let count = given.clone().count();
        given.chain(default.split_ascii_whitespace().skip(count)).map(str::to_owned).collect()
    };
    let (a, b) = (words(a), words(b));
    a.len() == b.len()
        && a.iter().zip(&b).all(|(a, b)| a == b || matches!((number(a), number(b)), (Some(a), Some(b)) if a == b))
}

fn number(text: &str) -> Option<f64> {
    text.trim_ascii().parse().ok()
}

fn conflict(attach: &Element, own: &Attr, theirs: &Attr) -> MjcfError {
    let (name, own_value, value) = (&own.name, shorten(&own.value), shorten(&theirs.value));
    let place = format!("{}:{}", theirs.place.file, theirs.place.line);
    attach.invalid(format!(
        "'{name}' is '{own_value}' in line {} and '{value}' in the attached model ({place}); expected one value, or \
         conflict=\"warning\" to keep the first",
        own.place.line
    ))
}

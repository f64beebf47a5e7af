//! Models that can be edited before they are compiled: the counterpart of MuJoCo's `mjSpec`.
//!
//! ```
//! use marathon_physics::spec::{Actuator, Body, Geom, Joint, Kind, ModelSpec};
//!
//! let text = r#"<mujoco>
//!   <worldbody>
//!     <geom name="floor" type="plane" size="0 0 1"/>
//!     <body name="torso" pos="0 0 1"><freejoint/><geom size="0.1"/></body>
//!   </worldbody>
//! </mujoco>"#;
//! let mut spec = ModelSpec::from_xml_str(text, "ball")?;
//! spec.add_to("torso", Body::new("arm").pos([0.1, 0.0, 0.0]))?;
//! spec.add_to("arm", Joint::hinge([0.0, 1.0, 0.0]).name("shoulder").range([-90.0, 90.0]))?;
//! spec.add_to("arm", Geom::capsule([0.0; 3], [0.3, 0.0, 0.0], 0.03).mass(0.5))?;
//! spec.add(Actuator::motor("shoulder").joint("shoulder").gear(10.0))?;
//! spec.get_mut(Kind::Geom, "floor")?.set("friction", 0.6)?;
//! let model = spec.compile()?;
//! assert_eq!((model.nv, model.nu), (7, 1));
//!
//! // what refers to a removed element goes with it
//! assert_eq!(spec.remove(Kind::Body, "arm")?, [r#"<motor name="shoulder">"#]);
//! assert_eq!(spec.compile()?.nu, 0);
//! # Ok::<(), marathon_physics::mjcf::MjcfError>(())
//! ```
//!
//! * Elements are found by [`Kind`] and name. A wrong name is an error with the nearest one that there is.
//! * Default classes work as in a file: an added geom has the defaults of its class, or of the `childclass` of its body.
//! * Names of attributes are checked at once, their values by [`ModelSpec::compile`], which also keeps to the
//!   [budget](crate::budget).
//! * Keyframes keep their meaning: the numbers of a joint, mocap body or actuator come and go with it.
//! * `<replicate>` and `<attach>` are expanded when the model is read: the copies are in `<frame>` elements.
//! * [`ModelSpec::to_xml`] writes the model as MJCF. It compiles to the same bits.

mod attach;
mod body_parts;
mod element;
mod expand;
mod keyframes;
mod kind;
mod library;
mod model_parts;
mod obstacles;
mod part;
mod portable;
mod references;
mod replicate;
mod value;
mod walk;
mod write;

pub use body_parts::{Body, Geom, Joint, Site};
pub use element::{ElementMut, ElementRef};
pub use kind::Kind;
pub use model_parts::{Actuator, ContactExclude, Equality, HField, Keyframe, Mesh, Sensor, Tendon};
pub use part::{BodyPart, ModelPart, Part};
pub use value::AttrValue;

use super::document::{self, Element, MAX_DEPTH, Place};
use super::error::{MjcfError, MjcfErrorKind, shorten};
use super::file::{self, ReadFile};
use super::room::Room;
use super::{assemble, schema};
use crate::hint::nearest;
use crate::model::Model;
use keyframes::Share;
use kind::WORLD;
use library::{Library, keys};
use references::Gone;
use std::collections::BTreeSet;
use std::path::{Path as FilePath, PathBuf};
use walk::Path;

/// An MJCF model that can be edited, then compiled to a [`Model`].
#[derive(Clone, Debug)]
pub struct ModelSpec {
    root: Element,
    /// Folder of the model's file, where other files are looked up.
    folder: Option<PathBuf>,
}

impl ModelSpec {
    /// A model with an empty world.
    pub fn new(name: &str) -> ModelSpec {
        let place = Place { file: name.into(), line: 0 };
        let root = part::Draft::new("mujoco").with("model", name).placed(&place);
        ModelSpec { root, folder: None }.with_world()
    }

    /// Reads a model file. Includes are looked up as [`Model::from_xml_file`] does, and become part of the model.
    ///
    /// # Errors
    /// If the file or an included one cannot be read, is not well-formed XML, or asks for more than the
    /// [budget](crate::budget) allows.
    pub fn from_xml_file(path: impl AsRef<FilePath>) -> Result<ModelSpec, MjcfError> {
        let path = path.as_ref();
        let shown = path.display().to_string();
        let text = file::read(path).map_err(|e| e.reason).and_then(super::utf8).map_err(|reason| MjcfError {
            file: shown.clone(),
            line: 0,
            kind: MjcfErrorKind::Read(reason),
        })?;
        let folder = path.parent().map(FilePath::to_owned).unwrap_or_default();
        let spec =
            Self::from_xml_str_with(&text, &shown, &|path| file::read(&folder.join(path)).map_err(|e| e.reason))?;
        Ok(ModelSpec { folder: Some(folder), ..spec })
    }

    /// Reads a model given as text, without other files. `name` stands for the file in messages.
    ///
    /// # Errors
    /// If the text is not well-formed XML, or includes a file.
    pub fn from_xml_str(xml: &str, name: &str) -> Result<ModelSpec, MjcfError> {
        Self::from_xml_str_with(xml, name, &no_files)
    }

    /// Reads a model given as text. `resolve` returns the content of an included file, given its path relative to the
    /// model, or why there is none.
    ///
    /// # Errors
    /// If the text or an included file is not well-formed XML.
    pub fn from_xml_str_with(
        xml: &str,
        name: &str,
        resolve: &dyn Fn(&str) -> Result<Vec<u8>, String>,
    ) -> Result<ModelSpec, MjcfError> {
        let room = Room::default();
        let library = Library::new(resolve, expand::expand, &room);
        let mut root = document::parse(xml, name, "", &|file| super::utf8(resolve(file)?), &room)?;
        let keys = expand::expand(&mut root, "", &library)?;
        keys::write(&mut root, &keys, &room)?;
        Ok(ModelSpec { root, folder: None }.with_world())
    }

    /// Compiles the model as it is now. Mesh and height field files are read from the folder of the model's file.
    ///
    /// # Errors
    /// If the model is not a valid, supported one, or asks for more than the [budget](crate::budget) allows.
    pub fn compile(&self) -> Result<Model, MjcfError> {
        match &self.folder {
            Some(folder) => self.compile_from(&|path| file::read(&folder.join(path))),
            None => self.compile_with(&no_files),
        }
    }

    /// The same. `resolve` returns the content of a mesh or height field file, given its path relative to the model.
    ///
    /// # Errors
    /// The same.
    pub fn compile_with(&self, resolve: &dyn Fn(&str) -> Result<Vec<u8>, String>) -> Result<Model, MjcfError> {
        self.compile_from(&|path| file::resolved(resolve(path)))
    }

    fn compile_from(&self, read: &ReadFile) -> Result<Model, MjcfError> {
        let room = Room::default();
        room.take_document(&self.root)?;
        assemble::compile(&self.root, read, &room)
    }

    /// The model as MJCF, with its includes and attached parts and without comments. It names mesh and height field files as the model does,
    /// relative to the model's folder. Bodies attached from a model whose compiler gives masses in another way have the attribute
    /// `masses`, which readers refuse: MJCF cannot say this in one file.
    pub fn to_xml(&self) -> String {
        write::text(&portable::portable(&self.root))
    }

    /// All elements of a kind, in the order of the file. The world is not among the bodies.
    pub fn iter(&self, kind: Kind) -> impl Iterator<Item = ElementRef<'_>> {
        let mut found = Vec::new();
        walk::search(&self.root, |of, element, _| {
            found.extend((of == kind).then_some(ElementRef(element)));
            None::<()>
        });
        found.into_iter()
    }

    /// The element of a kind and a name. The body `world` is the world.
    ///
    /// # Errors
    /// If there is none. The error has the nearest name.
    pub fn get(&self, kind: Kind, name: &str) -> Result<ElementRef<'_>, MjcfError> {
        Ok(ElementRef(walk::at(&self.root, &self.path(kind, name)?)))
    }

    /// The same, to change it.
    ///
    /// # Errors
    /// The same.
    pub fn get_mut(&mut self, kind: Kind, name: &str) -> Result<ElementMut<'_>, MjcfError> {
        let path = self.path(kind, name)?;
        Ok(ElementMut { spec: self, path, kind: Some(kind) })
    }

    /// The first element of a kind for which `test` holds, to change it; for elements without a name.
    pub fn find_mut(&mut self, kind: Kind, test: impl Fn(ElementRef) -> bool) -> Option<ElementMut<'_>> {
        let path = walk::search(&self.root, |of, element, path| {
            (of == kind && test(ElementRef(element))).then(|| path.to_vec())
        })?;
        Some(ElementMut { spec: self, path, kind: Some(kind) })
    }

    /// Gives every element of a kind without a name one that no other has: `noun` and a number.
    pub fn name_all(&mut self, kind: Kind, noun: &str) {
        let taken: BTreeSet<String> = walk::names(&self.root, kind).into_iter().map(str::to_owned).collect();
        let mut unnamed = Vec::new();
        walk::search(&self.root, |of, element, path| {
            unnamed.extend((of == kind && kind.name(element).is_none()).then(|| path.to_vec()));
            None::<()>
        });
        let free = (0..).map(|number| format!("{noun} {number}")).filter(|name| !taken.contains(name));
        for (path, name) in unnamed.iter().zip(free) {
            part::set(walk::at_mut(&mut self.root, path), "name", name.into());
        }
    }

    /// A section without names, such as `option` or `compiler`, to change it. The model gets one if it has none.
    ///
    /// # Errors
    /// If MJCF has no such section.
    pub fn section_mut(&mut self, section: &str) -> Result<ElementMut<'_>, MjcfError> {
        if !schema::section_names().any(|name| name == section) {
            return Err(not_found(&self.root, "section", section, schema::section_names()));
        }
        let path = vec![self.section(section)];
        Ok(ElementMut { spec: self, path, kind: None })
    }

    /// The defaults that a class sets for an element such as `geom`, to change them. The outermost class is `main`.
    ///
    /// # Errors
    /// If there is no such class, or if it sets nothing for this element.
    pub fn default_mut(&mut self, class: &str, element: &str) -> Result<ElementMut<'_>, MjcfError> {
        let mut classes = Vec::new();
        for (i, section) in self.root.children.iter().enumerate().filter(|(_, section)| section.name == "default") {
            default_classes(section, &mut vec![i], &mut classes);
        }
        if !classes.iter().any(|(name, _)| *name == class) {
            return Err(not_found(&self.root, "default class", class, classes.iter().map(|(name, _)| *name)));
        }
        let paths = || classes.iter().filter(|(name, _)| *name == class).map(|(_, path)| path);
        let children = |path: &Path| walk::at(&self.root, path).children.iter().enumerate();
        let found = paths().find_map(|path| {
            children(path).find(|(_, child)| child.name == element).map(|(i, _)| [&path[..], &[i]].concat())
        });
        match found {
            Some(path) => Ok(ElementMut { spec: self, path, kind: None }),
            None => {
                let known = paths().flat_map(children).map(|(_, child)| child.name.as_str());
                let kind = format!("default of class '{}' for", shorten(class));
                Err(not_found(&self.root, &kind, element, known.filter(|name| *name != "default")))
            }
        }
    }

    /// Adds a part behind all others of its section: a height field, mesh, tendon, constraint, actuator, sensor or keyframe.
    ///
    /// # Errors
    /// If its name is taken, or it has an attribute that MJCF does not have.
    pub fn add(&mut self, part: impl ModelPart) -> Result<&mut Self, MjcfError> {
        self.add_part(part, |spec, kind| {
            let section = spec.section(kind.section());
            Ok(vec![section, spec.root.children[section].children.len()])
        })
    }

    /// Adds a body, joint, geom or site to a body, behind all others in it. The body `world` is the world.
    ///
    /// # Errors
    /// If there is no such body, the part's name is taken, or it has an attribute that MJCF does not have.
    pub fn add_to(&mut self, body: &str, part: impl BodyPart) -> Result<&mut Self, MjcfError> {
        self.add_part(part, |spec, _| {
            let parent = spec.path(Kind::Body, body)?;
            let last = walk::at(&spec.root, &parent).children.len();
            Ok([&parent[..], &[last]].concat())
        })
    }

    /// The same, but before all others in the body.
    ///
    /// # Errors
    /// The same.
    pub fn add_first_to(&mut self, body: &str, part: impl BodyPart) -> Result<&mut Self, MjcfError> {
        self.add_part(part, |spec, _| Ok([&spec.path(Kind::Body, body)?[..], &[0]].concat()))
    }

    /// Puts a part in the place of one of its kind, and removes that one with all that it holds. The new part takes over the name
    /// unless it has its own. References to names that are gone are removed and returned as by [`ModelSpec::remove`].
    ///
    /// # Errors
    /// If there is none of this name, the part's own name is taken, or it has an attribute that MJCF does not have.
    pub fn replace<P: Part>(&mut self, name: &str, part: P) -> Result<Vec<String>, MjcfError> {
        let path = self.replaceable(P::KIND, name)?;
        let old = walk::at(&self.root, &path).clone();
        let mut new = part.into_draft().placed(&old.place);
        if P::KIND.name(&new).is_none() {
            part::set(&mut new, "name", name.into());
        }
        let taken = P::KIND.name(&new).filter(|new| *new != name);
        taken.map_or(Ok(()), |taken| self.check_free(P::KIND, taken, &new))?;
        let mut gone = references::names_within(&self.root, &path);
        self.change_checked(&path, true, |element| *element = new)?;
        for name in references::names_within(&self.root, &path) {
            gone.remove(&name);
        }
        self.remove_references(gone)
    }

    /// Removes an element with all that it holds, and everything that refers to any of it. These can be actuators, sensors,
    /// tendons, constraints, contact pairs and excludes, cameras, lights and geoms. Returns their start tags, such as
    /// `<motor name="shoulder">`.
    ///
    /// # Errors
    /// If there is no such element, or it is the world.
    pub fn remove(&mut self, kind: Kind, name: &str) -> Result<Vec<String>, MjcfError> {
        let path = self.replaceable(kind, name)?;
        let gone = references::names_within(&self.root, &path);
        self.cut(&path)?;
        self.remove_references(gone)
    }

    fn with_world(mut self) -> Self {
        self.section("worldbody");
        self
    }

    /// Index of the last section of a name. The model gets one if it has none.
    fn section(&mut self, name: &str) -> usize {
        last_section(&mut self.root, name)
    }

    /// The way to the element of a kind and a name.
    fn path(&self, kind: Kind, name: &str) -> Result<Path, MjcfError> {
        if kind == Kind::Body && name == WORLD {
            let world = self.root.children.iter().position(|section| section.name == "worldbody");
            return Ok(vec![world.expect("every model has a world")]);
        }
        walk::named(&self.root, kind, name).ok_or_else(|| {
            let world = Some(WORLD).filter(|_| kind == Kind::Body);
            let known = walk::names(&self.root, kind).into_iter().chain(world);
            not_found(&self.root, kind.noun(), name, known)
        })
    }

    /// The same for an element that may go.
    fn replaceable(&self, kind: Kind, name: &str) -> Result<Path, MjcfError> {
        match self.path(kind, name)? {
            world if world.len() == 1 => Err(self.root.children[world[0]].invalid("the world cannot be removed")),
            path => Ok(path),
        }
    }

    /// Checks that no element of a kind has a name yet.
    fn check_free(&self, kind: Kind, name: &str, element: &Element) -> Result<(), MjcfError> {
        let world = kind == Kind::Body && name == WORLD;
        if name.is_empty() || (!world && walk::named(&self.root, kind, name).is_none()) {
            return Ok(());
        }
        Err(element.invalid(format!("there is already a {} '{}'", kind.noun(), shorten(name))))
    }

    fn add_part<P: Part>(
        &mut self,
        part: P,
        place: impl FnOnce(&mut Self, Kind) -> Result<Path, MjcfError>,
    ) -> Result<&mut Self, MjcfError> {
        let at = Place { line: 0, ..self.root.place.clone() };
        let element = part.into_draft().placed(&at);
        if let Some(name) = P::KIND.name(&element) {
            self.check_free(P::KIND, name, &element)?;
        }
        let sections = self.root.children.len();
        let path = place(self, P::KIND)?;
        if path.len() >= MAX_DEPTH {
            return Err(element.invalid(format!("elements are nested more than {MAX_DEPTH} deep")));
        }
        let Some((index, parent)) = path.split_last() else { return Ok(self) };
        walk::at_mut(&mut self.root, parent).children.insert(*index, element);
        let added = check(&self.root, &path, true).and_then(|()| Share::of(&self.root, &path));
        match added {
            Ok(share) => keyframes::replace(&mut self.root, &share.emptied(), &share),
            Err(error) => {
                walk::at_mut(&mut self.root, parent).children.remove(*index);
                self.root.children.truncate(sections);
                return Err(error);
            }
        }
        Ok(self)
    }

    /// Changes the attributes of an element, unless MJCF does not have them.
    fn change(&mut self, path: &[usize], change: impl FnOnce(&mut Element)) -> Result<(), MjcfError> {
        self.change_checked(path, false, change)
    }

    /// Changes an element. `inside`: what it contains is checked, too.
    fn change_checked(
        &mut self,
        path: &[usize],
        inside: bool,
        change: impl FnOnce(&mut Element),
    ) -> Result<(), MjcfError> {
        let before = Share::of(&self.root, path)?;
        let old = walk::at(&self.root, path).clone();
        change(walk::at_mut(&mut self.root, path));
        match check(&self.root, path, inside).and_then(|()| Share::of(&self.root, path)) {
            Ok(after) => keyframes::replace(&mut self.root, &before, &after),
            Err(error) => {
                *walk::at_mut(&mut self.root, path) = old;
                return Err(error);
            }
        }
        Ok(())
    }

    /// Removes the element at a path.
    fn cut(&mut self, path: &[usize]) -> Result<(), MjcfError> {
        let share = Share::of(&self.root, path)?;
        if let Some((index, parent)) = path.split_last() {
            walk::at_mut(&mut self.root, parent).children.remove(*index);
            keyframes::replace(&mut self.root, &share, &share.emptied());
        }
        Ok(())
    }

    /// Removes what refers to names that are gone, and what refers to that.
    fn remove_references(&mut self, mut gone: Gone) -> Result<Vec<String>, MjcfError> {
        let mut labels = Vec::new();
        while let Some(path) = references::first_to(&self.root, &gone) {
            labels.push(walk::at(&self.root, &path).label());
            gone.extend(references::names_within(&self.root, &path));
            self.cut(&path)?;
        }
        labels.extend(references::leave_tuples(&mut self.root, &gone));
        Ok(labels)
    }
}

/// Index of the last section of a name, which must not be that of an attached model. The model gets one if it has none.
fn last_section(root: &mut Element, name: &str) -> usize {
    let own = |section: &Element| section.name == name && section.settings.is_none();
    root.children.iter().rposition(own).unwrap_or_else(|| {
        root.children.push(part::Draft::new(name).placed(&root.place));
        root.children.len() - 1
    })
}

fn no_files(_: &str) -> Result<Vec<u8>, String> {
    Err("a model given as text has no other files".to_owned())
}

/// Classes in a `<default>` element, with the ways to them.
fn default_classes<'e>(element: &'e Element, path: &mut Path, out: &mut Vec<(&'e str, Path)>) {
    out.push((element.text("class").filter(|class| !class.is_empty()).unwrap_or("main"), path.clone()));
    for (i, inner) in element.children.iter().enumerate().filter(|(_, inner)| inner.name == "default") {
        path.push(i);
        default_classes(inner, path, out);
        path.pop();
    }
}

/// Checks the names of an element's attributes, and that its values can be written.
fn check(root: &Element, path: &[usize], inside: bool) -> Result<(), MjcfError> {
    schema::check_at(root, path, inside)?;
    let element = walk::at(root, path);
    match element.attrs.iter().find(|attr| attr.value.chars().any(|c| c.is_control() && !"\t\n\r".contains(c))) {
        Some(attr) => Err(element.bad_value(attr, "a text without control characters")),
        None => Ok(()),
    }
}

/// An error about a name that is not there, with the nearest one that is.
fn not_found<'n>(element: &Element, kind: &str, found: &str, known: impl IntoIterator<Item = &'n str>) -> MjcfError {
    let nearest = nearest(found, known).map(Into::into);
    let kind = MjcfErrorKind::NotFound { kind: kind.to_owned(), found: shorten(found), nearest };
    // the model as a whole lacks it
    Place { line: 0, ..element.place.clone() }.error(kind)
}

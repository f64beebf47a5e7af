//! Which file defines a name: follows `use` and `pub use` from module to module.

use crate::sources::{Sources, is_test};
use std::collections::{BTreeMap, BTreeSet};

/// Longest chain of re-exports that is followed.
const LONGEST: usize = 16;

/// The names that the modules of a crate offer.
pub struct Names {
    modules: BTreeMap<Vec<String>, Module>,
    /// Exported macros, which belong to the root, and the files that define them.
    macros: BTreeMap<String, usize>,
}

/// A module: a file, or `mod name { .. }` in one.
#[derive(Default)]
struct Module {
    /// Index of its file.
    file: usize,
    /// Items that it defines.
    items: BTreeSet<String>,
    /// Names that a `use` brings in.
    uses: BTreeMap<String, Use>,
    /// Modules of which all names are brought in.
    globs: Vec<Vec<String>>,
}

struct Use {
    path: Vec<String>,
    /// Visible outside the module.
    public: bool,
}

/// Kind of item that a path names.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// A module.
    Module,
    /// Any other item.
    Item,
}

enum Found {
    Module(Vec<String>),
    /// Defined in this file.
    Item(usize),
}

impl Names {
    /// Collects the names of all modules.
    pub fn of(sources: &Sources) -> Names {
        let mut names = Names { modules: BTreeMap::new(), macros: BTreeMap::new() };
        // a library before a program, if a crate is both
        let is_program = |module: &[String], path: &std::path::Path| module.is_empty() && path.ends_with("main.rs");
        let has_library = sources.files.iter().any(|f| f.path.as_os_str() == "lib.rs");
        for (i, file) in sources.files.iter().enumerate() {
            if !(has_library && is_program(&file.module, &file.path)) {
                names.add(i, &file.module, &file.syntax.items);
            }
        }
        names
    }

    fn add(&mut self, file: usize, path: &[String], items: &[syn::Item]) {
        let mut module = Module { file, ..Module::default() };
        for item in items {
            match item {
                syn::Item::Use(item) => {
                    let public = is_public(&item.vis);
                    leaves(&item.tree, &mut Vec::new(), &mut |path, name| match name {
                        Some(name) => drop(module.uses.insert(name, Use { path, public })),
                        None => module.globs.push(path),
                    });
                }
                syn::Item::Mod(syn::ItemMod { content: Some((_, items)), ident, attrs, .. }) if !is_test(attrs) => {
                    self.add(file, &[path, &[ident.to_string()]].concat(), items);
                }
                _ => {
                    if let syn::Item::Macro(item) = item
                        && item.attrs.iter().any(|a| a.path().is_ident("macro_export"))
                    {
                        self.macros.extend(item.ident.as_ref().map(|name| (name.to_string(), file)));
                    }
                    module.items.extend(defined(item));
                }
            }
        }
        self.modules.insert(path.to_vec(), module);
    }

    /// Whether a module makes a name visible that another module defines.
    pub fn re_exports(&self, module: &[String], name: &str) -> bool {
        self.modules.get(module).is_some_and(|m| m.uses.get(name).is_some_and(|u| u.public))
    }

    /// The file that defines what `path` names in a module; none if it is of another crate, or local to a function.
    pub fn file(&self, module: &[String], path: &[String], kind: Kind) -> Option<usize> {
        match self.find(module, path, kind, LONGEST)? {
            Found::Module(module) => self.modules.get(&module).map(|m| m.file),
            Found::Item(file) => Some(file),
        }
    }

    fn find(&self, module: &[String], path: &[String], kind: Kind, steps: usize) -> Option<Found> {
        let (mut module, mut rest) = (module.to_vec(), path);
        match path.first()?.as_str() {
            "crate" | "$crate" => {
                module.clear();
                rest = &rest[1..];
            }
            "self" | "super" => {
                rest = &rest[usize::from(path[0] == "self")..];
                while rest.first().is_some_and(|name| name == "super") {
                    module.pop();
                    rest = &rest[1..];
                }
            }
            _ => return self.look(module, rest, kind, steps),
        }
        // an item that a macro defines has no name here
        let unknown = (!module.is_empty()).then(|| Found::Module(module.clone()));
        self.look(module, rest, kind, steps).or(unknown)
    }

    /// Looks names up in a module, from left to right.
    fn look(&self, module: Vec<String>, path: &[String], kind: Kind, steps: usize) -> Option<Found> {
        let Some((name, rest)) = path.split_first() else { return Some(Found::Module(module)) };
        let here = self.modules.get(&module)?;
        let steps = steps.checked_sub(1)?;
        let child = [&module[..], std::slice::from_ref(name)].concat();
        let kind_here = if rest.is_empty() { kind } else { Kind::Module };
        let as_module = self.modules.contains_key(&child);
        if as_module && kind_here == Kind::Module {
            // an item that a macro defines has no name here
            return self.look(child.clone(), rest, kind, steps).or(Some(Found::Module(child)));
        }
        if here.items.contains(name) {
            return Some(Found::Item(here.file));
        }
        if let Some(import) = here.uses.get(name) {
            return match self.find(&module, &import.path, kind_here, steps)? {
                Found::Module(module) => self.look(module, rest, kind, steps),
                item => Some(item),
            };
        }
        if as_module {
            return Some(Found::Module(child));
        }
        if module.is_empty()
            && let Some(file) = self.macros.get(name)
        {
            return Some(Found::Item(*file));
        }
        here.globs.iter().find_map(|glob| match self.find(&module, glob, Kind::Module, steps)? {
            Found::Module(other) if other != module => self.look(other, path, kind, steps),
            _ => None,
        })
    }
}

/// Whether an item is visible outside its module.
pub fn is_public(visibility: &syn::Visibility) -> bool {
    !matches!(visibility, syn::Visibility::Inherited)
}

/// Whole paths of a `use` with the name that each is bound to; none for `*`.
pub fn leaves(tree: &syn::UseTree, way: &mut Vec<String>, found: &mut impl FnMut(Vec<String>, Option<String>)) {
    // `a::b::self` is `a::b`
    let whole = |way: &[String], name: &str| match name {
        "self" if !way.is_empty() => way.to_vec(),
        _ => [way, &[name.to_string()]].concat(),
    };
    match tree {
        syn::UseTree::Path(path) => {
            way.push(path.ident.to_string());
            leaves(&path.tree, way, found);
            way.pop();
        }
        syn::UseTree::Name(name) => {
            let path = whole(way, &name.ident.to_string());
            let name = path.last().cloned();
            found(path, name);
        }
        syn::UseTree::Rename(name) => found(whole(way, &name.ident.to_string()), Some(name.rename.to_string())),
        syn::UseTree::Glob(_) => found(way.clone(), None),
        syn::UseTree::Group(group) => group.items.iter().for_each(|tree| leaves(tree, way, found)),
    }
}

/// The name that an item gives to its module.
fn defined(item: &syn::Item) -> Option<String> {
    Some(match item {
        syn::Item::Const(item) => item.ident.to_string(),
        syn::Item::Enum(item) => item.ident.to_string(),
        syn::Item::Fn(item) => item.sig.ident.to_string(),
        syn::Item::Macro(item) => item.ident.as_ref()?.to_string(),
        syn::Item::Static(item) => item.ident.to_string(),
        syn::Item::Struct(item) => item.ident.to_string(),
        syn::Item::Trait(item) => item.ident.to_string(),
        syn::Item::Type(item) => item.ident.to_string(),
        syn::Item::Union(item) => item.ident.to_string(),
        _ => return None,
    })
}

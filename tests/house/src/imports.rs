//! Imports from file to file: `use` lines, paths inside code and paths inside macro calls.

use crate::names::{Kind, Names, is_public};
use crate::sources::{Source, Sources, is_test};
use proc_macro2::{TokenStream, TokenTree};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use syn::visit::Visit;

/// A file names something that another file of the crate defines.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Import {
    /// The room that needs something.
    pub from: String,
    /// The room that has it.
    pub to: String,
    /// The source, below the crate's `src`.
    pub file: PathBuf,
    /// Where the path begins.
    pub line: usize,
    /// The source that defines what is imported, below the crate's `src`.
    pub target: PathBuf,
}

impl Import {
    /// Whether the import leads from one room to another. The root of a crate is above all rooms and may import any.
    pub fn leaves_room(&self) -> bool {
        self.from != self.to && self.from != "lib" && self.from != "main"
    }

    /// Whether the import leads from the file of a module to a file below that module.
    pub fn leads_inside(&self) -> bool {
        owns(&self.file, &self.target)
    }

    /// Whether the import leads from a file to the file of a module above it.
    pub fn leads_to_own_module(&self) -> bool {
        owns(&self.target, &self.file)
    }
}

/// Whether a file is that of a module which another file lies in.
fn owns(module: &Path, file: &Path) -> bool {
    let is_module = ["mod.rs", "lib.rs", "main.rs"].iter().any(|name| module.ends_with(name));
    is_module && module.parent().is_some_and(|folder| file.starts_with(folder))
}

/// Every import that leaves its file, once for each line.
pub fn imports(sources: &Sources) -> Vec<Import> {
    let names = Names::of(sources);
    let mut imports = BTreeSet::new();
    for source in &sources.files {
        let mut reader = Reader { names: &names, module: source.module.clone(), found: BTreeSet::new() };
        reader.visit_file(&source.syntax);
        for (target, line) in reader.found {
            let target: &Source = &sources.files[target];
            if target.path != source.path {
                let (from, to) = (source.room(), target.room());
                imports.insert(Import { from, to, file: source.path.clone(), line, target: target.path.clone() });
            }
        }
    }
    imports.into_iter().collect()
}

struct Reader<'n> {
    names: &'n Names,
    /// Where the reader is.
    module: Vec<String>,
    /// Files that define what is named, with lines.
    found: BTreeSet<(usize, usize)>,
}

/// The names of a path, with their lines.
type Segments = Vec<(String, usize)>;

impl Reader<'_> {
    fn find(&mut self, path: &Segments, kind: Kind) {
        let names: Vec<String> = path.iter().map(|(name, _)| name.clone()).collect();
        let line = path.get(1).or(path.first()).map_or(0, |(_, line)| *line);
        self.found.extend(self.names.file(&self.module, &names, kind).map(|file| (file, line)));
    }

    /// Takes in a path in code. A single name is defined here or brought in by a `use`, which is read where it stands,
    /// unless it only passes the name on.
    fn note(&mut self, path: &Segments) {
        let single = |name: &str| self.names.re_exports(&self.module, name);
        match &path[..] {
            [] => {}
            [(name, _)] if !single(name) => {}
            _ => self.find(path, Kind::Item),
        }
    }

    /// Takes in a `use`.
    fn note_tree(&mut self, tree: &syn::UseTree, public: bool, way: &mut Segments) {
        let name = |ident: &syn::Ident| (ident.to_string(), ident.span().start().line);
        match tree {
            syn::UseTree::Path(path) => {
                way.push(name(&path.ident));
                self.note_tree(&path.tree, public, way);
                way.pop();
            }
            syn::UseTree::Group(group) => group.items.iter().for_each(|tree| self.note_tree(tree, public, way)),
            syn::UseTree::Glob(_) => self.note_leaf(way, public),
            syn::UseTree::Name(syn::UseName { ident }) | syn::UseTree::Rename(syn::UseRename { ident, .. }) => {
                let itself = ident == "self" && !way.is_empty();
                way.extend((!itself).then(|| name(ident)));
                self.note_leaf(way, public);
                way.truncate(way.len() - usize::from(!itself));
            }
        }
    }

    fn note_leaf(&mut self, path: &Segments, public: bool) {
        // a folder's `mod.rs` passes on what its files define, and does not need it
        let below = path.first().is_some_and(|(name, _)| !matches!(name.as_str(), "crate" | "$crate" | "super"));
        if public && below {
            return;
        }
        self.find(path, Kind::Item);
        self.find(path, Kind::Module);
    }

    /// Paths in the arguments of a macro, which have no syntax of their own.
    fn note_tokens(&mut self, tokens: TokenStream) {
        let tokens: Vec<TokenTree> = tokens.into_iter().collect();
        let colons = |i: usize| {
            let colon = |i: usize| matches!(tokens.get(i), Some(TokenTree::Punct(p)) if p.as_char() == ':');
            colon(i) && colon(i + 1)
        };
        let mut i = 0;
        while i < tokens.len() {
            let mut names = Vec::new();
            while let Some(TokenTree::Ident(ident)) = tokens.get(i) {
                names.push((ident.to_string(), ident.span().start().line));
                i += 1;
                if !colons(i) {
                    break;
                }
                i += 2;
            }
            if names.len() > 1 {
                self.note(&names);
            }
            if let Some(TokenTree::Group(group)) = tokens.get(i) {
                self.note_tokens(group.stream());
            }
            i += usize::from(names.is_empty() || matches!(tokens.get(i), Some(TokenTree::Group(_))));
        }
    }
}

impl<'a> Visit<'a> for Reader<'_> {
    fn visit_item_use(&mut self, item: &'a syn::ItemUse) {
        self.note_tree(&item.tree, is_public(&item.vis), &mut Vec::new());
    }

    fn visit_item_mod(&mut self, item: &'a syn::ItemMod) {
        if is_test(&item.attrs) {
            return;
        }
        self.module.push(item.ident.to_string());
        syn::visit::visit_item_mod(self, item);
        self.module.pop();
    }

    fn visit_path(&mut self, path: &'a syn::Path) {
        let names: Vec<_> = path.segments.iter().map(|s| (s.ident.to_string(), s.ident.span().start().line)).collect();
        self.note(&names);
        syn::visit::visit_path(self, path);
    }

    fn visit_macro(&mut self, call: &'a syn::Macro) {
        self.visit_path(&call.path);
        self.note_tokens(call.tokens.clone());
    }
}

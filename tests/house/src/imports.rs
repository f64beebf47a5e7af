//! Imports from room to room: `use` lines, paths inside code and paths inside macro calls that begin with `crate` or `super`.

use crate::Error;
use proc_macro2::{TokenStream, TokenTree};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use syn::visit::Visit;

/// A room names something of another room.
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
}

/// The sources of a crate without its unit tests.
pub struct Sources {
    pub files: Vec<Source>,
}

/// One source.
pub struct Source {
    /// Below `src`.
    path: PathBuf,
    /// Names from the root of the crate; none for the root itself.
    pub module: Vec<String>,
    pub lines: usize,
    syntax: syn::File,
}

impl Sources {
    /// Reads the folder `src`.
    pub fn read(src: &Path) -> Result<Sources, Error> {
        let mut files = Vec::new();
        read_folder(src, src, &mut files)?;
        files.sort_by(|a, b| a.path.cmp(&b.path));
        Ok(Sources { files })
    }

    /// Every import that leaves its room, once for each line.
    pub fn imports(&self) -> Vec<Import> {
        let rooms: BTreeSet<&str> = self.files.iter().filter_map(|f| f.module.first().map(String::as_str)).collect();
        let doors = self.doors(&rooms);
        let mut imports = BTreeSet::new();
        for file in self.files.iter().filter(|f| !f.module.is_empty()) {
            for (first, line) in file.paths() {
                let to = match rooms.get(first.as_str()) {
                    Some(room) => room,
                    None => match doors.get(&first) {
                        Some(room) => room.as_str(),
                        None => continue,
                    },
                };
                if to != file.module[0] {
                    let (from, to) = (file.module[0].clone(), to.to_string());
                    imports.insert(Import { from, to, file: file.path.clone(), line });
                }
            }
        }
        imports.into_iter().collect()
    }

    /// What the root of the crate offers under a name of its own, and the room that it is from. What the root itself defines
    /// is in a room of the root's name.
    fn doors(&self, rooms: &BTreeSet<&str>) -> BTreeMap<String, String> {
        let mut doors = BTreeMap::new();
        for file in &self.files {
            for item in &file.syntax.items {
                // macros are exported to the root from wherever they are
                if let syn::Item::Macro(item) = item
                    && item.attrs.iter().any(|a| a.path().is_ident("macro_export"))
                    && let (Some(name), Some(room)) = (&item.ident, file.module.first())
                {
                    doors.insert(name.to_string(), room.clone());
                }
            }
        }
        for file in self.files.iter().filter(|f| f.module.is_empty()) {
            let root = file.path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
            for item in &file.syntax.items {
                if let syn::Item::Use(item) = item {
                    let mut found = Vec::new();
                    names(&item.tree, &mut Vec::new(), &mut found);
                    for (path, name) in found {
                        let path: Vec<_> = path.into_iter().filter(|s| s != "crate" && s != "self").collect();
                        if let Some(room) = path.first().filter(|first| rooms.contains(first.as_str())) {
                            doors.insert(name, room.clone());
                        }
                    }
                } else if let Some(name) = defined(item) {
                    doors.entry(name).or_insert_with(|| root.clone());
                }
            }
        }
        doors
    }
}

/// The name that an item gives to the root.
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
        _ => return None,
    })
}

/// Whole paths of a `use` with the name that each is bound to.
fn names(tree: &syn::UseTree, way: &mut Vec<String>, found: &mut Vec<(Vec<String>, String)>) {
    match tree {
        syn::UseTree::Path(path) => {
            way.push(path.ident.to_string());
            names(&path.tree, way, found);
            way.pop();
        }
        syn::UseTree::Name(name) => {
            found.push(([&way[..], &[name.ident.to_string()]].concat(), name.ident.to_string()))
        }
        syn::UseTree::Rename(name) => {
            found.push(([&way[..], &[name.ident.to_string()]].concat(), name.rename.to_string()))
        }
        syn::UseTree::Glob(_) => found.push((way.clone(), "*".into())),
        syn::UseTree::Group(group) => group.items.iter().for_each(|tree| names(tree, way, found)),
    }
}

fn read_folder(src: &Path, folder: &Path, files: &mut Vec<Source>) -> Result<(), Error> {
    let io = |path: &Path| {
        let path = path.to_path_buf();
        move |source| Error::Io { path, source }
    };
    for entry in std::fs::read_dir(folder).map_err(io(folder))? {
        let path = entry.map_err(io(folder))?.path();
        if path.file_stem().is_some_and(|stem| stem == "tests") {
            continue;
        }
        if path.is_dir() {
            read_folder(src, &path, files)?;
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            let text = std::fs::read_to_string(&path).map_err(io(&path))?;
            let syntax = syn::parse_file(&text).map_err(|e| Error::Syntax {
                path: path.clone(),
                line: e.span().start().line,
                message: e.to_string(),
            })?;
            let below = path.strip_prefix(src).expect("a file below the folder").to_path_buf();
            let mut module: Vec<String> =
                below.with_extension("").iter().map(|part| part.to_string_lossy().into_owned()).collect();
            let last = module.last().cloned().unwrap_or_default();
            // programs of a crate use it from outside
            if module[0] == "bin" {
                continue;
            }
            if last == "mod" || module.len() == 1 && (last == "lib" || last == "main") {
                module.pop();
            }
            files.push(Source { path: below, module, lines: text.lines().count(), syntax });
        }
    }
    Ok(())
}

impl Source {
    /// First names after the root of the crate of every path that leads there, with their lines.
    fn paths(&self) -> Vec<(String, usize)> {
        let mut reader = Reader { module: self.module.clone(), found: Vec::new() };
        reader.visit_file(&self.syntax);
        reader.found
    }
}

struct Reader {
    /// Where the reader is.
    module: Vec<String>,
    found: Vec<(String, usize)>,
}

impl Reader {
    /// Takes in a path by its names.
    fn note(&mut self, names: &[(String, usize)]) {
        let mut module = self.module.clone();
        let mut rest = names;
        match rest.first() {
            Some((name, _)) if name == "crate" || name == "$crate" => module.clear(),
            Some((name, _)) if name == "super" || name == "self" => {
                rest = &rest[usize::from(name == "self")..];
                while rest.first().is_some_and(|(name, _)| name == "super") {
                    module.pop();
                    rest = &rest[1..];
                }
                if let (true, Some((name, line))) = (module.is_empty(), rest.first()) {
                    self.found.push((name.clone(), *line));
                }
                return;
            }
            _ => return,
        }
        if let Some((name, line)) = rest.get(1) {
            self.found.push((name.clone(), *line));
        }
    }

    fn note_tree(&mut self, tree: &syn::UseTree, way: &mut Vec<(String, usize)>) {
        let name = |ident: &syn::Ident| (ident.to_string(), ident.span().start().line);
        match tree {
            syn::UseTree::Path(path) => {
                way.push(name(&path.ident));
                self.note_tree(&path.tree, way);
                way.pop();
            }
            syn::UseTree::Group(group) => group.items.iter().for_each(|tree| self.note_tree(tree, way)),
            syn::UseTree::Glob(_) => self.note(way),
            syn::UseTree::Name(syn::UseName { ident }) | syn::UseTree::Rename(syn::UseRename { ident, .. }) => {
                way.push(name(ident));
                self.note(way);
                way.pop();
            }
        }
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
            self.note(&names);
            if let Some(TokenTree::Group(group)) = tokens.get(i) {
                self.note_tokens(group.stream());
            }
            i += usize::from(names.is_empty() || matches!(tokens.get(i), Some(TokenTree::Group(_))));
        }
    }
}

impl<'a> Visit<'a> for Reader {
    fn visit_item_use(&mut self, item: &'a syn::ItemUse) {
        self.note_tree(&item.tree, &mut Vec::new());
    }

    fn visit_item_mod(&mut self, item: &'a syn::ItemMod) {
        let test = |a: &syn::Attribute| {
            a.path().is_ident("cfg") && a.parse_args::<syn::Path>().is_ok_and(|p| p.is_ident("test"))
        };
        if item.attrs.iter().any(test) {
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

//! Which modules of a crate import which: no two import each other, neither directly nor through others.
//!
//! A module imports another if it names something in it, by `use` or by a path; names that a module exports again are
//! followed to where they are defined. Tests are left out.
#![allow(clippy::unwrap_used, clippy::panic, clippy::indexing_slicing)]

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

use syn::visit::{self, Visit};
use syn::{Item, UseTree, Visibility};

/// The crates that are checked, and for each the modules whose files may name what their folder's `mod.rs` defines,
/// since they hold the methods of one structure of it. ARCHITECTURE.md says so too.
const CRATES: &[(&str, &[&str])] = &[("ir", &["passes::speculate"]), ("codegen", &["lower"])];

/// Crates of which only the modules of the root are compared: what is in one folder belongs together there. What the
/// root itself defines, all may name.
const CRATES_BY_FOLDER: &[&str] = &["runtime", "load", "record", "host"];

/// A module, by the names from the crate's root on.
type Module = Vec<String>;

/// What a module imports, as paths from the crate's root, and what it exports again by which names.
#[derive(Default)]
struct Names {
    own: Module,
    paths: Vec<Vec<String>>,
    exports: BTreeMap<String, Vec<String>>,
}

impl Names {
    /// A path from the crate's root; `None` for one that leads out of the crate, or to something local.
    fn absolute(&self, path: &[String]) -> Option<Vec<String>> {
        let mut place = match path.first()?.as_str() {
            "crate" => vec![],
            "self" | "super" => self.own.clone(),
            // A path in `mod.rs` may begin with the name of a file of its folder.
            _ => return Some([self.own.as_slice(), path].concat()),
        };
        for (number, name) in path.iter().enumerate() {
            match name.as_str() {
                "crate" | "self" if number == 0 => {}
                "super" => drop(place.pop()),
                name => place.push(name.to_owned()),
            }
        }
        Some(place)
    }

    fn add_use(&mut self, tree: &UseTree, prefix: &[String], is_export: bool) {
        let with = |name: &syn::Ident| [prefix, &[name.to_string()]].concat();
        match tree {
            UseTree::Path(path) => self.add_use(&path.tree, &with(&path.ident), is_export),
            UseTree::Group(group) => {
                group.items.iter().for_each(|tree| self.add_use(tree, prefix, is_export));
            }
            UseTree::Name(name) => self.add(&with(&name.ident), &name.ident, is_export),
            UseTree::Rename(name) => self.add(&with(&name.ident), &name.rename, is_export),
            UseTree::Glob(_) => self.paths.extend(self.absolute(prefix)),
        }
    }

    fn add(&mut self, path: &[String], by: &syn::Ident, is_export: bool) {
        let Some(path) = self.absolute(path) else { return };
        if is_export {
            self.exports.insert(by.to_string(), path.clone());
        }
        self.paths.push(path);
    }
}

impl<'ast> Visit<'ast> for Names {
    fn visit_item(&mut self, item: &'ast Item) {
        match item {
            // Tests may name anything.
            Item::Mod(module) if module.ident == "tests" => {}
            Item::Use(item) => {
                let is_export = !matches!(item.vis, Visibility::Inherited);
                self.add_use(&item.tree, &[], is_export);
            }
            item => visit::visit_item(self, item),
        }
    }

    /// For whom something is visible names nothing in that module.
    fn visit_vis_restricted(&mut self, _: &'ast syn::VisRestricted) {}

    fn visit_path(&mut self, path: &'ast syn::Path) {
        let names: Vec<String> = path.segments.iter().map(|part| part.ident.to_string()).collect();
        if names.len() > 1 {
            self.paths.extend(self.absolute(&names));
        }
        visit::visit_path(self, path);
    }
}

/// The modules of a crate, each with what it names.
fn modules(folder: &Path, own: &Module, found: &mut BTreeMap<Module, Names>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let stem = path.file_stem().unwrap().to_str().unwrap().to_owned();
        let mut module = own.clone();
        if path.is_dir() {
            module.push(stem);
            if module.last().is_some_and(|name| name != "tests") {
                modules(&path, &module, found);
            }
            continue;
        }
        match stem.as_str() {
            "tests" => continue,
            "lib" | "mod" => {}
            _ => module.push(stem),
        }
        let mut names = Names { own: module.clone(), ..Names::default() };
        names.visit_file(&syn::parse_file(&fs::read_to_string(&path).unwrap()).unwrap());
        found.insert(module, names);
    }
}

/// The module in which a path ends, when what is exported again is followed.
fn place(modules: &BTreeMap<Module, Names>, path: &[String]) -> Option<Module> {
    let mut path = path.to_vec();
    for _ in 0..8 {
        let length =
            (0..=path.len()).rev().find(|&length| modules.contains_key(&path[..length]))?;
        let (module, rest) = path.split_at(length);
        let export = rest.first().and_then(|name| modules[module].exports.get(name));
        match export {
            Some(to) if to != &path => path = [to.as_slice(), &rest[1..]].concat(),
            // Something of the crate's root is nothing local.
            _ if module.is_empty() && rest.is_empty() => return None,
            _ => return Some(module.to_vec()),
        }
    }
    None
}

/// For each module those that it imports.
fn imports(modules: &BTreeMap<Module, Names>) -> BTreeMap<&Module, BTreeSet<Module>> {
    let of = |(module, names): (_, &Names)| {
        let mut imported: BTreeSet<Module> =
            names.paths.iter().filter_map(|path| place(modules, path)).collect();
        imported.remove(module);
        (module, imported)
    };
    modules.iter().map(of).collect()
}

#[test]
fn no_modules_of_the_compiler_import_each_other() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    for &(name, upward) in CRATES {
        let mut found = BTreeMap::new();
        modules(&root.join(name).join("src"), &vec![], &mut found);
        let mut left = imports(&found);
        let (mut count, mut used) = (0, BTreeSet::new());
        for (module, imported) in &mut left {
            imported.retain(|to| {
                count += 1;
                let is_upward = module.starts_with(to) && upward.contains(&to.join("::").as_str());
                if is_upward {
                    used.insert(to.join("::"));
                }
                !is_upward
            });
        }
        // Else nothing would have been looked at.
        assert!(count > 40, "{name}: {count} imports");
        assert_eq!(used.len(), upward.len(), "{name}: of {upward:?} these are needed: {used:?}");
        let circle = circle(left);
        assert!(circle.is_empty(), "in {name} a circle is among these: {circle:#?}");
    }
}

#[test]
fn no_folders_of_the_runtime_import_each_other() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    for &name in CRATES_BY_FOLDER {
        let mut found = BTreeMap::new();
        modules(&root.join(name).join("src"), &vec![], &mut found);
        let mut folders: BTreeMap<Module, BTreeSet<Module>> = BTreeMap::new();
        for (module, imported) in imports(&found) {
            let Some(own) = module.first() else { continue };
            let others = imported.iter().filter_map(|to| to.first()).filter(|to| *to != own);
            folders.entry(vec![own.clone()]).or_default().extend(others.map(|to| vec![to.clone()]));
        }
        let count: usize = folders.values().map(BTreeSet::len).sum();
        assert!(count > 3, "{name}: {count} imports");
        let circle = circle(folders.iter().map(|(module, to)| (module, to.clone())).collect());
        assert!(circle.is_empty(), "in {name} a circle is among these: {circle:#?}");
    }
}

/// The modules among which there is a circle, with what they import of each other; none if there is no circle.
fn circle(mut left: BTreeMap<&Module, BTreeSet<Module>>) -> Vec<String> {
    // A module whose imports have all been taken away is in no circle.
    loop {
        let before = left.len();
        let names: BTreeSet<Module> = left.keys().map(|&module| module.clone()).collect();
        left.retain(|_, imported| imported.iter().any(|to| names.contains(to)));
        if left.len() == before {
            break;
        }
    }
    let of = |(module, to): (&&Module, &BTreeSet<Module>)| {
        let to: Vec<String> =
            to.iter().filter(|to| left.contains_key(to)).map(|to| to.join("::")).collect();
        format!("{} imports {}", module.join("::"), to.join(", "))
    };
    left.iter().map(of).collect()
}

/// What a host function does is said where it is declared (`abi/src/host.rs`).
#[test]
fn no_pass_and_no_code_generation_names_a_host_function() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    for folder in ["ir/src/passes", "codegen/src"] {
        let mut found = BTreeMap::new();
        modules(&root.join(folder), &vec![], &mut found);
        assert!(found.len() > 20, "{folder}: {} files", found.len());
        for (module, names) in found {
            let named = names.paths.iter().find(|path| path.iter().any(|name| name == "HostFn"));
            // The type alone is in signatures; a path goes on with one function's name.
            let one = named.filter(|path| path.last().is_some_and(|name| name != "HostFn"));
            assert_eq!(one, None, "{folder}, {}", module.join("::"));
        }
    }
}

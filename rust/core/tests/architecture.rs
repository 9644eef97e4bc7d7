//! The order of the parts, read from the imports: a part uses only parts before it, and no files form a circle.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// The parts in the order in which data flows; each uses only those before it.
const PARTS: [&str; 12] = [
    "error",
    "numerics",
    "linalg",
    "scene",
    "contact",
    "modes",
    "locus",
    "motion",
    "transient",
    "energy",
    "cycles",
    "study",
];

/// Most lines of each part, tests apart: what it had when this was last set, and five percent. Raising one is a decision that its
/// commit states.
const CEILINGS: [(&str, usize); 12] = [
    ("error", 760),
    ("numerics", 1610),
    ("linalg", 2010),
    ("scene", 9900),
    ("contact", 3934),
    ("modes", 2205),
    ("locus", 2630),
    ("motion", 13571),
    ("transient", 4250),
    ("energy", 703),
    ("cycles", 4477),
    ("study", 1130),
];

/// Most source files of one folder, its `mod.rs` among them.
const LARGEST_FOLDER: usize = 10;

fn sources(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("a folder of sources") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            sources(&path, found);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            found.push(path);
        }
    }
}

/// The module path of every file but `lib.rs` and `mod.rs`, with its text free of comments and of its own tests, which
/// may use any file.
fn modules(root: &Path) -> BTreeMap<String, String> {
    let mut files = Vec::new();
    sources(root, &mut files);
    files
        .iter()
        .filter(|path| !path.ends_with("mod.rs") && !path.ends_with("lib.rs"))
        .map(|path| {
            let relative = path.strip_prefix(root).expect("below the root").with_extension("");
            let name: Vec<_> = relative.iter().map(|part| part.to_string_lossy()).collect();
            let text = fs::read_to_string(path).expect("a readable file");
            let text = text.split("#[cfg(test)]\n").next().unwrap_or_default();
            let code: Vec<&str> =
                text.lines().map(|line| line.split("//").next().unwrap_or_default()).collect();
            (name.join("::"), code.join("\n"))
        })
        .collect()
}

/// Every path after `crate::` in a text, braces taken apart at their first level.
fn paths(code: &str) -> BTreeSet<String> {
    let mut found = BTreeSet::new();
    for (start, prefix) in code.match_indices("crate::") {
        let rest = &code[start + prefix.len()..];
        let end = rest
            .find(|c: char| !(c.is_alphanumeric() || c == '_' || c == ':'))
            .unwrap_or(rest.len());
        let path = rest[..end].trim_end_matches(':');
        if rest[end..].starts_with('{') {
            let names = &rest[end + 1..rest.find('}').unwrap_or(rest.len())];
            for name in names.split(',').map(str::trim).filter(|name| !name.is_empty()) {
                let separator = if path.is_empty() { "" } else { "::" };
                found.insert(format!("{path}{separator}{name}"));
            }
        } else {
            found.insert(path.to_owned());
        }
    }
    found
}

/// Which files a file imports.
fn imports(modules: &BTreeMap<String, String>) -> BTreeMap<&str, BTreeSet<&str>> {
    modules
        .iter()
        .map(|(name, code)| {
            let used = paths(code)
                .iter()
                .filter_map(|path| {
                    let file =
                        |known: &&String| path == *known || path.starts_with(&format!("{known}::"));
                    modules.keys().filter(file).max_by_key(|known| known.len())
                })
                .filter(|used| *used != name)
                .map(String::as_str)
                .collect();
            (name.as_str(), used)
        })
        .collect()
}

fn part(module: &str) -> usize {
    let name = module.split("::").next().unwrap_or_default();
    PARTS.iter().position(|part| *part == name).unwrap_or_else(|| panic!("{module}: no such part"))
}

/// The first circle of imports, as the files that it passes.
fn circle<'m>(imports: &BTreeMap<&'m str, BTreeSet<&'m str>>) -> Option<Vec<&'m str>> {
    fn visit<'m>(
        file: &'m str,
        imports: &BTreeMap<&'m str, BTreeSet<&'m str>>,
        way: &mut Vec<&'m str>,
        done: &mut BTreeSet<&'m str>,
    ) -> Option<Vec<&'m str>> {
        if let Some(first) = way.iter().position(|passed| *passed == file) {
            return Some(way[first..].to_vec());
        }
        if done.contains(file) {
            return None;
        }
        way.push(file);
        let found = imports[file].iter().find_map(|next| visit(next, imports, way, done));
        way.pop();
        done.insert(file);
        found
    }
    let mut done = BTreeSet::new();
    imports.keys().find_map(|file| visit(file, imports, &mut Vec::new(), &mut done))
}

fn core() -> BTreeMap<String, String> {
    modules(&Path::new(env!("CARGO_MANIFEST_DIR")).join("src"))
}

#[test]
fn a_part_uses_only_parts_before_it() {
    let modules = core();
    let upward: Vec<String> = imports(&modules)
        .iter()
        .flat_map(|(file, used)| used.iter().map(move |other| (*file, *other)))
        .filter(|(file, other)| part(other) > part(file))
        .map(|(file, other)| format!("{file} uses {other}"))
        .collect();
    assert!(upward.is_empty(), "{upward:#?}");
}

/// The fewest arrows (used, user) between parts that every import follows.
fn drawing<'m>(imports: &BTreeMap<&'m str, BTreeSet<&'m str>>) -> BTreeSet<(&'m str, &'m str)> {
    fn reaches(uses: &BTreeMap<&str, BTreeSet<&str>>, from: &str, to: &str) -> bool {
        uses.get(from).is_some_and(|used| used.iter().any(|&by| by == to || reaches(uses, by, to)))
    }
    let name = |module: &'m str| module.split("::").next().unwrap_or_default();
    let mut uses: BTreeMap<&str, BTreeSet<&str>> = BTreeMap::new();
    for (&file, used) in imports {
        let others = used.iter().map(|&other| name(other)).filter(|&other| other != name(file));
        uses.entry(name(file)).or_default().extend(others);
    }
    let mut arrows = BTreeSet::new();
    for (&part, used) in &uses {
        let is_direct = |other: &&str| !used.iter().any(|by| reaches(&uses, by, other));
        arrows.extend(used.iter().copied().filter(is_direct).map(|other| (other, part)));
    }
    arrows
}

#[test]
fn the_drawing_in_the_readme_is_that_of_the_imports() {
    let readme = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../README.md");
    let text = fs::read_to_string(readme).expect("a readable file");
    let drawn = text.split("```").find_map(|block| block.strip_prefix("mermaid\nflowchart LR\n"));
    let mut arrows = BTreeSet::new();
    for line in drawn.expect("a drawing of the core").lines() {
        let parts: Vec<&str> = line.trim().split(" --> ").collect();
        arrows.extend(parts.windows(2).map(|pair| (pair[0], pair[1])));
    }
    let modules = core();
    assert_eq!(arrows, drawing(&imports(&modules)));
    let drawn: BTreeSet<&str> = arrows.iter().flat_map(|&(a, b)| [a, b]).collect();
    assert_eq!(drawn, BTreeSet::from(PARTS));
}

/// The lines of a folder, without modules that are compiled for tests only.
fn lines(folder: &Path) -> usize {
    let text = |file: &str| fs::read_to_string(folder.join(file)).unwrap_or_default();
    let root = text("mod.rs");
    let tests = root.split("#[cfg(test)]\nmod ").skip(1).filter_map(|rest| rest.split(';').next());
    let tests: BTreeSet<&str> = tests.collect();
    let mut sum = 0;
    for entry in fs::read_dir(folder).expect("a folder of sources") {
        let path = entry.expect("an entry").path();
        let name = path.file_stem().expect("a name").to_string_lossy().into_owned();
        if tests.contains(name.as_str()) {
            continue;
        }
        sum += if path.is_dir() {
            lines(&path)
        } else {
            let text = fs::read_to_string(&path).expect("a readable file");
            text.split("#[cfg(test)]\nmod tests").next().unwrap_or_default().lines().count()
        };
    }
    sum
}

#[test]
fn no_part_grows_above_its_ceiling() {
    assert_eq!(CEILINGS.map(|(part, _)| part), PARTS);
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    for (part, most) in CEILINGS {
        let found = lines(&root.join(part));
        assert!(found <= most, "{part} has {found} lines, {most} are allowed");
        // A ceiling far above what is there holds nothing back.
        assert!(100 * most <= 108 * found, "{part} has {found} lines: lower its ceiling of {most}");
    }
}

/// In the core, and in the binding beside it.
#[test]
fn no_files_form_a_circle() {
    assert_eq!(circle(&imports(&core())), None);
    let binding = modules(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../python/src"));
    let imports = imports(&binding);
    assert!(
        imports["trajectory"].contains("scene::model"),
        "the imports of the binding are not read"
    );
    assert_eq!(circle(&imports), None);
}

/// No glob, no `super::` and no re-export outside of tests hides an import from the tests above.
#[test]
fn imports_name_what_they_use() {
    let modules = core();
    for (file, code) in &modules {
        for path in paths(code) {
            let known = |(name, _): (usize, &str)| modules.contains_key(&path[..name]);
            let named = path.match_indices("::").any(known) || modules.contains_key(&path);
            assert!(named, "{file} imports crate::{path}, which names no file");
        }
        assert!(!code.contains("use super::"), "{file} imports by `super`");
        let crate_glob = code.lines().any(|line| line.contains("crate::") && line.contains("::*"));
        assert!(!crate_glob, "{file} imports by a glob");
    }
}

#[test]
fn folders_stay_small() {
    let mut files = Vec::new();
    let core = Path::new(env!("CARGO_MANIFEST_DIR"));
    ["src", "tests"].iter().for_each(|folder| sources(&core.join(folder), &mut files));
    let mut folders: BTreeMap<&Path, usize> = BTreeMap::new();
    for folder in files.iter().filter_map(|file| file.parent()) {
        *folders.entry(folder).or_default() += 1;
    }
    folders.retain(|_, count| *count > LARGEST_FOLDER);
    assert!(folders.is_empty(), "{folders:?}");
}

#[test]
fn the_checks_see_what_is_wrong() {
    let planted = |files: &[(&str, &str)]| -> BTreeMap<String, String> {
        files.iter().map(|(name, code)| (name.to_string(), code.to_string())).collect()
    };
    let round = planted(&[
        ("scene::model", "use crate::scene::{status, reduction::Reduced};"),
        ("scene::status", ""),
        ("scene::reduction", "fn of(scene: &crate::scene::model::Scene) {}"),
    ]);
    assert_eq!(circle(&imports(&round)), Some(vec!["scene::model", "scene::reduction"]));
    let upward =
        planted(&[("scene::model", "use crate::motion::taylor::A;"), ("motion::taylor", "")]);
    let found = imports(&upward);
    assert!(part(found["scene::model"].first().expect("an import")) > part("scene::model"));
}

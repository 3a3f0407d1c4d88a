//! How the sources lie: no circle of files that import each other, no folder of more files than one takes in.
//!
//! Names count as imported from the file that defines them, also where a `mod.rs` passes them on; imports of tests do
//! not count.

#![allow(clippy::unwrap_used, reason = "a test")]

use proc_macro2::{TokenStream, TokenTree};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// A folder's files, its `mod.rs` apart.
const MOST_FILES: usize = 14;

/// A path of names from the crate's root.
type Module = Vec<String>;

#[derive(Default)]
struct File {
    path: String,
    /// Names that it takes or passes on, with where they come from.
    names: BTreeMap<String, Module>,
    /// All paths that it writes; those that it only passes on, by name, apart.
    paths: Vec<Module>,
    passed_on: Vec<String>,
    /// How often each word stands in it.
    words: BTreeMap<String, usize>,
}

/// The program's words and signs without comments and text; groups opened up.
fn words(tokens: TokenStream, out: &mut Vec<String>) {
    for token in tokens {
        match token {
            TokenTree::Group(group) => {
                let signs = match group.delimiter() {
                    proc_macro2::Delimiter::Brace => ["{", "}"],
                    proc_macro2::Delimiter::Bracket => ["[", "]"],
                    _ => ["(", ")"],
                };
                out.push(signs[0].to_owned());
                words(group.stream(), out);
                out.push(signs[1].to_owned());
            }
            TokenTree::Literal(_) => out.push("_".to_owned()),
            TokenTree::Punct(sign) if sign.as_char() == ':' && out.last().is_some_and(|w| w == ":") => {
                out.pop();
                out.push("::".to_owned());
            }
            other => out.push(other.to_string()),
        }
    }
}

/// Leaves out `#[cfg(test)] mod … { … }`.
fn without_tests(words: &[String]) -> Vec<String> {
    const TEST: [&str; 7] = ["#", "[", "cfg", "(", "test", ")", "]"];
    let (mut out, mut i) = (Vec::new(), 0);
    while i < words.len() {
        if !words[i..].iter().take(7).eq(TEST.iter()) {
            out.push(words[i].clone());
            i += 1;
            continue;
        }
        let mut depth = 0;
        while i < words.len() {
            depth += i32::from(words[i] == "{") - i32::from(words[i] == "}");
            i += 1;
            if depth == 0 && ["}", ";"].contains(&words[i - 1].as_str()) {
                break;
            }
        }
    }
    out
}

/// The paths of a `use` and the names they get; `at` stands behind the tree afterwards.
fn tree(words: &[String], at: &mut usize, before: &[String], out: &mut Vec<(Module, String)>) {
    let mut path = before.to_vec();
    loop {
        match words[*at].as_str() {
            "{" => {
                while words[*at] != "}" {
                    *at += 1;
                    if words[*at] != "}" {
                        tree(words, at, &path, out);
                    }
                }
                *at += 1;
                return;
            }
            "::" => {}
            "as" => {
                *at += 2;
                out.push((path, words[*at - 1].clone()));
                return;
            }
            "," | ";" | "}" => {
                path.retain(|w| w != "self" || before.is_empty());
                let name = path.last().cloned().unwrap_or_default();
                out.push((path, name));
                return;
            }
            word => path.push(word.to_owned()),
        }
        *at += 1;
    }
}

/// Reads a file's imports.
fn read(module: &Module, path: &str, modules: &BTreeSet<Module>) -> File {
    let text = std::fs::read_to_string(Path::new("src").join(path)).unwrap();
    let mut all = Vec::new();
    words(text.parse().unwrap(), &mut all);
    let all = without_tests(&all);
    let child = |word: &str| modules.contains(&[module.as_slice(), &[word.to_owned()]].concat());
    let from_root = |path: &[String]| -> Option<Module> {
        let ups = path.iter().take_while(|w| *w == "super").count();
        match path[0].as_str() {
            "crate" | "clerestory" => Some(path[1..].to_vec()),
            "self" => Some([module, &path[1..]].concat()),
            "super" => Some([&module[..module.len().saturating_sub(ups)], &path[ups..]].concat()),
            word => child(word).then(|| [module, path].concat()),
        }
    };
    let mut file = File { path: path.to_owned(), ..File::default() };
    let mut at = 0;
    while at < all.len() {
        let passed_on = at > 0 && (all[at - 1] == "pub" || all[at - 1] == ")" && all[at - 4..at - 2] == ["pub", "("]);
        if all[at] == "use" {
            let mut found = Vec::new();
            at += 1;
            tree(&all, &mut at, &[], &mut found);
            for (path, name) in found {
                if let Some(path) = from_root(&path) {
                    file.names.insert(name.clone(), path.clone());
                    if passed_on { file.passed_on.push(name) } else { file.paths.push(path) }
                }
            }
        } else if at + 1 < all.len()
            && all[at + 1] == "::"
            && (at < 2 || all[at - 1] != "::" && all[at - 2..at] != ["(", "in"])
        {
            let mut path = vec![all[at].clone()];
            while at + 2 < all.len()
                && all[at + 1] == "::"
                && all[at + 2].starts_with(|c: char| c.is_alphabetic() || c == '_')
            {
                path.push(all[at + 2].clone());
                at += 2;
            }
            *file.words.entry(path[0].clone()).or_default() += 1;
            file.paths.extend(from_root(&path));
            at += 1;
        } else {
            *file.words.entry(all[at].clone()).or_default() += 1;
            at += 1;
        }
    }
    file
}

/// The module that defines what a path names.
fn definer(files: &BTreeMap<Module, File>, path: &[String], depth: usize) -> Option<Module> {
    let module = (0..=path.len()).rev().map(|n| &path[..n]).find(|m| files.contains_key(*m))?;
    match path.get(module.len()).and_then(|name| files[module].names.get(name)) {
        Some(from) if depth < 8 && from != path => {
            definer(files, &[from, &path[module.len() + 1..]].concat(), depth + 1)
        }
        _ => Some(module.to_vec()),
    }
}

/// Each source file, by its module.
fn sources() -> BTreeMap<Module, File> {
    fn walk(folder: &Path, out: &mut Vec<String>) {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                walk(&path, out);
            } else if path.extension().is_some_and(|e| e == "rs") {
                out.push(path.strip_prefix("src").unwrap().to_string_lossy().replace('\\', "/"));
            }
        }
    }
    let mut paths = Vec::new();
    walk(Path::new("src"), &mut paths);
    paths.retain(|p| p != "main.rs" && !p.ends_with("/tests.rs"));
    let module = |path: &str| -> Module {
        let stem = path.trim_end_matches(".rs").trim_end_matches("/mod");
        if stem == "lib" { Vec::new() } else { stem.split('/').map(str::to_owned).collect() }
    };
    let modules: BTreeSet<Module> = paths.iter().map(|p| module(p)).collect();
    paths.iter().map(|p| (module(p), read(&module(p), p, &modules))).collect()
}

/// Which modules each file imports from, its own apart.
fn imports(files: &BTreeMap<Module, File>) -> BTreeMap<Module, BTreeSet<Module>> {
    let of = |(module, file): (&Module, &File)| {
        let used = file.passed_on.iter().filter(|name| file.words.contains_key(*name)).map(|name| &file.names[name]);
        let from = file.paths.iter().chain(used).filter_map(|path| definer(files, path, 0));
        (module.clone(), from.filter(|m| m != module && !m.is_empty()).collect())
    };
    files.iter().filter(|(m, _)| !m.is_empty()).map(of).collect()
}

/// What is left when what imports nothing that is left, and what nothing left imports, is taken away: circles, and
/// what lies between them.
fn circles<T: Ord + Clone>(imports: &BTreeMap<T, BTreeSet<T>>) -> BTreeMap<T, BTreeSet<T>> {
    let mut left = imports.clone();
    loop {
        let all: BTreeSet<T> = left.keys().cloned().collect();
        left.values_mut().for_each(|from| from.retain(|m| all.contains(m)));
        let imported: BTreeSet<T> = left.values().flatten().cloned().collect();
        left.retain(|m, from| !from.is_empty() && imported.contains(m));
        if left.len() == all.len() {
            return left;
        }
    }
}

#[test]
fn no_files_import_each_other_in_a_circle() {
    let files = sources();
    let imports = imports(&files);
    assert!(imports.len() > 150 && imports.values().map(BTreeSet::len).sum::<usize>() > 500, "imports are not found");
    let path = |m: &Module| files[m].path.clone();
    let circles: Vec<String> = circles(&imports)
        .iter()
        .map(|(m, from)| format!("{} imports {}", path(m), from.iter().map(path).collect::<Vec<_>>().join(", ")))
        .collect();
    assert!(circles.is_empty(), "files import each other in a circle:\n{}", circles.join("\n"));
}

#[test]
fn no_stage_imports_one_that_builds_on_it() {
    let mut stages: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    for (module, from) in imports(&sources()) {
        let others = from.into_iter().map(|m| m[0].clone()).filter(|m| *m != module[0]);
        stages.entry(module[0].clone()).or_default().extend(others);
    }
    assert!(stages.len() > 20 && circles(&stages).is_empty(), "{:?}", circles(&stages));
}

#[test]
fn a_folder_of_plan_imports_from_those_before_it() {
    const ORDER: [&str; 6] = ["floors", "free_space", "visibility", "cover", "stations", "export"];
    let place = |m: &Module| (m.len() > 2 && m[0] == "plan").then(|| ORDER.iter().position(|f| *f == m[1])).flatten();
    for (module, from) in imports(&sources()) {
        let Some(own) = place(&module) else { continue };
        let later: Vec<&Module> = from.iter().filter(|m| place(m).is_some_and(|other| other > own)).collect();
        assert!(later.is_empty(), "{module:?} imports {later:?}");
    }
}

#[test]
fn no_folder_has_more_files_than_one_takes_in() {
    let mut folders: BTreeMap<String, usize> = BTreeMap::new();
    for file in sources().values().filter(|f| !f.path.ends_with("mod.rs")) {
        let folder = file.path.rsplit_once('/').map_or("", |(folder, _)| folder);
        *folders.entry(format!("{folder}/")).or_default() += 1;
    }
    folders.retain(|_, count| *count > MOST_FILES);
    assert!(folders.is_empty(), "parts of these folders want folders of their own: {folders:?}");
}

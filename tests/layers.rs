//! The sources: modules of a crate have no circle. Of the planner also: layers import only downwards, files of a layer
//! have no circle, and neither files nor functions are long.

use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    path::{Path, PathBuf},
};

/// The crates with several modules.
const CRATES: [&str; 10] = ["scenario", "core", "plan", "cpu", "gpu", "engine", "io", "lab", "cli", "viewer"];
/// Layers of the planner, from the lowest to the highest.
const LAYERS: [&str; 10] = [
    "ir",
    "view",
    "source_error",
    "picture_error",
    "choose",
    "planner",
    "tracks",
    "uniforms",
    "adapter",
    "describe",
];
const MOST_LINES_OF_FILE: usize = 400;
const MOST_LINES_OF_FUNCTION: usize = 60;
/// In a function that is longer than that, before its reason.
const REASON: &str = "// Long because:";

/// Where the tests of a file begin. They end with the next closing brace at the start of a line.
const TESTS: &str = "#[cfg(test)]\nmod tests {";

/// A file of the crate.
struct Source {
    path: PathBuf,
    /// Names from the crate's root, empty for the root itself.
    module: Vec<String>,
    text: String,
}

impl Source {
    fn is_test(&self) -> bool {
        let is_gated = |name: &String| name.starts_with("test") || name == "exact";
        self.module.iter().any(is_gated)
    }

    /// Its code without comments, strings and tests, line by line.
    fn code(&self) -> String {
        let (before, tests) = self.text.split_once(TESTS).unwrap_or((&self.text, ""));
        let after = tests.split_once("\n}\n").map_or("", |(_, after)| after);
        let lines = before.lines().chain(after.lines());
        lines.map(code_of_line).collect::<Vec<_>>().join("\n")
    }
}

/// A line without its comment and the contents of its strings.
fn code_of_line(line: &str) -> String {
    let (mut code, mut in_string, mut escaped) = (String::new(), false, false);
    let mut characters = line.chars().peekable();
    while let Some(character) = characters.next() {
        match (in_string, character) {
            (true, '\\') if !escaped => escaped = true,
            (true, '"') if !escaped => in_string = false,
            (true, _) => escaped = false,
            (false, '"') => in_string = true,
            (false, '\'') if characters.peek() == Some(&'{') || characters.peek() == Some(&'"') => {
                characters.next();
            }
            (false, '/') if characters.peek() == Some(&'/') => break,
            (false, _) => code.push(character),
        }
    }
    code
}

fn sources(of_crate: &str) -> Vec<Source> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("crates/camsim-{of_crate}/src"));
    let mut found = Vec::new();
    let mut folders = vec![root.clone()];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(&folder).expect("a folder of sources") {
            let path = entry.expect("an entry").path();
            if path.is_dir() {
                folders.push(path);
                continue;
            }
            let inside = path.strip_prefix(&root).expect("below the root").with_extension("");
            let mut module: Vec<String> =
                inside.iter().map(|part| part.to_string_lossy().into_owned()).collect();
            module.retain(|name| name != "lib" && name != "mod");
            let text = fs::read_to_string(&path).expect("a source");
            found.push(Source { path, module, text });
        }
    }
    found.sort_by(|a, b| a.path.cmp(&b.path));
    assert!(found.len() > 20, "{} sources in {}", found.len(), root.display());
    found
}

/// Paths of a `use` tree.
fn expanded(tree: &str) -> Vec<String> {
    let tree = tree.trim();
    let Some((before, inside)) = tree.split_once('{') else {
        return vec![tree.split(" as ").next().unwrap_or_default().trim().to_owned()];
    };
    let inside = inside.trim_end().strip_suffix('}').expect("a closed tree");
    let (mut parts, mut depth, mut part) = (Vec::new(), 0, String::new());
    for character in inside.chars() {
        match character {
            '{' => depth += 1,
            '}' => depth -= 1,
            _ => {}
        }
        if character == ',' && depth == 0 {
            parts.push(std::mem::take(&mut part));
        } else {
            part.push(character);
        }
    }
    parts.push(part);
    let parts = parts.iter().filter(|part| !part.trim().is_empty());
    parts.flat_map(|part| expanded(part)).map(|path| format!("{before}{path}")).collect()
}

/// Paths that a source imports or writes out, from `crate`, `super` or a module of its own.
fn paths(source: &Source) -> Vec<String> {
    let code = source.code();
    let mut paths = Vec::new();
    let mut rest = String::new();
    for statement in code.split_inclusive(';') {
        let from = statement.find("use ").filter(|&at| statement[..at].ends_with(['\n', ' ']) || at == 0);
        match from {
            Some(at) => paths.extend(expanded(statement[at + 4..].trim_end_matches(';'))),
            None => rest.push_str(statement),
        }
    }
    let is_of_path = |character: char| character.is_alphanumeric() || "_:".contains(character);
    for word in rest.split(|character| !is_of_path(character)) {
        if word.contains("::") {
            paths.push(word.to_owned());
        }
    }
    paths
}

/// The module that a path leads into; `None` for other crates' paths and for items of the module itself.
fn target(source: &Source, path: &str, modules: &BTreeSet<Vec<String>>) -> Option<Vec<String>> {
    let mut parts: Vec<String> = path.split("::").map(|part| part.trim().to_owned()).collect();
    let mut base = source.module.clone();
    match parts.first()?.as_str() {
        "crate" => {
            base.clear();
            parts.remove(0);
        }
        "super" | "self" => {
            while let Some(first) = parts.first().filter(|first| *first == "super" || *first == "self") {
                if first == "super" {
                    base.pop();
                }
                parts.remove(0);
            }
        }
        _ => {
            base.push(parts[0].clone());
            if !modules.contains(&base) {
                return None;
            }
            base.pop();
        }
    }
    base.extend(parts);
    (0..=base.len()).rev().map(|len| base[..len].to_vec()).find(|prefix| modules.contains(prefix))
}

/// Modules that each module imports from.
fn imports(sources: &[Source]) -> BTreeMap<Vec<String>, BTreeSet<Vec<String>>> {
    let modules: BTreeSet<Vec<String>> = sources.iter().map(|source| source.module.clone()).collect();
    let of_source = |source: &Source| {
        let targets = paths(source).into_iter().filter_map(|path| target(source, &path, &modules));
        (source.module.clone(), targets.filter(|target| *target != source.module).collect())
    };
    sources.iter().filter(|source| !source.module.is_empty() && !source.is_test()).map(of_source).collect()
}

fn rank(module: &[String]) -> usize {
    // An import from the root hides the layer that it is from.
    let Some(first) = module.first() else { return LAYERS.len() };
    LAYERS.iter().position(|layer| layer == first).unwrap_or_else(|| panic!("{first} is in no layer"))
}

/// What is in a circle of imports, or imports what is in one.
fn circular<T: Ord + Clone>(mut imports: BTreeMap<T, BTreeSet<T>>) -> BTreeMap<T, BTreeSet<T>> {
    loop {
        let known: BTreeSet<T> = imports.keys().cloned().collect();
        let count = imports.len();
        imports.retain(|_, targets| !targets.is_disjoint(&known));
        if imports.len() == count {
            return imports;
        }
    }
}

/// Modules at the root of a crate that those import from.
fn root_imports(sources: &[Source]) -> BTreeMap<String, BTreeSet<String>> {
    let mut found: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    for (module, targets) in imports(sources) {
        let others = targets.into_iter().filter_map(|target| target.into_iter().next());
        found.entry(module[0].clone()).or_default().extend(others.filter(|other| *other != module[0]));
    }
    found
}

#[test]
fn modules_of_a_crate_have_no_circle() {
    for of_crate in CRATES {
        let imports = root_imports(&sources(of_crate));
        assert!(imports.values().any(|targets| !targets.is_empty()), "{of_crate}: {imports:?}");
        let circle = circular(imports);
        assert!(circle.is_empty(), "{of_crate}, in or behind a circle: {circle:#?}");
    }
}

#[test]
fn layers_of_the_planner_import_only_downwards() {
    let mut upwards = Vec::new();
    for (module, targets) in imports(&sources("plan")) {
        for target in targets.iter().filter(|target| rank(target) > rank(&module)) {
            upwards.push(format!("{} imports {}", module.join("::"), target.join("::")));
        }
    }
    assert!(upwards.is_empty(), "{upwards:#?}");
}

#[test]
fn files_of_a_layer_of_the_planner_have_no_circle() {
    let imports = imports(&sources("plan"));
    assert!(imports.values().map(BTreeSet::len).sum::<usize>() > 100, "{imports:?}");
    let circle = circular(imports);
    assert!(circle.is_empty(), "in or behind a circle: {circle:#?}");
}

#[test]
fn no_file_of_the_planner_is_long() {
    let lines = |source: &Source| source.text.lines().count();
    let long: Vec<_> = sources("plan")
        .into_iter()
        .filter(|source| lines(source) > MOST_LINES_OF_FILE)
        .map(|source| format!("{}: {} lines", source.path.display(), lines(&source)))
        .collect();
    assert!(long.is_empty(), "{long:#?}");
}

#[test]
fn no_function_of_the_planner_is_long_without_a_reason() {
    let mut long = Vec::new();
    for source in sources("plan") {
        let lines: Vec<&str> = source.text.lines().collect();
        for (first, line) in lines.iter().enumerate() {
            let code = line.trim_start();
            let indent = &line[..line.len() - code.len()];
            let is_function = ["fn ", "pub fn ", "pub(crate) fn ", "pub(super) fn "]
                .iter()
                .any(|start| code.starts_with(start));
            if !is_function {
                continue;
            }
            // A declaration in a trait has no body.
            let head = lines[first..].iter().find(|line| line.ends_with(['{', ';']));
            if head.is_none_or(|line| line.ends_with(';')) {
                continue;
            }
            let end = format!("{indent}}}");
            let Some(length) = lines[first..].iter().position(|line| *line == end) else { continue };
            let has_reason = lines[first..first + length].iter().any(|line| line.contains(REASON));
            if length + 1 > MOST_LINES_OF_FUNCTION && !has_reason {
                long.push(format!("{}:{}: {} lines", source.path.display(), first + 1, length + 1));
            }
        }
    }
    assert!(long.is_empty(), "{long:#?}");
}

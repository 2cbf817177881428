//! Accessible names: every control of every pane has one.

use camsim_io::scenario_file::{ValueKind, kinds};
use egui_kittest::kittest::{NodeT, Queryable};

use super::harness::{Window, has, pattern};
use crate::{
    engine::Stage,
    message::PathPrompt,
    panes::parameters::section_names,
    state::UnsavedPrompt,
    view::{Compare, Overlays, Tab},
};

/// High enough for all sections at once: controls out of view have no nodes.
const SIZE: [f32; 2] = [1200.0, 14000.0];

/// A scenario with values under nearly every key: lists with entries, a board.
fn full_scenario(folder: &std::path::Path) -> std::path::PathBuf {
    camsim_io::builtin::unpack(folder).expect("unpacked");
    std::fs::write(folder.join("zoom.csv"), "t_s,zoom\n0,1\n100,1\n").expect("written");
    let text = std::fs::read_to_string(folder.join("pattern.toml")).expect("text");
    let mut table: toml::Table = text.parse().expect("toml");
    let more: toml::Table = "[board]\nkind = \"chessboard\"\ncolumns = 9\nrows = 6\nsize_m = 1.0\n\
        [[zoom]]\nat = 1.0\nfocal_px = [420.0, 421.0]\ncoefficients = [-0.22, 0.06, 0.0, 0.0]\n\
        [[twin]]\nname = \"sharp\"\nexposure = false\n\
        [[imu]]\nname = \"imu0\"\n[[gnss]]\nname = \"gnss0\"\n[[barometer]]\nname = \"baro0\"\n\
        [[magnetometer]]\nname = \"mag0\"\nfield_ned_ut = [20.0, 1.0, 43.0]\n"
        .parse()
        .expect("toml");
    let put = |table: &mut toml::Table, group: &str, key: &str, value: toml::Value| {
        table.get_mut(group).and_then(toml::Value::as_table_mut).expect("a table").insert(key.into(), value);
    };
    put(&mut table, "scene", "board", more["board"].clone());
    put(&mut table, "camera", "zoom", more["zoom"].clone());
    put(&mut table, "output", "twin", more["twin"].clone());
    for list in ["imu", "gnss", "barometer", "magnetometer"] {
        table.insert(list.into(), more[list].clone());
    }
    put(&mut table, "camera", "zoom_track", toml::Value::String("zoom.csv".into()));
    let path = folder.join("everything.toml");
    std::fs::write(&path, table.to_string()).expect("written");
    path
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn every_control_of_every_pane_has_an_accessible_name() {
    let folder = tempfile::tempdir().expect("a folder");
    let exporter: crate::Exporter = std::sync::Arc::new(|_| Ok("nothing".into()));
    let mut window = Window::with(Some(pattern()), Some(exporter), SIZE);
    window.settle_reference();
    for tab in Tab::ALL {
        window.state_mut().view.tab = tab;
        window.state_mut().pinned = (tab == Tab::Pixel).then_some([320, 240]);
        (0..3).for_each(|_| window.step());
        window.harness.check_accessibility();
    }
    for compare in Compare::ALL {
        let view = &mut window.state_mut().view;
        (view.compare, view.a, view.b) = (compare, Stage::Photometric, Stage::Lens);
        view.overlays = Overlays {
            invalid: true,
            grid: true,
            motion: true,
            rows: true,
            error: true,
            histogram: true,
            ..Overlays::default()
        };
        window.step();
        window.harness.check_accessibility();
    }
    window.state_mut().view.compare = Compare::Single;
    window.state_mut().notice("something".into());
    for path_prompt in [true, false] {
        window.state_mut().path_prompt =
            Some(PathPrompt { saves: path_prompt, path: folder.path().display().to_string() });
        (0..3).for_each(|_| window.step());
        assert!(has(&window, "Browse..."));
        window.harness.check_accessibility();
    }
    window.state_mut().path_prompt = None;
    window.state_mut().dropped_picture = Some("picture.png".into());
    (0..3).for_each(|_| window.step());
    window.harness.check_accessibility();
    window.state_mut().dropped_picture = None;
    window.state_mut().unsaved_prompt = Some(UnsavedPrompt::Close);
    (0..3).for_each(|_| window.step());
    assert!(has(&window, "Close without saving"));
    window.harness.check_accessibility();
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn every_key_of_the_format_has_an_editor_with_its_name() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut window = Window::with(Some(full_scenario(folder.path())), None, SIZE);
    window.settle();
    let closed: Vec<&str> = section_names()
        .into_iter()
        .filter(|name| !["camera.lens", "camera.shutter", "camera.photometric"].contains(name))
        .collect();
    for name in closed {
        // A key may have the same name as a section below.
        let header = window.harness.query_all_by_label(name).last().expect("a section");
        header.click();
        (0..2).for_each(|_| window.step());
    }
    // Headers open with an animation.
    (0..40).for_each(|_| window.step());
    window.harness.check_accessibility();
    let elements = |key: &str| {
        let list =
            kinds().find(|&(list, kind)| kind == ValueKind::Tables && key.starts_with(&format!("{list}.")));
        list.map_or_else(|| key.to_owned(), |(list, _)| key.replacen(list, &format!("{list}.0"), 1))
    };
    let labels: Vec<String> = window
        .harness
        .root()
        .children_recursive()
        .filter_map(|node| node.accesskit_node().label().map(|label| label.to_string()))
        .collect();
    let mut without = Vec::new();
    for (key, kind) in kinds().filter(|&(_, kind)| kind != ValueKind::Tables) {
        let named = elements(key);
        // A number, an element, a word beside it, or the button that sets the key.
        let is_of_key = |label: &String| {
            let rest = label.strip_prefix("set ").unwrap_or(label).strip_prefix(&named);
            rest.is_some_and(|rest| rest.is_empty() || rest.starts_with('[') || rest.starts_with(": "))
                || *label == format!("one more of {named}")
        };
        if !labels.iter().any(is_of_key) {
            without.push((named, kind));
        }
    }
    // The scene has no models.
    without.retain(|(key, _)| !key.starts_with("scene.gltf."));
    assert!(without.is_empty(), "no editor: {without:?}");
}

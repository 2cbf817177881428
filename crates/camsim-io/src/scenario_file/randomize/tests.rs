#![allow(clippy::unwrap_used, reason = "tests")]

use super::*;

const SCENE: &str = "seed = 9\n[flight]\nlog = \"a.csv\"\nwindow_s = [10, 20]\n[scene.pattern]\nimage = \"g.png\"\n\
                     width_m = 10\n";

fn read(text: &str) -> Result<RandomScenario, ScenarioError> {
    with(text, &[])
}

fn with(text: &str, sets: &[(&str, &str)]) -> Result<RandomScenario, ScenarioError> {
    let sets: Vec<_> = sets.iter().map(|(key, value)| ((*key).to_owned(), (*value).to_owned())).collect();
    parse_random_scenario(&format!("{SCENE}{text}"), Path::new("dir/s.toml"), &sets)
}

fn values(scenario: &RandomScenario, key: &str, count: u64) -> Vec<Value> {
    let one = |index| {
        let drawn = scenario.variation(index).unwrap().drawn;
        drawn.into_iter().find(|drawn| drawn.key == key).unwrap().value
    };
    (0..count).map(one).collect()
}

const EXPOSURE: &str = "camera.shutter.exposure_ms";

#[test]
fn a_key_may_be_quoted_dotted_or_in_a_table() {
    let forms = [
        "[randomize]\n\"camera.shutter.exposure_ms\" = { uniform = [2, 10] }",
        "[randomize]\ncamera.shutter.exposure_ms = { uniform = [2, 10] }",
        "[randomize.camera.shutter]\nexposure_ms = { uniform = [2, 10] }",
        "[randomize.camera.shutter.exposure_ms]\nuniform = [2, 10]",
    ];
    let all = forms.map(|text| values(&read(text).unwrap(), EXPOSURE, 20));
    all.iter().for_each(|form| assert_eq!(form, &all[0]));
    let by_set = with("", &[("randomize.camera.shutter.exposure_ms", "{ uniform = [2, 10] }")]).unwrap();
    assert_eq!(values(&by_set, EXPOSURE, 20), all[0]);
}

#[test]
fn variations_have_the_drawn_values_and_no_order() {
    let scenario =
        read("[randomize]\n\"camera.shutter.exposure_ms\" = { uniform = [2, 10] }\nvariations = 5").unwrap();
    assert_eq!((scenario.is_random(), scenario.variations()), (true, Some(5)));
    assert_eq!(scenario.base().first().camera.shutter.exposure_ms, 0.0);
    let mut seeds = std::collections::BTreeSet::new();
    for index in [70_000, 3, 99_999, 0] {
        let variation = scenario.variation(index).unwrap();
        let again = read(
            "[randomize]\nvariations = 9\n\"camera.shutter.exposure_ms\" = { uniform = [2, 10] }\n\
                          \"camera.fps\" = { integer = [10, 60] }",
        );
        let exposure_ms = variation.rig.first().camera.shutter.exposure_ms;
        assert!((2.0..=10.0).contains(&exposure_ms), "{exposure_ms}");
        assert_eq!(variation.drawn[0].value, Value::Float(exposure_ms));
        let again = again.unwrap().variation(index).unwrap();
        assert_eq!(again.rig.first().camera.shutter.exposure_ms, exposure_ms, "another key changes no other");
        assert_eq!(again.rig.first().seed, variation.rig.first().seed);
        seeds.insert(variation.rig.first().seed);
        let other_seed =
            read("[randomize]\n\"camera.shutter.exposure_ms\" = { uniform = [2, 10] }\nseed = 10");
        let other = other_seed.unwrap().variation(index).unwrap();
        assert_ne!(other.rig.first().camera.shutter.exposure_ms, exposure_ms);
    }
    assert_eq!(seeds.len(), 4, "each variation has noise of its own");
    let same = read("[randomize]\nown_seed = false\n\"camera.fps\" = { integer = [10, 60] }").unwrap();
    assert_eq!(same.variation(7).unwrap().rig.first().seed, 9);
}

#[test]
fn draws_of_a_scenario_follow_their_distributions() {
    const COUNT: u64 = 4000;
    let scenario = read(
        "[randomize]\n\"camera.shutter.exposure_ms\" = { uniform = [2, 10] }\n\
         \"camera.mount.angles_deg\" = { normal = [[0, -90, 0], [1, 2, 180]], clip = [-180, 180] }\n\
         \"camera.fps\" = { choice = [15, 30], weights = [1, 3] }\n\
         \"scene.fog_visibility_m\" = { log_uniform = [100, 10000] }",
    )
    .unwrap();
    let (mut sums, mut square_sum, mut slow) = ([0.0; 3], 0.0, 0);
    for index in 0..COUNT {
        let rig = scenario.variation(index).unwrap().rig;
        let (camera, scene) = (&rig.first().camera, &rig.first().scene);
        sums[0] += camera.shutter.exposure_ms;
        sums[1] += camera.mount.angles_deg[1];
        sums[2] += scene.fog_visibility_m.unwrap().log10();
        square_sum += (camera.mount.angles_deg[1] + 90.0).powi(2);
        slow += u64::from(camera.fps == 15.0);
    }
    let n = COUNT as f64;
    // Five standard errors of each estimate.
    let near = |value: f64, wanted: f64, sigma: f64| (value - wanted).abs() < 5.0 * sigma / n.sqrt();
    assert!(near(sums[0] / n, 6.0, 8.0 / 12_f64.sqrt()), "{}", sums[0] / n);
    assert!(near(sums[1] / n, -90.0, 2.0), "{}", sums[1] / n);
    assert!(near(sums[2] / n, 3.0, 2.0 / 12_f64.sqrt()), "{}", sums[2] / n);
    assert!(near(square_sum / n, 4.0, 4.0 * 2_f64.sqrt()), "{}", square_sum / n);
    assert!(near(slow as f64 / n, 0.25, 0.75_f64.sqrt() * 0.5), "{slow}");
}

#[test]
fn values_change_what_stands_there() {
    let text = "[camera]\nfocal_px = [400, 500]\nsize_px = [320, 240]\n[randomize]\n\
                \"camera.focal_px\" = { times = { uniform = [0.9, 1.1] } }\n\
                \"camera.mount.angles_deg.1\" = { plus = { uniform = [-5, 5] } }\n\
                \"flight.window_s\" = { piece_s = 0.5 }";
    let scenario = read(text).unwrap();
    for index in 0..100 {
        let rig = scenario.variation(index).unwrap().rig;
        let camera = &rig.first().camera;
        let [fx, fy] = camera.focal_px;
        assert!((360.0..=440.0).contains(&fx) && (fy / fx - 1.25).abs() < 1e-9, "one factor: {fx} {fy}");
        let [roll, pitch, yaw] = camera.mount.angles_deg;
        assert!((roll, yaw) == (0.0, 0.0) && pitch.abs() <= 5.0, "{pitch}");
        let [start, end] = rig.first().flight.window_s.unwrap();
        assert!(start >= 10.0 && end <= 20.0 + 1e-9 && (end - start - 0.5).abs() < 1e-12, "{start} {end}");
    }
    let each = "[camera]\nfocal_px = [400, 500]\n[randomize]\n\
                \"camera.focal_px\" = { times = { uniform = [[0.9, 1.0], [0.9, 1.0]] } }";
    let camera = read(each).unwrap().variation(1).unwrap().rig.first().camera.clone();
    assert_eq!(camera.focal_px, [360.0, 500.0]);
}

#[test]
fn a_choice_may_be_a_table_or_a_file() {
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("c.toml"), "fps = 25\nfocal_px = [100, 100]\n").unwrap();
    let lens = "\"camera.lens\" = { choice = [{ model = \"brown-conrady\", coefficients = [-0.1, 0.2] }, \
                { model = \"pinhole\" }] }";
    let text = format!(
        "{SCENE}[randomize]\n{lens}\n\"scene.pattern.image\" = {{ choice = [\"x/a.png\", \"b.png\"] }}\n\
                        \"camera\" = {{ choice = [\"c.toml\"] }}\n\"camera.focal_px.0\" = {{ plus = {{ uniform = [1, 2] }} }}"
    );
    let file = dir.path().join("s.toml");
    std::fs::write(&file, text).unwrap();
    let scenario = read_random_scenario(&file, &[], None).unwrap();
    let mut lenses = [0, 0];
    for index in 0..60 {
        let variation = scenario.variation(index).unwrap();
        let scenario = variation.rig.first();
        lenses[scenario.camera.lens.coefficients.len() / 2] += 1;
        let image = &scenario.scene.pattern.as_ref().unwrap().image;
        assert!(
            [dir.path().join("x/a.png"), dir.path().join("b.png")].contains(image),
            "{}",
            image.display()
        );
        assert_eq!(scenario.camera.fps, 25.0);
        assert!((101.0..=102.0).contains(&scenario.camera.focal_px[0]), "upon the chosen camera");
    }
    assert!(lenses.iter().all(|count| *count > 10), "{lenses:?}");
}

const RIG: &str =
    "[[cameras]]\nname = \"left\"\nfps = 20\n[[cameras]]\nname = \"right\"\nfps = 10\n[randomize]\n";

#[test]
fn cameras_of_a_rig_have_values_of_their_own_or_one() {
    let text = format!(
        "{RIG}\"cameras.*.shutter.exposure_ms\" = {{ uniform = [2, 10] }}\n\
         \"cameras.right.clock_offset_ms\" = {{ normal = [0, 1] }}\n\
         \"cameras.*.fps\" = {{ times = {{ uniform = [1, 2] }} }}"
    );
    let variation = read(&text).unwrap().variation(4).unwrap();
    let [left, right] = variation.rig.scenarios() else { panic!("two cameras") };
    assert_eq!(left.camera.shutter.exposure_ms, right.camera.shutter.exposure_ms);
    assert!(left.camera.shutter.exposure_ms >= 2.0);
    assert!(left.camera.clock_offset_ms == 0.0 && right.camera.clock_offset_ms != 0.0);
    assert!((left.camera.fps / right.camera.fps - 2.0).abs() < 1e-9 && left.camera.fps > 20.0);
    let keys: Vec<&str> = variation.drawn.iter().map(|drawn| drawn.key.as_str()).collect();
    assert_eq!(
        keys,
        [
            "cameras.left.fps",
            "cameras.right.fps",
            "cameras.left.shutter.exposure_ms",
            "cameras.right.shutter.exposure_ms",
            "cameras.right.clock_offset_ms",
            "seed"
        ]
    );
    // What --set gives is not drawn.
    let fixed = with(&text, &[("cameras.1.shutter.exposure_ms", "3")]).unwrap().variation(4).unwrap();
    let exposures = [0, 1].map(|i| fixed.rig.scenarios()[i].camera.shutter.exposure_ms);
    assert_eq!(exposures, [left.camera.shutter.exposure_ms, 3.0]);
}

#[test]
fn keys_that_are_set_are_not_drawn() {
    let text = "[randomize]\n\"camera.shutter.exposure_ms\" = { uniform = [2, 10] }\n\
                \"camera.fps\" = { uniform = [10, 60] }";
    let fps = values(&read(text).unwrap(), "camera.fps", 5);
    for set in [(EXPOSURE, "3"), ("camera.shutter", "{ exposure_ms = 3 }")] {
        let scenario = with(text, &[set]).unwrap();
        assert_eq!(scenario.variation(2).unwrap().rig.first().camera.shutter.exposure_ms, 3.0);
        assert_eq!(values(&scenario, "camera.fps", 5), fps);
    }
}

#[test]
fn a_variation_reads_back_from_its_record() {
    let text = "[camera]\nfocal_px = [400, 500]\n[randomize]\n\"camera.focal_px\" = { times = { normal = [1, 0.1] } }\n\
                \"camera.shutter.exposure_ms\" = { log_uniform = [0.01, 10] }\n\
                \"camera.photometric.light\" = { normal = [1, 0.2], clip = [0.5, 1.5] }";
    let scenario = read(text).unwrap();
    for index in 0..200 {
        let variation = scenario.variation(index).unwrap();
        let run = serde_json::json!({ "paths": crate::scenario_file::RELATIVE_PATHS, "scenario": variation.rig.first() });
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("run.json");
        std::fs::write(&path, run.to_string()).unwrap();
        let read = super::super::read_scenario(&path, &[], None).unwrap();
        assert_eq!(read.camera, variation.rig.first().camera, "every bit");
        let record = serde_json::to_string(&variation.record()).unwrap();
        assert_eq!(serde_json::from_str::<VariationRecord>(&record).unwrap(), variation.record());
    }
}

#[test]
fn problems_name_file_line_and_key() {
    let cases = [
        (
            "\"camera.shuter.exposure_ms\" = { uniform = [2, 10] }",
            "s.toml:9: randomize.camera.shuter.exposure_ms: unknown key; did you mean `camera.shutter.exposure_ms`?",
        ),
        (
            "\"camera.fps\" = { unifrm = [2, 10] }",
            "s.toml:9: randomize.camera.fps: `unifrm` is no distribution; did you mean `uniform`?",
        ),
        (
            "camera.fps = [2, 10]",
            "randomize.camera.fps: expected a distribution, such as { uniform = [2, 10] }",
        ),
        ("\"camera.fps\" = {}", "expected a distribution"),
        ("\"camera.fps\" = { uniform = [10, 2] }", "uniform goes from 10 down to 2"),
        ("\"camera.fps\" = { uniform = 10 }", "uniform: expected two numbers, [lowest, highest]"),
        ("\"camera.fps\" = { uniform = [1, 2], clip = [1, 2] }", "clip does not go with uniform"),
        ("\"camera.fps\" = { uniform = [1, 2], normal = [1, 2] }", "has uniform and normal: keep one"),
        ("\"camera.fps\" = { normal = [1, 0] }", "standard deviation above 0"),
        ("\"camera.fps\" = { choice = [] }", "expected a list of values"),
        ("\"camera.fps\" = { choice = [1, 2], weights = [1] }", "expected 2 numbers, 0 or more"),
        ("\"camera.focal_px\" = { uniform = [[1, 2], [3, 4, 5]] }", "different lengths"),
        (
            "\"camera.focal_px\" = { times = { uniform = [[1, 2, 3], [3, 4, 5]] } }",
            "is a list of 2 numbers, and the distribution gives 3",
        ),
        (
            "\"camera.principal_point_px\" = { plus = { normal = [0, 1] } }",
            "has no value that could be changed",
        ),
        ("\"quality.key_frames\" = { uniform = [1, 4] }", "takes whole numbers: write { integer"),
        ("\"camera.lens\" = { uniform = [1, 4] }", "takes no numbers: write { choice"),
        ("\"camera.mount.angles_deg.7\" = { uniform = [1, 4] }", "`angles_deg` is a list of 3"),
        ("\"cameras.left.fps\" = { uniform = [1, 4] }", "the scenario has one camera, [camera]"),
        ("\"scene.gltf.*.scale\" = { uniform = [1, 4] }", "the scenario has no list `scene.gltf`"),
        ("\"camera.fps\" = { piece_s = 1 }", "piece_s goes with flight.window_s"),
        ("\"flight.window_s\" = { piece_s = 11 }", "does not fit into the window [10, 20]"),
        ("variations = 0", "randomize.variations: expected a whole number, 1 or more"),
        ("seed = { integer = [1, 2] }", "randomize.seed: expected a whole number, 0 or more"),
        ("variatons = 3", "did you mean `variations`?"),
        ("own_seed = 1", "randomize.own_seed: expected true or false"),
        (
            "camera.fps = { uniform = [1, 2] }\n\"camera.fps\" = { uniform = [1, 3] }",
            "randomize.camera.fps: is there twice",
        ),
    ];
    for (text, wanted) in cases {
        let error = read(&format!("[randomize]\n{text}\n")).unwrap_err().to_string();
        assert!(error.contains(wanted), "{text}\n  gives {error}\n  not   {wanted}");
    }
    assert!(
        parse_random_scenario("randomize = 3", Path::new("dir/s.toml"), &[])
            .unwrap_err()
            .to_string()
            .contains("dir/s.toml:1: randomize: expected a table")
    );
}

#[test]
fn values_out_of_range_name_variation_key_and_value() {
    let scenario = read(
        "[randomize]\n\"camera.shutter.exposure_ms\" = { uniform = [-5, -4] }\n\
                         \"camera.fps\" = { uniform = [1, 2] }",
    )
    .unwrap();
    let error = scenario.variation(17).unwrap_err().to_string();
    let value = scenario.drawn(17).unwrap()[1].value.to_string();
    assert!(
        error.starts_with(&format!(
            "variation 17 (camera.shutter.exposure_ms = {value}): dir/s.toml:9: \
                                    camera.shutter.exposure_ms: "
        )),
        "{error}"
    );
}

#[test]
fn the_table_draws_the_same_elsewhere() {
    let text = "[randomize]\n\"scene.pattern.image\" = { choice = [\"a.png\", \"/b.png\"] }\n\
                \"camera\" = { choice = [{ photometric = { vignette = \"v.png\" } }] }\nvariations = 4\n\
                \"camera.fps\" = { uniform = [10, 20] }\nown_seed = false";
    let scenario = with(text, &[("randomize.seed", "5")]).unwrap();
    let table = scenario.randomize_table().unwrap().unwrap();
    let here = std::path::absolute("dir/a.png").unwrap();
    assert_eq!(table["scene.pattern.image"]["choice"][0], here.to_str().unwrap());
    let vignette = &table["camera"]["choice"][0]["photometric"]["vignette"];
    assert_eq!(*vignette, std::path::absolute("dir/v.png").unwrap().to_str().unwrap());
    let mut tree: Table = toml::from_str(SCENE).unwrap();
    tree.insert(RANDOMIZE.into(), Value::try_from(&table).unwrap());
    let text = toml::to_string(&tree).unwrap();
    let elsewhere = parse_random_scenario(&text, Path::new("other/s.toml"), &[]).unwrap();
    for index in 0..4 {
        let [a, b] = [&scenario, &elsewhere].map(|scenario| scenario.variation(index).unwrap());
        assert_eq!(a.rig.first().camera.fps, b.rig.first().camera.fps);
        let image = |v: &Variation| {
            v.rig.first().scene.pattern.clone().unwrap().image.file_name().unwrap().to_owned()
        };
        assert_eq!((image(&a), a.seed), (image(&b), b.seed));
    }
    // The later word counts.
    let set = [("camera.fps", "3"), ("randomize.camera.fps", "{ uniform = [10, 20] }")];
    assert!(with("", &set).unwrap().variation(1).unwrap().rig.first().camera.fps >= 10.0);
    let part =
        with(&format!("{RIG}\"cameras.*.fps\" = {{ uniform = [1, 2] }}"), &[("cameras.left.fps", "3")])
            .unwrap();
    assert!(part.randomize_table().unwrap_err().to_string().contains("name each element"));
    let error = read("[randomise]\nx = 1").unwrap_err().to_string();
    assert!(error.contains("did you mean `randomize`"), "{error}");
}

//! The committed figures of `scripts/judges/emva.py`: what the standard's own program finds in camsim's
//! pictures.

#![allow(clippy::unwrap_used, reason = "tests")]

/// Rows of the table: figure, given, found.
fn rows(page: &str) -> Vec<(&str, f64, f64)> {
    page.lines()
        .filter_map(|line| {
            let cells: Vec<&str> = line.trim_matches('|').split('|').map(str::trim).collect();
            let [figure, _, given, found, _] = cells[..] else { return None };
            Some((figure, given.parse().ok()?, found.parse().ok()?))
        })
        .collect()
}

#[test]
fn the_standards_program_finds_the_keys_again() {
    let page = include_str!("../../../docs/results/emva1288.md");
    let rows = rows(page);
    let found = |name: &str| {
        let row = rows.iter().find(|(figure, ..)| *figure == name);
        row.map(|&(_, given, found)| (given, found)).unwrap()
    };
    for figure in [
        "system gain K",
        "quantum efficiency",
        "temporal dark noise",
        "dark current, by mean",
        "DSNU1288",
        "PRNU1288",
    ] {
        let (given, found) = found(figure);
        assert!((found / given - 1.0).abs() < 0.02, "{figure}: {given} {found}");
    }
    // The method's own closed form for this full well and PRNU; docs/results/emva1288.md says why it is below.
    let (full_well_e, saturation_e) = found("saturation capacity");
    assert_eq!(full_well_e, 40_000.0);
    assert!((saturation_e / 38_764.0 - 1.0).abs() < 0.02, "{saturation_e}");
    assert!(found("linearity error").1 < 0.5);
}

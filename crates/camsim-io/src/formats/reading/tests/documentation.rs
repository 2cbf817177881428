//! `docs/reference/inputs/CAMERAS.md`, made from the importers' tables.

use std::fmt::Write as _;

use super::*;
use crate::formats::reading::key_table::{COMMON_KEYS, KeyRow, Treatment};

const PAGE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/reference/inputs/CAMERAS.md");

fn treatment_text(treatment: Treatment) -> String {
    match treatment {
        Treatment::Applied => "applied".to_owned(),
        Treatment::Readout(_) => "applied: readout_ms".to_owned(),
        Treatment::LineDelay(_) => "applied: readout_ms, from the line delay".to_owned(),
        Treatment::FrameRate => "applied: fps".to_owned(),
        Treatment::RollingShutter => "applied: rolling or global shutter".to_owned(),
        Treatment::Refused(neutral) => format!("refused{}", neutral.exception()),
        Treatment::Reported(neutral) => format!("reported{}", neutral.exception()),
        Treatment::Ignored => "ignored".to_owned(),
    }
}

fn table(page: &mut String, keys: &[KeyRow]) {
    page.push_str("\n| key | treatment | meaning |\n|---|---|---|\n");
    for row in keys {
        let (treatment, about) = (treatment_text(row.treatment), row.about.replace('|', "/"));
        for path in row.paths() {
            writeln!(page, "| `{path}` | {treatment} | {about} |").unwrap();
        }
    }
}

fn page() -> String {
    let mut page = String::from(
        "# Supported calibration files\n\nMade from the code by `CAMSIM_BLESS=1 cargo test -p camsim-io \
         --lib reading`. Results for published files are in \
         [CAMERAS-MEASURED.md](CAMERAS-MEASURED.md).\n\n`camsim camera import FILE [--format NAME] [--camera \
         NAME] -o CAMERA.toml`. The format is detected from the content; if it is ambiguous, give \
         `--format`. For a file with several cameras, give `--camera`.\n\nA key is *applied*, *refused* with \
         the file, *reported* in a note, or *ignored*. `*` stands for any part of a name, `**` for \
         everything below. A number under an unknown key is reported too, and a coefficient (`k4`, `p3`, \
         ...) that a format does not have is refused unless it is zero. An identity, a zero or an empty \
         value without effect is not reported.\n\n## All formats\n",
    );
    table(&mut page, COMMON_KEYS);
    page.push_str(
        "\nFrame rate and shutter are read under further names: `line_delay`, `row_time`, `readout_time`, \
         `rolling_shutter_time`, `shutter_type`, `global_shutter`, `readout_direction`, `fps`, `frame_rate`, \
         ... with a unit suffix (`_ns`, `_us`, `_ms`, `_s`). Without a unit, the only one with a readout of \
         0.5 to 250 ms is used and reported. Contradicting values are refused. The readout time is the line \
         delay times the rows of the picture (see [CONVENTIONS.md](../../theory/CONVENTIONS.md)).\n",
    );
    for format in CameraFormat::ALL.into_iter().filter(|format| *format != CameraFormat::OpenCvFisheye) {
        write!(page, "\n## {}: `--format {}`\n", format.row().title, format.name()).unwrap();
        if format == CameraFormat::OpenCv {
            page.push_str(
                "\n`--format opencv-fisheye` reads the same files with the coefficients of OpenCV's fisheye \
                 module.\n",
            );
        }
        for (about, keys) in format.row().tables {
            if !about.is_empty() {
                write!(page, "\nOf {about}:\n").unwrap();
            }
            table(&mut page, keys);
        }
    }
    page
}

#[test]
fn documentation_page_matches_the_tables() {
    let page = page();
    if std::env::var_os("CAMSIM_BLESS").is_some() {
        std::fs::create_dir_all(Path::new(PAGE).parent().unwrap()).unwrap();
        std::fs::write(PAGE, &page).unwrap();
    }
    let written = std::fs::read_to_string(PAGE).unwrap_or_default();
    assert!(
        written == page,
        "docs/reference/inputs/CAMERAS.md differs from the tables: run with CAMSIM_BLESS=1"
    );
}

#[test]
fn tables_have_no_duplicate_keys() {
    for format in CameraFormat::ALL {
        for (_, keys) in format.row().tables {
            let mut paths: Vec<&str> = keys.iter().flat_map(KeyRow::paths).collect();
            paths.sort_unstable();
            paths.windows(2).for_each(|pair| assert_ne!(pair[0], pair[1], "{}", format.name()));
        }
    }
}

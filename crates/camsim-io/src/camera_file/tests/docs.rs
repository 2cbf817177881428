//! docs/inputs/CAMERAS.md, made of the importers' own tables.

use std::fmt::Write as _;

use super::super::keys::{EVERYWHERE, Key, Use};
use super::*;

const PAGE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/inputs/CAMERAS.md");

fn what(use_: Use) -> String {
    match use_ {
        Use::Applied => "applied".to_owned(),
        Use::Readout(_) => "applied: readout_ms".to_owned(),
        Use::LineDelay(_) => "applied: readout_ms, times the rows".to_owned(),
        Use::Rate => "applied: fps".to_owned(),
        Use::Rolling => "applied: whether there is a readout".to_owned(),
        Use::Refused(neutral) => format!("refused{}", neutral.words()),
        Use::Named(neutral) => format!("named{}", neutral.words()),
        Use::Silent => "no picture depends on it".to_owned(),
    }
}

fn table(page: &mut String, keys: &[Key]) {
    page.push_str("\n| key | what becomes of it | what it is |\n|---|---|---|\n");
    for key in keys {
        writeln!(page, "| `{}` | {} | {} |", key.path, what(key.use_), key.about.replace('|', "/")).unwrap();
    }
}

fn page() -> String {
    let mut page = String::from(
        "# Calibration files that can be imported\n\nMade from the code by `CAMSIM_BLESS=1 cargo test -p camsim-io --lib camera_file`. What published files give is in \
         [CAMERAS-MEASURED.md](CAMERAS-MEASURED.md).\n\n`camsim camera import FILE [--format NAME] [--camera NAME] -o CAMERA.toml`. The content tells the format; where it fits several, or leaves two readings open, the import asks. Of several cameras in a file it asks which.\n\nA key is *applied*, or the file is *refused*, or the key is *named* in a \
         note; `*` stands for any part of a name, `**` for everything below. A number under a key that no table knows is named too, and a coefficient (`k4`, `p3`, ...) that a format \
         does not have is refused unless it is zero. An identity, a zero or an empty value that changes nothing is not spoken of.\n\n## In every format\n",
    );
    table(&mut page, EVERYWHERE);
    page.push_str(
        "\nFrame rate and shutter are also found under other names than a format's own: `line_delay`, `row_time`, `readout_time`, `rolling_shutter_time`, `shutter_type`, \
         `global_shutter`, `readout_direction`, `fps`, `frame_rate`, ... with a unit behind (`_ns`, `_us`, `_ms`, `_s`). Without a unit, the one in which a readout lasts 0.5 to 250 \
         ms is taken and named; there is never more than one. Two that disagree are refused. A delay of a line times the rows of the picture is the readout from the first row to the \
         last (CONVENTIONS.md counts it as rows times the time from one to the next).\n",
    );
    for format in CameraFormat::ALL.into_iter().filter(|format| *format != CameraFormat::OpenCvFisheye) {
        write!(page, "\n## {}: `--format {}`\n", format.title(), format.name()).unwrap();
        if format == CameraFormat::OpenCv {
            page.push_str("\n`--format opencv-fisheye` reads the same files with the coefficients of OpenCV's fisheye module.\n");
        }
        for (about, keys) in format.tables() {
            if !about.is_empty() {
                write!(page, "\nOf {about}:\n").unwrap();
            }
            table(&mut page, keys);
        }
    }
    page
}

#[test]
fn the_page_on_inputs_is_that_of_the_tables() {
    let page = page();
    if std::env::var_os("CAMSIM_BLESS").is_some() {
        std::fs::create_dir_all(Path::new(PAGE).parent().unwrap()).unwrap();
        std::fs::write(PAGE, &page).unwrap();
    }
    let written = std::fs::read_to_string(PAGE).unwrap_or_default();
    assert!(written == page, "docs/inputs/CAMERAS.md is not what the tables say: run with CAMSIM_BLESS=1");
}

#[test]
fn no_table_has_a_key_twice() {
    for format in CameraFormat::ALL {
        for (_, keys) in format.tables() {
            let mut paths: Vec<&str> = keys.iter().map(|key| key.path).collect();
            paths.sort_unstable();
            paths.windows(2).for_each(|pair| assert_ne!(pair[0], pair[1], "{}", format.name()));
        }
    }
}

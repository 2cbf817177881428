//! Test helper: compares pages of `docs/reference/inputs` with those generated from the readers' tables.

use std::path::Path;

/// Compares a generated page with its file, or writes the file if `CAMSIM_BLESS` is 1.
pub(crate) fn check(name: &str, page: &str) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/reference/inputs").join(name);
    if std::env::var_os("CAMSIM_BLESS").is_some_and(|bless| bless == "1") {
        let written =
            path.parent().map_or(Ok(()), std::fs::create_dir_all).and_then(|()| std::fs::write(&path, page));
        written.unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    }
    let file = std::fs::read_to_string(&path).unwrap_or_default();
    assert_eq!(file, page, "{} is out of date: write it with CAMSIM_BLESS=1", path.display());
}

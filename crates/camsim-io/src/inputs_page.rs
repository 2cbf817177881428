//! Pages of `docs/inputs`, which are made from the readers' own tables.

use std::path::Path;

/// Holds a page against its file, or writes it if `CAMSIM_BLESS` is 1.
pub(crate) fn check(name: &str, page: &str) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/inputs").join(name);
    if std::env::var_os("CAMSIM_BLESS").is_some_and(|bless| bless == "1") {
        let written =
            path.parent().map_or(Ok(()), std::fs::create_dir_all).and_then(|()| std::fs::write(&path, page));
        written.unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    }
    let found = std::fs::read_to_string(&path).unwrap_or_default();
    assert_eq!(
        found,
        page,
        "{} is not what the reader says: write it anew with CAMSIM_BLESS=1",
        path.display()
    );
}

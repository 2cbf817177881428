//! Names of the user's that become names of files and folders.

/// Names that some systems give to devices.
const DEVICES: &[&str] = &["con", "prn", "aux", "nul"];
const MOST_LETTERS: usize = 64;

/// Rest of the sentence "give it a name of ...".
pub(super) const ADVICE: &str =
    "1 to 64 letters, digits, - and _, and not a device of some systems (con, prn, aux, nul)";

/// Whether every system takes a name for a file or folder.
pub(super) fn is_portable(name: &str) -> bool {
    !name.is_empty()
        && name.len() <= MOST_LETTERS
        && name.bytes().all(|byte| byte.is_ascii_alphanumeric() || byte == b'-' || byte == b'_')
        && !DEVICES.iter().any(|device| name.eq_ignore_ascii_case(device))
}

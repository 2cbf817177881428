//! The camsim command line.

//! Experiments on the whole of camsim: run time against error (`camsim bench`), and the paper's section 8
//! (`camsim reproduce`).

pub mod bench;
pub mod cases;
pub mod plot;
pub mod reproduce;
pub mod timing;

//! What is on show.

use std::{convert::Infallible, sync::Arc};

use camsim_gpu::{AdapterChoice, Engine};
use camsim_io::{load::load_sequence, scenario_file::read_scenario, write::write_picture};

use super::harness::{Window, demo};

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn the_picture_on_show_is_what_render_writes() {
    let mut window = Window::open(Some(demo()));
    window.settle();
    window.state_mut().timeline.seek(17);
    window.settle();
    let of_view = window.state().heard.picture().expect("a picture").image.clone();

    let scenario = read_scenario(&demo(), &[], None).expect("legal");
    let sequence = load_sequence(&scenario).expect("loaded").sequence;
    let engine = Engine::new(AdapterChoice::Best).expect("an adapter");
    let mut session = engine.session::<Infallible>(Arc::clone(&sequence), &scenario.output.channels).expect("a session");
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("frame.png");
    let mut write = |finished: camsim_gpu::engine::Finished| {
        write_picture(&path, &finished.frame, scenario.camera.photometric.output).expect("written");
        Ok(())
    };
    session.render::<Infallible>([17], &mut write).expect("rendered");
    let written = image::open(&path).expect("a picture").to_rgba8();
    assert_eq!(of_view.size, [written.width() as usize, written.height() as usize]);
    for (place, (shown, written)) in of_view.pixels.iter().zip(written.pixels()).enumerate() {
        assert_eq!(shown.to_array(), written.0, "pixel {place}");
    }
}

//! Tracks: a ray of the reference through the position of each, at the instant of its row, meets its point.

use std::{collections::BTreeSet, path::PathBuf, sync::Arc};

use camsim_core::{
    reference::ReferenceRenderer,
    scenario::{
        Channel, FieldOr, LensSpec, PointSource, Readout, Scenario, ShutterSpec, TracksSpec, ZoomSpec,
    },
    scene::{
        Mesh, RigidMotion, Scene,
        motion::{Between, Curve, Joint, JointFrame, Keys, Track},
    },
    sequence::Sequence,
    tracks::{Sighting, TrackPoint},
};
use camsim_plan::{Planner, Tracks};
use glam::{DQuat, DVec2, DVec3};

use super::fixtures::{Steady, block, hills, scenario, sequence, tangential};

const SIZE_PX: [u32; 2] = [160, 120];
const FRAMES: u64 = 4;

/// A drift while the whole turns about the origin.
fn motion() -> Arc<RigidMotion> {
    let (times_s, drift_m) = (vec![-1.0, 1.0], DVec3::new(6.0, -9.0, -2.0));
    let turns = [-0.05, 0.05].map(DQuat::from_rotation_z).to_vec();
    let keys = Keys {
        position: Curve::new(times_s.clone(), vec![-drift_m, drift_m], Between::Linear).unwrap(),
        rotation: Curve::new(times_s, turns, Between::Linear).unwrap(),
        start_s: 0.0,
        repeat: None,
    };
    Arc::new(RigidMotion::new(vec![Joint::new(JointFrame::IDENTITY, Track::Keys(keys))]))
}

/// Houses on hills, every third of which moves, with points of the terrain, of the houses, and a cloud of
/// given ones around the ground.
fn tracked(change: impl FnOnce(&mut Scenario)) -> (Arc<Sequence>, Tracks) {
    let mut scenario = scenario();
    let camera = &mut scenario.camera;
    (camera.size_px, camera.focal_px) = (SIZE_PX, [120.0, 121.0]);
    camera.mount.angles_deg = [3.0, -60.0, 0.0];
    camera.lens = tangential();
    camera.shutter =
        ShutterSpec { readout_ms: 33.0, exposure_ms: 8.0, delay_ms: 4.0, ..ShutterSpec::default() };
    scenario.output.tracks = Some(TracksSpec {
        points: vec![PointSource::Terrain, PointSource::Vertices, PointSource::Table(PathBuf::from("p.csv"))],
        count: 300,
    });
    change(&mut scenario);
    let terrain = hills(120, 8.0);
    let position = |k: usize, step: f64| (k as f64 * step + 0.3).fract() - 0.5;
    let motion = motion();
    let houses = (0..60).map(|k| {
        let (n, e) = (500.0 * position(k, 0.618_034), 500.0 * position(k, 0.414_214));
        let down = terrain.down_at(n, e).unwrap_or(0.0);
        let house = block(DVec3::new(n, e, down), 6.0, 4.0 + (k % 9) as f64);
        Mesh { motion: (k % 3 == 0).then(|| motion.clone()), ..house }
    });
    let meshes = houses.collect();
    let cloud = (0..900).map(|k| TrackPoint {
        source: "p.csv".into(),
        name: k.to_string(),
        position_ned_m: DVec3::new(
            700.0 * position(k, 0.618_034),
            700.0 * position(k, 0.414_214),
            80.0 * position(k, 0.732_051),
        ),
        moves_with: None,
    });
    let given = [Vec::new(), Vec::new(), cloud.collect()];
    let scene = Scene { terrain: Some(terrain), meshes, ..Scene::default() };
    let mut sequence = Arc::unwrap_or_clone(sequence(scenario, Steady::moving(160.0), scene));
    (sequence.frames, sequence.zoom_track) = (FRAMES, vec![(-1.0, 1.0), (1.0, 2.0)]);
    if sequence.scenario.camera.zoom.is_empty() {
        sequence.zoom_track.clear();
    }
    let sequence = Arc::new(sequence);
    let planner = Planner::new(sequence.clone(), &[Channel::Color], 16_384).unwrap();
    let tracks = Tracks::new(&planner, &given).unwrap();
    (sequence, tracks)
}

/// Distance of a point from the reference's ray at a sighting, and of their instants. The reference knows the time of
/// each row; between two rows of a field time is linear.
fn misses(reference: &ReferenceRenderer, frame: u64, point_ned_m: DVec3, sighting: &Sighting) -> (f64, f64) {
    let view = reference.view(frame);
    let Sighting { seen, .. } = sighting;
    let shutter = &reference.sequence().scenario.camera.shutter;
    let is_sideways = matches!(shutter.readout, Readout::LeftToRight | Readout::RightToLeft);
    // Of the nearest rows, the one whose field sees the point: a row of the other is half a period away.
    let [x, y] = seen.px.round().to_array().map(|value| value as i64);
    let inside = [[x, y], [x, y - 1], [x, y + 1]]
        .into_iter()
        .filter(|pixel| (0..2).all(|k| (0..i64::from(SIZE_PX[k])).contains(&pixel[k])));
    let of_pixel = |pixel: [i64; 2]| {
        let pixel = pixel.map(|value| value as u32);
        let offset_px = seen.px - DVec2::from_array(pixel.map(f64::from));
        // Time from a row of the field to the next but one.
        let (axis, step) = if is_sideways { (0, 1) } else { (1, 2) };
        let mut beside = pixel;
        let forward = pixel[axis] + step < SIZE_PX[axis];
        beside[axis] = if forward { pixel[axis] + step } else { pixel[axis] - step };
        let sign = if forward { 1.0 } else { -1.0 };
        let slope = sign * (view.mid_s(beside) - view.mid_s(pixel)) / f64::from(step);
        let later_s = offset_px[axis] * slope;
        let sample = view.sample(pixel, offset_px, later_s / (1e-3 * shutter.exposure_ms)).unwrap();
        let ray = sample.pose.ned_from_camera * sample.uv.extend(1.0);
        let to_point = point_ned_m - sample.pose.position_ned_m;
        (to_point.cross(ray).length() / (ray.length() * to_point.length()), (sample.t_s - seen.t_s).abs())
    };
    inside.map(of_pixel).min_by(|a, b| a.1.total_cmp(&b.1)).unwrap()
}

#[test]
fn the_reference_sees_each_point_where_its_track_is() {
    type Change = fn(&mut Scenario);
    let shutters: [(&str, Change); 6] = [
        ("rolling", |_| ()),
        ("global", |s| s.camera.shutter.readout_ms = 0.0),
        ("from below", |s| s.camera.shutter.readout = Readout::BottomToTop),
        ("columns", |s| s.camera.shutter.readout = Readout::RightToLeft),
        ("interlaced", |s| s.camera.shutter.interlace_ms = FieldOr::Field),
        ("zoom", |s| {
            let lens = |at: f64, focal: f64, k1: f64| ZoomSpec {
                at,
                focal_px: [focal, focal],
                principal_point_px: None,
                coefficients: vec![k1, 0.02, 0.001, 0.0],
            };
            s.camera.lens = LensSpec { coefficients: Vec::new(), ..tangential() };
            s.camera.zoom = vec![lens(1.0, 110.0, -0.2), lens(2.0, 150.0, -0.1)];
        }),
    ];
    for (name, change) in shutters {
        let (sequence, tracks) = tracked(change);
        let reference = ReferenceRenderer::new(sequence).unwrap();
        let (mut all, mut hidden, mut unlike, mut moving) = (0, 0, 0, 0);
        for frame in 0..FRAMES {
            for sighting in tracks.sightings(frame).unwrap() {
                let point = &tracks.points()[sighting.point];
                let t_s = sighting.seen.t_s;
                let state = point.moves_with.map(|_| motion().state(t_s));
                let now_ned_m = state.map_or(point.position_ned_m, |state| state.point(point.position_ned_m));
                let (off, off_s) = misses(&reference, frame, now_ned_m, &sighting);
                assert!(off < 1e-8 && off_s < 1e-9, "{name}: {off:.1e}, {off_s:.1e} s: {sighting:?}");
                let camera_ned_m = sighting.seen.pose.position_ned_m;
                let is_hidden = reference.is_occluded_at(t_s, camera_ned_m, now_ned_m);
                moving += usize::from(state.is_some() && sighting.is_visible);
                unlike += usize::from(is_hidden == sighting.is_visible);
                hidden += usize::from(!sighting.is_visible);
                all += 1;
            }
        }
        // The cloud's half below the ground is hidden, and some of what is behind houses and hills.
        assert!(all > 1000 && hidden > all / 10 && hidden < all * 9 / 10, "{name}: {hidden} of {all}");
        assert!(moving > 50, "{name}: {moving} visible on what moves");
        // Points closer to a surface than the tolerances of both, which differ.
        assert!(unlike <= all / 500, "{name}: {unlike} of {all} are hidden for one of them");
    }
}

#[test]
fn points_are_those_that_frames_see_without_repeats() {
    let (_, tracks) = tracked(|_| ());
    let of = |source: &str| {
        let points = tracks.points().iter().filter(|point| point.source == source);
        points.collect::<Vec<_>>()
    };
    assert!(tracks.notes().is_empty() && of("p.csv").len() == 900, "{:?}", tracks.notes());
    for source in ["terrain", "vertices"] {
        let points = of(source);
        assert!(points.len() > 50 && points.len() <= 300, "{source}: {}", points.len());
        let positions: BTreeSet<[u64; 3]> =
            points.iter().map(|point| point.position_ned_m.to_array().map(f64::to_bits)).collect();
        let names: BTreeSet<&String> = points.iter().map(|point| &point.name).collect();
        assert_eq!((positions.len(), names.len()), (points.len(), points.len()), "{source}");
    }
    // The terrain's corners are on one grid.
    let columns = |k: usize| {
        let number = |point: &&TrackPoint| point.name.split('/').nth(k).unwrap().parse::<i64>().unwrap();
        of("terrain").iter().map(number).collect::<BTreeSet<i64>>().into_iter().collect::<Vec<_>>()
    };
    let steps: BTreeSet<i64> = (0..2)
        .flat_map(|k| columns(k).windows(2).map(|pair| pair[1] - pair[0]).collect::<Vec<_>>())
        .collect();
    let step = *steps.first().unwrap();
    assert!(steps.iter().all(|other| other % step == 0), "{steps:?}");
    // A point that the choice has found visible is so in one of the frames, up to the readout.
    let visible: BTreeSet<usize> = (0..FRAMES)
        .flat_map(|frame| tracks.sightings(frame).unwrap())
        .filter(|sighting| sighting.is_visible)
        .map(|sighting| sighting.point)
        .collect();
    let chosen = of("terrain").len() + of("vertices").len();
    let seen = visible.iter().filter(|&&point| tracks.points()[point].source != "p.csv").count();
    assert!(seen * 20 >= chosen * 19, "{seen} of {chosen}");
    // Another seed, other corners; the same seed, the same.
    let names = |tracks: &Tracks| tracks.points().iter().map(|point| point.name.clone()).collect::<Vec<_>>();
    assert_eq!(names(&tracked(|_| ()).1), names(&tracks));
    assert_ne!(names(&tracked(|s| s.seed += 1).1), names(&tracks));
}

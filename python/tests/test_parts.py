"""Lenses, trajectories, sensors, boards, comparison, apply, and inputs from arrays."""

from __future__ import annotations

import json
import pathlib
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import camsim
from conftest import ROOT, SMALL, run_program
from readers import numbers, read_exr, read_png, read_table

BROWN = [-0.28, 0.07, 0.0006, -0.0004, -0.006, 0.01, 0.002, -0.001]
LENSES: dict[str, list[float]] = {
    "pinhole": [],
    "brown-conrady": BROWN,
    "brown-conrady-prism": [*BROWN, 1e-3, -4e-4, 2e-3, 3e-4, 0.01, -0.02],
    "kannala-brandt": [-0.02, 0.004, -0.003, 0.0005],
    "mei": [0.6, -0.2, 0.05, 1e-3, -5e-4],
    "double-sphere": [-0.24, 0.56],
    "fisheye624": [-0.02, 0.01, -0.006, 0.001, 0.0, 0.0, 2e-4, -1e-4, 1e-4, 0.0, -1e-4, 0.0],
    "equirectangular": [],
}


def lens_of(model: str) -> camsim.Lens:
    return camsim.Lens((640, 480), (420.0, 421.0), (318.3, 241.2), model=model, coefficients=LENSES[model])


def pixels(count: int) -> NDArray[np.float64]:
    return np.random.default_rng(5).uniform([0.0, 0.0], [639.0, 479.0], (count, 2))


@pytest.mark.parametrize("model", LENSES)
def test_lenses_there_and_back(model: str) -> None:
    lens = lens_of(model)
    at = pixels(5000)
    rays = lens.unproject(at)
    assert rays.shape == (5000, 3) and np.allclose(np.linalg.norm(rays, axis=1), 1.0, rtol=0, atol=2e-15)
    assert np.abs(lens.project(rays) - at).max() < 1e-9
    assert np.abs(lens.project(7.5 * rays) - at).max() < 1e-9
    assert np.abs(lens.distort(lens.undistort(at)) - at).max() < 1e-9
    assert lens.valid(rays).all()
    step = 1e-6
    for axis in range(3):
        moved = step * np.eye(3)[axis]
        slope = (lens.project(rays + moved) - lens.project(rays - moved)) / (2 * step)
        # Central differences: rounding of 1e-13 px by the step, and its square.
        assert np.abs(slope - lens.jacobian(rays)[:, :, axis]).max() < 1e-4
    # What is not imaged has no pixel: rays behind a plane, and the axis of no lens.
    behind = -rays
    assert np.array_equal(np.isfinite(lens.project(behind)).all(axis=1), lens.valid(behind))
    assert np.array_equal(np.isfinite(lens.jacobian(behind)).all(axis=(1, 2)), lens.valid(behind))
    if model in ("pinhole", "brown-conrady", "brown-conrady-prism"):
        assert not lens.valid(behind).any()
    unknown = [[0.0, 0.0, 0.0], [np.nan, 0.0, 1.0], [0.0, 0.0, np.inf]]
    assert not lens.valid(unknown).any()


def test_lenses_see_beyond_90_degrees() -> None:
    k1, k2, k3, k4 = LENSES["kannala-brandt"]
    wide = camsim.Lens((1280, 1280), (300.0, 300.0), model="kannala-brandt", coefficients=[k1, k2, k3, k4])
    theta, phi = np.random.default_rng(9).uniform([0.0, -np.pi], [2.2, np.pi], (4000, 2)).T
    rays = np.c_[np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)]
    radius = 300.0 * theta * (1 + theta**2 * (k1 + theta**2 * (k2 + theta**2 * (k3 + theta**2 * k4))))
    wanted = 639.5 + radius[:, None] * np.c_[np.cos(phi), np.sin(phi)]
    assert (theta > np.pi / 2).sum() > 1000 and wide.valid(rays).all()
    assert np.abs(wide.project(rays) - wanted).max() < 1e-9
    assert np.abs(wide.unproject(wanted) - rays).max() < 1e-13
    # A plane ends at 89 degrees.
    ideal = wide.undistort(wanted)
    before = theta < np.radians(89)
    assert np.isnan(ideal[~before]).all()
    assert np.abs(ideal[before] / (rays[before, :2] / rays[before, 2:]) - 1).max() < 1e-11
    panorama = camsim.Lens((1256, 628), (200.0, 200.0), model="equirectangular")
    longitude = np.arctan2(rays[:, 0], rays[:, 2])
    assert np.abs(panorama.project(rays)[:, 0] - (627.5 + 200.0 * longitude)).max() < 1e-9


def test_lenses_fold_where_their_formula_does() -> None:
    # r (1 - 0.3 r^2) is largest, 0.70273, at r = 1.0541.
    lens = camsim.Lens((640, 480), (300.0, 300.0), (0.0, 0.0), model="brown-conrady", coefficients=[-0.3])
    at = np.c_[np.linspace(0.0, 639.0, 5000), np.zeros(5000)]
    inside = at[:, 0] < 300.0 * 0.70272
    ideal = lens.undistort(at)
    assert np.isfinite(ideal[inside]).all() and np.isnan(ideal[at[:, 0] > 300.0 * 0.70274]).all()
    assert (ideal[inside, 0] < 1.0542).all() and np.array_equal(np.isnan(lens.unproject(at)), np.isnan(ideal[:, [0, 1, 1]]))
    u = ideal[inside, 0]
    assert np.abs(300.0 * u * (1 - 0.3 * u * u) - at[inside, 0]).max() < 1e-9
    assert not lens.valid([[1.06, 0.0, 1.0]])[0] and lens.valid([[1.05, 0.0, 1.0]])[0]


def test_pixels_have_one_inverse() -> None:
    """However many are asked for at once, and in whatever order."""
    for model in LENSES:
        lens, at = lens_of(model), pixels(3000)
        ideal, rays = lens.undistort(at), lens.unproject(at)
        for k in (0, 17, 1023, 1024, 2999):
            assert np.array_equal(lens.undistort(at[k : k + 1]), ideal[k : k + 1])
            assert np.array_equal(lens.unproject(at[k : k + 1]), rays[k : k + 1])
        assert np.array_equal(lens.undistort(at[::-1]), ideal[::-1])


def test_brown_conrady_is_the_formula() -> None:
    k1, k2, p1, p2, k3, k4, k5, k6 = LENSES["brown-conrady"]
    u, v = np.random.default_rng(6).uniform(-0.7, 0.7, (2, 1000))
    r2 = u * u + v * v
    radial = (1 + r2 * (k1 + r2 * (k2 + r2 * k3))) / (1 + r2 * (k4 + r2 * (k5 + r2 * k6)))
    x = u * radial + 2 * p1 * u * v + p2 * (r2 + 2 * u * u)
    y = v * radial + p1 * (r2 + 2 * v * v) + 2 * p2 * u * v
    expected = np.c_[420.0 * x + 318.3, 421.0 * y + 241.2]
    lens = lens_of("brown-conrady")
    assert np.abs(lens.distort(np.c_[u, v]) - expected).max() < 1e-10
    assert np.array_equal(lens.matrix @ [0, 0, 1], [318.3, 241.2, 1])


def test_lenses_are_those_of_the_command_line(tmp_path: pathlib.Path) -> None:
    at = pixels(50)
    table = tmp_path / "pixels.csv"
    table.write_text("x_px,y_px\n" + "".join(f"{x!r},{y!r}\n" for x, y in at.tolist()))
    told = tmp_path / "ideal.csv"
    run_program("lens", "assets/demo_camera.toml", "undistort", "--points", table, "-o", told)
    lens = camsim.Lens.load(ROOT / "assets" / "demo_camera.toml")
    assert np.array_equal(lens.undistort(at), numbers(read_table(told), "u", "v"))
    assert camsim.Scenario.load(ROOT / "assets" / "demo.toml").lens.coefficients == lens.coefficients


def test_wrong_lenses() -> None:
    with pytest.raises(camsim.InputError, match="at most 4 coefficients"):
        camsim.Lens((64, 48), (40, 40), model="kannala-brandt", coefficients=[0] * 5)
    with pytest.raises(camsim.InputError, match="model"):
        camsim.Lens((64, 48), (40, 40), model="fish")
    with pytest.raises(camsim.InputError, match=r"\(N, 3\)"):
        lens_of("pinhole").project(np.zeros((4, 2)))
    assert lens_of("pinhole").project(np.zeros((0, 3))).shape == (0, 2)


def test_trajectories_are_the_tables(tmp_path: pathlib.Path) -> None:
    words = ["track", "assets/demo.toml", "--quiet"]
    body, camera = tmp_path / "body.csv", tmp_path / "camera.csv"
    run_program(*words, "-o", body)
    run_program(*words, "--of", "camera", "-o", camera)
    trajectory = camsim.Scenario.load(ROOT / "assets" / "demo.toml").trajectory
    table = read_table(body)
    states = trajectory.at(numbers(table, "t_s")[:, 0])
    # Instants of the tables are rounded to a nanosecond, at 75 m/s and 1 rad/s.
    assert np.abs(states.position_ned_m - numbers(table, "n_m", "e_m", "d_m")).max() < 1e-6
    assert np.abs(states.velocity_ned_m_s - numbers(table, "vn", "ve", "vd")).max() < 1e-6
    assert np.abs(states.ned_from_body_wxyz - numbers(table, "qw", "qx", "qy", "qz")).max() < 1e-6
    table = read_table(camera)
    seen = trajectory.camera_at(numbers(table, "t_s")[:, 0])
    assert np.abs(seen.position_ned_m - numbers(table, "n_m", "e_m", "d_m")).max() < 1e-6
    assert np.abs(seen.rate_camera_rad_s - numbers(table, "wx", "wy", "wz")).max() < 1e-5


def test_trajectories_at_instants_of_rows(demo: pathlib.Path) -> None:
    scenario = camsim.Scenario.load(demo, sets=SMALL)
    rows = scenario[4].rows
    seen = scenario.trajectory.camera_at_ns(rows.t_mid_ns)
    assert np.abs(seen.position_ned_m - rows.position_ned_m).max() < 1e-6
    one = scenario.trajectory.at_ns(int(rows.t_mid_ns[0]))
    assert one.position_ned_m.shape == (3,) and one.ned_from_body_wxyz.shape == (4,)
    first_s, last_s = scenario.trajectory.span_s
    inside = np.linspace(first_s + 1, last_s - 1, 200)
    step = 1e-5
    slope = (scenario.trajectory.at(inside + step).position_ned_m - scenario.trajectory.at(inside - step).position_ned_m) / (2 * step)
    # Central differences over 20 us of at most 20 m/s^2.
    assert np.abs(slope - scenario.trajectory.at(inside).velocity_ned_m_s).max() < 1e-3


SENSORS: dict[str, Any] = {
    "imu": [{"name": "imu0", "rate_hz": 200, "gyro": {"noise_density": 1.7e-4, "random_walk": 2e-5}, "accel": {"noise_density": 2e-3, "range": 11.8}}],
    "gnss": [{"name": "gnss0", "sigma_m": [1.5, 3.0]}],
    "barometer": [{"name": "baro0"}],
    "magnetometer": [{"name": "mag0", "date": "2025-06-01"}],
}


def test_sensors_are_their_tables(pattern: pathlib.Path, tmp_path: pathlib.Path) -> None:
    scenario = camsim.Scenario.load(pattern, sets=SENSORS)
    file = tmp_path / "sensors.toml"
    file.write_text(scenario.to_toml(), encoding="utf-8")
    run_program("track", file, "--sensors", tmp_path / "out", "-o", tmp_path / "track.csv", "--quiet")
    folder = tmp_path / "out"
    tables = {path.stem: read_table(path) for path in folder.rglob("*.csv")}
    imu, table = scenario.imu(), tables["imu0"]
    assert imu.t_ns.tolist() == [int(cell) for cell in table["t_ns"]] and len(imu) == len(table["t_ns"])
    assert np.array_equal(imu.gyro_rad_s, numbers(table, *(f"gyro_{axis}_rad_s" for axis in "xyz")))
    assert np.array_equal(imu.true_accel_m_s2, numbers(table, *(f"true_accel_{axis}_m_s2" for axis in "xyz")))
    assert np.array_equal(imu.ned_from_sensor_wxyz, numbers(table, "true_qw", "true_qx", "true_qy", "true_qz"))
    assert np.array_equal(imu.is_saturated, numbers(table, "is_saturated")[:, 0])
    assert imu.is_saturated.dtype == np.bool_ and imu.is_saturated.any() and not imu.is_saturated.all()
    gnss, table = scenario.gnss("gnss0"), tables["gnss0"]
    assert np.array_equal(np.c_[gnss.lat_deg, gnss.lon_deg, gnss.height_m], numbers(table, "lat_deg", "lon_deg", "height_m"))
    assert gnss.has_fix.all() and np.array_equal(gnss.true_velocity_ned_m_s[:, 0], numbers(table, "true_vn_m_s")[:, 0])
    barometer = scenario.barometer()
    assert np.array_equal(barometer.pressure_pa, numbers(tables["baro0"], "pressure_pa")[:, 0])
    magnetometer = scenario.magnetometer()
    assert np.array_equal(magnetometer.mag_ut, numbers(tables["mag0"], "mag_x_ut", "mag_y_ut", "mag_z_ut"))
    with pytest.raises(camsim.InputError, match="there are imu0"):
        scenario.imu("imu1")


def test_boards_are_those_of_the_command_line(pattern: pathlib.Path, tmp_path: pathlib.Path) -> None:
    keys = {"kind": "chessboard", "columns": 5, "rows": 4, "size_m": 0.04, "at": [1.0, 2.0, -3.0], "angles_deg": [0, 90, 0]}
    scenario = camsim.Scenario.load(pattern, sets={"scene.board": keys})
    file = tmp_path / "board.toml"
    file.write_text(scenario.to_toml(), encoding="utf-8")
    run_program("board", file, "-o", tmp_path / "board.png", "--points", tmp_path / "points.csv")
    board, table = camsim.board(scenario), read_table(tmp_path / "points.csv")
    assert board.ids.tolist() == [int(cell) for cell in table["id"]]
    assert np.array_equal(board.points_m, numbers(table, "x_m", "y_m"))
    assert board.points_ned_m is not None and np.array_equal(board.points_ned_m, numbers(table, "n_m", "e_m", "d_m"))
    stored = read_png(tmp_path / "board.png")
    assert stored.shape == board.picture.shape and np.array_equal(stored > 127, board.picture > 54)
    alone = camsim.board({"kind": "chessboard", "columns": 5, "rows": 4, "size_m": 0.04})
    assert np.array_equal(alone.points_m, board.points_m) and alone.points_ned_m is None
    with pytest.raises(camsim.InputError, match="unknown field `square_m`"):
        camsim.board({"kind": "chessboard", "square_m": 1})


def test_comparison_is_that_of_the_command_line(demo: pathlib.Path, tmp_path: pathlib.Path) -> None:
    scenario = camsim.Scenario.load(demo, sets=SMALL)
    one, other = scenario[0].color, scenario.replace({"camera.shutter.exposure_ms": 0})[0].color
    paths = [tmp_path / "one.exr", tmp_path / "other.exr"]
    scenario[0].save(paths[0])
    scenario.replace({"camera.shutter.exposure_ms": 0})[0].save(paths[1])
    told = json.loads(run_program("compare", *paths, "--json"))
    compared = camsim.compare(one, other)
    assert compared.rmse == told["rmse"] > 0 and compared.ssim == told["ssim"] and compared.psnr_db == told["psnr_db"]
    assert camsim.compare(*paths) == compared
    difference = (one[..., :3] - other[..., :3]).astype(np.float64)
    assert np.isclose(compared.rmse, np.sqrt(np.mean(difference**2)), rtol=1e-6)
    with pytest.raises(camsim.InputError, match="size"):
        camsim.compare(one, other[1:])


def test_apply_is_that_of_the_command_line(tmp_path: pathlib.Path) -> None:
    random = np.random.default_rng(8)
    color = random.integers(0, 256, (60, 80, 3), dtype=np.uint8)
    depth = random.uniform(5, 50, (60, 80)).astype(np.float32)
    (tmp_path / "color.ppm").write_bytes(b"P6 80 60 255\n" + color.tobytes())
    (tmp_path / "depth.pfm").write_bytes(b"Pf\n80 60\n-1.0\n" + depth[::-1].astype("<f4").tobytes())
    keys: dict[str, Any] = {"size_px": [64, 48], "focal_px": [60.0, 60.0], "fps": 30.0}
    keys["lens"] = {"model": "brown-conrady", "coefficients": [-0.1]}
    keys["shutter"] = {"readout_ms": 20.0, "exposure_ms": 4.0}
    (tmp_path / "camera.toml").write_text(
        "size_px = [64, 48]\nfocal_px = [60.0, 60.0]\nfps = 30.0\n"
        '[lens]\nmodel = "brown-conrady"\ncoefficients = [-0.1]\n[shutter]\nreadout_ms = 20.0\nexposure_ms = 4.0\n'
    )
    (tmp_path / "frame.toml").write_text(
        'color = "color.ppm"\ndepth = "depth.pfm"\ndepth_rows = "bottom-up"\nfocal_px = [70.0, 70.0]\n'
        "[motion]\nvelocity_m_s = [3.0, 0.0, 1.0]\nangular_rate_rad_s = [0.0, 0.4, 0.1]\n"
    )
    run_program("apply", tmp_path / "camera.toml", tmp_path / "frame.toml", "-o", tmp_path / "out.exr", "--quiet")
    motion = camsim.Twist([3.0, 0.0, 1.0], [0.0, 0.4, 0.1])
    applied = camsim.apply(keys, color, depth, motion, focal_px=[70, 70])
    planes = read_exr(tmp_path / "out.exr")
    # One unit in the last place of a float: tables of sRGB in double against the program's own.
    assert np.abs(applied.color - np.stack([planes[name] for name in "RGBA"], axis=-1)).max() < 1e-6
    assert np.array_equal(applied.depth, planes["Z"]) and applied.color.shape == (48, 64, 4)
    empty = np.count_nonzero(applied.color[..., 3] == 0)
    assert sum(applied.without_source.values()) == empty
    t_s = np.linspace(-0.1, 0.1, 21)
    turn = 0.5 * np.outer(t_s, [0.0, 0.4, 0.1])
    norm = np.linalg.norm(turn, axis=1, keepdims=True)
    wxyz = np.c_[np.cos(norm), turn * np.sinc(norm / np.pi)]
    poses = camsim.Poses(t_s, np.zeros((21, 3)), wxyz)
    turned = camsim.apply(keys, color, depth, camsim.Twist(angular_rate_rad_s=[0.0, 0.4, 0.1]), focal_px=[70, 70])
    tabled = camsim.apply(keys, color, depth, poses, focal_px=[70, 70])
    assert camsim.compare(turned.color, tabled.color).max < 1e-4
    flowed = camsim.apply(keys, color, depth, camsim.Flow(np.zeros((60, 80, 2)), 10.0), focal_px=[70, 70])
    still = camsim.apply(keys, color, depth, focal_px=[70, 70])
    assert camsim.compare(flowed.color, still.color).max < 1e-5
    with pytest.raises(camsim.InputError, match="depth is missing"):
        camsim.apply(keys, color, None, motion, focal_px=[70, 70])
    with pytest.raises(camsim.InputError, match="^camera:1: .*fps"):
        camsim.apply({"fpss": 3}, color, focal_px=[70, 70])


def test_scenarios_from_arrays_are_those_from_files(tmp_path: pathlib.Path) -> None:
    table = read_table(ROOT / "assets" / "demo_flight.csv")
    log = camsim.PoseTable(
        numbers(table, "t_s")[:, 0],
        geodetic=numbers(table, "lat_deg", "lon_deg", "height_m"),
        angles_deg=numbers(table, "roll_deg", "pitch_deg", "yaw_deg"),
    )
    file = camsim.Scenario.load(ROOT / "assets" / "pattern.toml", sets=SMALL)
    picture = read_png(ROOT / "assets" / "acircles.png")
    arrays = file.replace({"flight.log": log, "scene.pattern.image": picture})
    assert np.array_equal(arrays[5].color, file[5].color)
    assert "camsim-inputs" in arrays.to_dict()["flight"]["log"]


def test_terrain_from_arrays() -> None:
    t_s = np.linspace(0, 4, 41)
    lat_deg, lon_deg, step_m = 46.5, 8.2, 20.0
    columns, rows = np.meshgrid(np.arange(41) - 20, np.arange(41) - 20)
    heights_m = 600.0 + 0.25 * step_m * columns - 0.5 * step_m * rows
    scenario = camsim.Scenario.from_dict(
        {
            "flight": {
                "log": camsim.PoseTable(t_s, geodetic=np.c_[lat_deg + 0 * t_s, lon_deg + 0 * t_s, 900 + 0 * t_s], angles_deg=np.zeros((41, 3))),
                "origin": [lat_deg, lon_deg, 0.0],
            },
            "camera": {"size_px": [64, 48], "focal_px": [60, 60], "mount": {"angles_deg": [0, -90, 0]}},
            "scene": {
                "terrain": {
                    "dem": camsim.HeightMap.around(heights_m, lat_deg=lat_deg, lon_deg=lon_deg, step_m=step_m),
                    "ortho": np.full((8, 8, 3), 128, dtype=np.uint8),
                }
            },
            "output": {"channels": ["color", "depth", "coords"]},
        }
    )
    frame = scenario[3]
    north_m, east_m, down_m = (frame.coords[..., k].astype(np.float64) for k in (5, 6, 7))
    # The plane rises by a quarter to the east and by a half to the north. The ground falls away from the tangent
    # plane by less than 0.02 m within 400 m, and steps in degrees are those of the middle's latitude.
    assert np.abs(-down_m - (600.0 + 0.25 * east_m + 0.5 * north_m)).max() < 0.1
    assert np.abs(north_m).max() > 50
    lit = frame.color[frame.color[..., 3] > 0]
    assert np.allclose(lit[:, :3], ((128 / 255 + 0.055) / 1.055) ** 2.4, atol=2e-3)
    with pytest.raises(camsim.InputError, match="position_ned_m or geodetic"):
        camsim.PoseTable(t_s).csv()
    with pytest.raises(camsim.InputError, match="HeightMap"):
        camsim.HeightMap(np.zeros(3), (0, 0), (1, 1)).tiff()

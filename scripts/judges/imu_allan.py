#!/usr/bin/env python3
"""Allan deviations of an inertial unit, by AllanTools: the four noise figures of a static log.

    pip install allantools numpy
    python3 scripts/judges/imu_allan.py camsim            # the program; writes a scenario, runs it, prints a table
    python3 scripts/judges/imu_allan.py --table OUT/sensors/imu0.csv   # of a static log of your own

Two hours at 200 Hz on a platform that stands still. Noise density and random walk are fitted to the overlapping Allan variance
N^2/tau + K^2 tau/3 of each axis, with weights by the number of independent averages; the table has the mean of three axes.
Made with AllanTools 2024.6, numpy 2.4.
"""

import csv
import pathlib
import subprocess
import sys
import tempfile

import allantools
import numpy as np

RATE_HZ, HOURS = 200.0, 2.0
# Of a unit of the class of the ADIS16448 in EuRoC's imu0/sensor.yaml.
FIGURES = {"gyro": (1.6968e-4, 1.9393e-5), "accel": (2.0e-3, 3.0e-3)}
SCENARIO = f"""seed = 20261127
[flight]
log = "static.csv"
format = "csv-lla"
window_s = [0.0, {HOURS * 3600}]
[camera]
fps = 0.01
[scene.pattern]
image = "none.png"
width_m = 10.0
[[imu]]
name = "imu0"
rate_hz = {RATE_HZ}
mount = {{ angles_deg = [3.0, -5.0, 40.0], offset_m = [0.1, 0.0, 0.2] }}
gyro = {{ noise_density = {FIGURES["gyro"][0]}, random_walk = {FIGURES["gyro"][1]} }}
accel = {{ noise_density = {FIGURES["accel"][0]}, random_walk = {FIGURES["accel"][1]} }}
"""


def simulate(program, folder):
    """Runs `camsim track --sensors` on a platform that stands still."""
    with open(folder / "static.csv", "w", newline="") as out:
        table = csv.writer(out)
        table.writerow(["t_s", "lat_deg", "lon_deg", "alt_m", "roll_deg", "pitch_deg", "yaw_deg"])
        for t in (0.0, HOURS * 1800, HOURS * 3600):
            table.writerow([t, 46.7, 9.85, 2100.0, 2.0, -4.0, 30.0])
    (folder / "scenario.toml").write_text(SCENARIO)
    command = [program, "track", str(folder / "scenario.toml"), "--sensors", str(folder / "out"), "--set", "tracker.rate_hz=10"]
    subprocess.run(command, check=True)
    return folder / "out" / "sensors" / "imu0.csv"


def columns(path, names):
    with open(path) as file:
        header = file.readline().strip().split(",")
    return np.loadtxt(path, delimiter=",", skiprows=1, usecols=[header.index(name) for name in names])


def fitted(rates):
    """Noise density and random walk of one axis."""
    taus = np.geomspace(2 / RATE_HZ, 300.0, 40)
    tau, deviation, _, _ = allantools.oadev(rates, rate=RATE_HZ, data_type="freq", taus=taus)
    variance = deviation**2
    model = np.stack([1 / tau, tau / 3], axis=1)
    # A variance over M independent averages has the relative error sqrt(2 / (M - 1)), of what is expected of it.
    relative = np.sqrt(2 / (len(rates) / RATE_HZ / tau - 1))
    expected = variance
    for _ in range(20):
        weights = 1 / (relative * expected)
        squares = np.linalg.lstsq(model * weights[:, None], variance * weights, rcond=None)[0]
        expected = model @ squares
    return np.sqrt(squares)


def main():
    if len(sys.argv) == 3 and sys.argv[1] == "--table":
        return report(pathlib.Path(sys.argv[2]))
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    with tempfile.TemporaryDirectory() as folder:
        return report(simulate(sys.argv[1], pathlib.Path(folder)))


def report(path):
    units = {"gyro": ("rad_s", "rad/s/sqrt(Hz)", "rad/s^2/sqrt(Hz)"), "accel": ("m_s2", "m/s^2/sqrt(Hz)", "m/s^3/sqrt(Hz)")}
    print("| figure | unit | given | x | y | z | mean | off |\n|---|---|---|---|---|---|---|---|")
    worst = 0.0
    for kind, (suffix, *names) in units.items():
        values = columns(path, [f"{kind}_{axis}_{suffix}" for axis in "xyz"])
        axes = np.array([fitted(values[:, axis]) for axis in range(3)])
        for figure, what in enumerate(["noise density", "random walk"]):
            given, mean = FIGURES[kind][figure], axes[:, figure].mean()
            off = mean / given - 1
            worst = max(worst, abs(off))
            cells = " | ".join(f"{value:.4g}" for value in [given, *axes[:, figure], mean])
            print(f"| {kind} {what} | {names[figure]} | {cells} | {100 * off:+.2f} % |")
    print(f"\nworst: {100 * worst:.2f} %; {len(values)} rows; AllanTools {allantools.__version__}, numpy {np.__version__}")
    return 0 if worst < 0.05 else 1


if __name__ == "__main__":
    sys.exit(main())

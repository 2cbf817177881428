"""A EuRoC folder (pictures, inertial unit, true poses) in 20 lines; `camsim export --as euroc` writes all of it.

python euroc_folder.py [SCENARIO.toml]: 30 frames of it, or of the built-in flight, into euroc/
"""

import pathlib
import sys

import numpy as np

import camsim

folder, count = pathlib.Path("euroc/mav0"), 30
scenario = camsim.Scenario.load(sys.argv[1]) if sys.argv[1:] else camsim.Scenario.demo()
scenario = scenario.replace({"imu": [{"name": "imu0", "rate_hz": 200, "axes": "flu"}]})
for part in ("cam0/data", "imu0", "state_groundtruth_estimate0"):
    (folder / part).mkdir(parents=True, exist_ok=True)

with open(folder / "cam0/data.csv", "w", encoding="ascii") as names:
    names.write("#timestamp [ns],filename\n")
    for frame in scenario.frames(0, count, channels=["color"], progress=True):
        frame.save(folder / f"cam0/data/{frame.stamp_ns}.png", encoding="luma8")
        names.write(f"{frame.stamp_ns},{frame.stamp_ns}.png\n")

imu = scenario.imu()
table = np.c_[imu.t_ns, imu.gyro_rad_s, imu.accel_m_s2]
np.savetxt(folder / "imu0/data.csv", table, "%d" + ",%.17g" * 6, header="timestamp [ns],w xyz [rad/s],a xyz [m/s^2]")
# North-east-down to north-west-up: the world that EuRoC's readers expect, with gravity along -z.
world_from_ned = np.array([1, -1, -1])
w, x, y, z = imu.ned_from_sensor_wxyz.T
poses = np.c_[imu.t_ns, imu.position_ned_m * world_from_ned, np.c_[-x, w, -z, y], imu.velocity_ned_m_s * world_from_ned]
np.savetxt(folder / "state_groundtruth_estimate0/data.csv", poses, "%d" + ",%.17g" * 10, header="timestamp [ns],p xyz [m],q wxyz,v xyz [m/s]")

"""How the picture moves over a flight: optical flow to the next frame, and what it hides.

python flow_over_flight.py [SCENARIO.toml]; without it, the built-in flight
"""

import sys

import numpy as np

import camsim

scenario = camsim.Scenario.load(sys.argv[1]) if sys.argv[1:] else camsim.Scenario.demo()
print("frame  time_s  speed_m_s  median_px  p99_px  hidden  left")
for frame in scenario.frames(step=max(1, len(scenario) // 20), channels=["flow"]):
    state = frame.flow[..., 2]
    length_px = np.linalg.norm(frame.flow[..., :2], axis=-1)[state == 1]
    speed_m_s = np.linalg.norm(scenario.trajectory.at_ns(frame.stamp_ns).velocity_ned_m_s)
    median_px, p99_px = np.percentile(length_px, [50, 99]) if length_px.size else (0.0, 0.0)
    print(
        f"{frame.index:5}  {frame.stamp_ns * 1e-9:6.2f}  {speed_m_s:9.1f}  {median_px:9.2f}  {p99_px:6.2f}"
        f"  {np.mean(state == 2):6.1%}  {np.mean(state == 3):5.1%}"
    )

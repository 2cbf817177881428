"""assets/demo_flight.csv: 46 s of a light aircraft up a mountain valley, flown by a small point-mass model.

    python make_flight.py

Bank, climb rate and speed follow a schedule smoothed as a pilot and an airframe would; the turn is coordinated (heading rate = g tan(bank) / speed);
gusts are coloured noise on attitude and on the air's motion. Heights are above mean sea level, as the DEM's.
"""

import numpy as np
from scipy.ndimage import gaussian_filter1d

from ground import ASSETS, Ground

SEED = 7
RATE_HZ = 25
DURATION_S = 46.0
STEP_S = 0.005
G = 9.81

START = dict(row=575.0, col=934.0, height_m=3290.0, heading_deg=-14.0, speed_m_s=58.0)
# time_s: bank_deg, climb_m_s, speed_m_s
SCHEDULE = [
    (0.0, 0.0, 1.0, 58.0),
    (8.0, -35.0, 2.0, 58.0),
    (18.0, 0.0, 4.0, 57.0),
    (21.5, 35.0, 5.0, 56.0),
    (29.5, 0.0, 3.0, 57.0),
    (33.0, -32.0, 4.0, 58.0),
    (42.0, 0.0, 3.0, 58.0),
]

ground = Ground()
rng = np.random.default_rng(SEED)


def smooth(x, seconds):
    """Gaussian average: a pilot who leads, an airframe that lags, and accelerations that stay finite."""
    return gaussian_filter1d(x, seconds / STEP_S, mode="nearest")


def coloured(sigma, seconds, steps):
    """Gusts: Gaussian noise of the given standard deviation and correlation time, without its mean."""
    out = smooth(rng.standard_normal(steps), seconds)
    return (out - out.mean()) * sigma / out.std()


steps = round(DURATION_S / STEP_S) + 1
t = np.arange(steps) * STEP_S
row_of = np.searchsorted([s[0] for s in SCHEDULE], t, side="right") - 1
plan = np.array([s[1:] for s in SCHEDULE])[row_of]
bank = np.radians(smooth(plan[:, 0], 0.9) + coloured(0.8, 0.25, steps))
climb = smooth(plan[:, 1], 1.5) + coloured(0.6, 0.8, steps)
speed = smooth(plan[:, 2], 2.0) + coloured(0.5, 1.0, steps)

track = np.radians(START["heading_deg"]) + np.concatenate([[0.0], np.cumsum(STEP_S * G * np.tan(bank[:-1]) / speed[:-1])])
level = np.sqrt(speed**2 - climb**2)
slip = np.radians(coloured(0.5, 0.25, steps))
load = 1.0 / np.cos(bank)
attack = np.radians(2.2) * load
pitch = np.arctan2(climb, level) + attack * np.cos(bank) + np.radians(coloured(0.5, 0.22, steps))
yaw = track + attack * np.sin(bank) + slip

north_m = np.concatenate([[0.0], np.cumsum(STEP_S * level[:-1] * np.cos(track[:-1]))])
east_m = np.concatenate([[0.0], np.cumsum(STEP_S * level[:-1] * np.sin(track[:-1]))])
height_m = START["height_m"] + np.concatenate([[0.0], np.cumsum(STEP_S * climb[:-1])])
lat0, lon0 = ground.geodetic_deg(START["row"], START["col"])
lat = lat0 + north_m / ground.metres_per_deg_north
lon = lon0 + east_m / ground.metres_per_deg_east

above_m = height_m - ground.at(*ground.pixel(lat, lon))
print(f"above ground {above_m.min():.0f} to {above_m.max():.0f} m, bank {np.degrees(bank.min()):.0f} to {np.degrees(bank.max()):.0f} deg")
rates = np.degrees(np.diff(np.stack([bank, pitch, yaw]), axis=1)) / STEP_S
print("largest Euler rates", np.abs(rates).max(axis=1).round(1), "deg/s")
print("largest Euler accelerations", np.abs(np.diff(rates, axis=1) / STEP_S).max(axis=1).round(), "deg/s2")

target = ASSETS / "demo_flight.csv"
with target.open("w", newline="\n") as out:
    out.write("t_s,lat_deg,lon_deg,height_m,roll_deg,pitch_deg,yaw_deg\n")
    for i in range(0, steps, round(1.0 / (RATE_HZ * STEP_S))):
        yaw_deg = (np.degrees(yaw[i]) + 180.0) % 360.0 - 180.0
        out.write(
            f"{t[i]:.2f},{lat[i]:.8f},{lon[i]:.8f},{height_m[i]:.3f},"
            f"{np.degrees(bank[i]):.4f},{np.degrees(pitch[i]):.4f},{yaw_deg:.4f}\n"
        )
print(target, target.stat().st_size)

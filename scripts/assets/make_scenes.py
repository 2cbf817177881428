"""Files of `benches/scenes`: ground as a photograph shows it (ground.jpg), trees (broadleaf.glb, conifer.glb), flights.

    python make_scenes.py

The flights over the town of `make_houses.py` keep clear of its houses and of the ground; what is left is printed.
"""

import csv
import io
import math

import numpy as np
from PIL import Image

from ground import Ground
from make_houses import ROOT, Shape, centre, write_glb

OUT = ROOT / "benches" / "scenes"
SEED = 58
G = 9.81
TUFTS = 96
WHORLS, BOUGHS = 21, 12

# The picture of the ground: 80 m wide in the scenario.
WIDTH_PX, HEIGHT_PX, WIDTH_M = 2048, 1536, 80.0
MOST_BYTES = 900_000
# North and east of the town's centre, m: the middle of its flattest street.
STREET = (-760.0, 1100.0)
# Where the flattest line of the mapping flight begins, and its heading.
LINE = (-1250.0, 1150.0, 345.0)


def fractal(rng, slope, stretch=1.0):
    """Noise whose amplitude falls with frequency to the power `slope`, as in photographs; mean 0, deviation 1."""
    fy = np.fft.fftfreq(HEIGHT_PX)[:, None] * stretch
    fx = np.fft.rfftfreq(WIDTH_PX)[None, :]
    frequency = np.hypot(fx, fy)
    frequency[0, 0] = np.inf
    noise = np.fft.irfft2(
        np.fft.rfft2(rng.standard_normal((HEIGHT_PX, WIDTH_PX))) * frequency**-slope, (HEIGHT_PX, WIDTH_PX)
    )
    return (noise - noise.mean()) / noise.std()


def step(x, low, high):
    """0 below `low`, 1 above `high`, smooth between."""
    t = np.clip((x - low) / (high - low), 0.0, 1.0)
    return t * t * (3.0 - 2.0 * t)


def ground_picture(rng):
    """Grass with earth showing through, two gravel paths, a trodden one, leaves and flowers; sRGB."""
    m = WIDTH_M / WIDTH_PX
    x, y = np.meshgrid((np.arange(WIDTH_PX) + 0.5) * m, (np.arange(HEIGHT_PX) + 0.5) * m)
    wide, tufts, fine = fractal(rng, 1.6), fractal(rng, 0.9), fractal(rng, 0.35)
    blades = 0.6 * fractal(rng, 0.3, 0.35) + 0.6 * fractal(rng, 0.3, 2.8)

    def mixed(below, colour, part):
        return below + (np.asarray(colour) - below) * part[..., None]

    picture = mixed(
        np.full((HEIGHT_PX, WIDTH_PX, 3), (96.0, 112.0, 54.0)), (136, 134, 74), step(wide + 0.5 * tufts, -0.6, 1.6)
    )
    picture = mixed(picture, (58, 82, 36), step(tufts - 0.5 * wide, 0.2, 2.0))
    earth = step(fractal(rng, 1.35) + 0.35 * tufts, 1.25, 1.75)
    trodden = np.abs(y - 14.0 - 5.0 * np.sin(x / 11.0) - 0.25 * x) + 0.5 * tufts
    earth = np.maximum(earth, 0.8 * (1.0 - step(trodden, 0.1, 0.9)))
    picture = mixed(picture, (112, 88, 62), earth)
    gravel = np.zeros_like(x)
    for away, half in (
        (np.abs(y - 33.0 - 6.0 * np.sin(x / 15.0 + 0.6)), 1.3),
        (np.abs(x - 47.0 - 4.0 * np.sin(y / 9.0)), 0.9),
    ):
        gravel = np.maximum(gravel, 1.0 - step(away + 0.18 * tufts + 0.06 * fine, half - 0.25, half + 0.25))
    picture = mixed(picture, (168, 160, 146), gravel)
    grass = (1.0 - gravel) * (1.0 - 0.6 * earth)
    shade = 1.0 + 0.05 * wide + 0.10 * tufts + (0.09 + 0.05 * gravel) * fine + 0.11 * grass * blades
    picture *= shade[..., None]
    for count, colour, sizes in (
        (2600, (150, 116, 62), (1, 4)),
        (1300, (224, 222, 206), (1, 3)),
        (900, (52, 44, 36), (1, 5)),
    ):
        for column, row, w, h in zip(
            rng.integers(0, WIDTH_PX - 5, count),
            rng.integers(0, HEIGHT_PX - 5, count),
            *rng.integers(*sizes, (2, count)),
        ):
            spot = picture[row : row + h, column : column + w]
            spot += 0.7 * (np.asarray(colour) - spot)
    return Image.fromarray(np.clip(picture, 0.0, 255.0).astype(np.uint8))


def write_picture(picture, path):
    """As good as `MOST_BYTES` allow."""
    for quality in range(92, 30, -2):
        file = io.BytesIO()
        picture.save(file, "JPEG", quality=quality, optimize=True)
        if file.tell() <= MOST_BYTES:
            path.write_bytes(file.getvalue())
            return


class Tree(Shape):
    def surface(self, points, colours, triangles):
        """Triangles that share their corners."""
        first = len(self.corners)
        self.corners += list(zip(points, colours))
        self.triangles += [tuple(first + k for k in triangle) for triangle in triangles]

    def limb(self, low, high, radii, sides, colour):
        """A tapered stem between two points."""
        low, high = np.asarray(low), np.asarray(high)
        along = (high - low) / np.linalg.norm(high - low)
        across = np.cross(along, (0.0, 0.0, 1.0) if abs(along[2]) < 0.9 else (1.0, 0.0, 0.0))
        across /= np.linalg.norm(across)
        other = np.cross(along, across)
        points, triangles = [], []
        for k in range(sides):
            angle = 2.0 * math.pi * k / sides
            out = math.cos(angle) * across + math.sin(angle) * other
            points += [low + radii[0] * out, high + radii[1] * out]
            a, b, c, d = 2 * k, 2 * k + 1, 2 * ((k + 1) % sides), 2 * ((k + 1) % sides) + 1
            triangles += [(a, c, b), (b, c, d)]
        self.surface(points, [colour] * len(points), triangles)


def tuft(rng, radius):
    """A crumpled ball of 20 triangles."""
    golden = 0.5 * (1.0 + 5.0**0.5)
    corners = np.array([(s * a, t * b, 0.0) for a, b in ((1.0, golden),) for s in (1, -1) for t in (1, -1)])
    corners = np.concatenate([np.roll(corners, k, axis=1) for k in range(3)])
    triangles = []
    for i in range(12):
        for j in range(i + 1, 12):
            for k in range(j + 1, 12):
                a, b, c = corners[[i, j, k]]
                if max(np.linalg.norm(a - b), np.linalg.norm(b - c), np.linalg.norm(c - a)) < 2.1:
                    outwards = np.cross(b - a, c - a) @ (a + b + c) > 0.0
                    triangles.append((i, j, k) if outwards else (i, k, j))
    points = corners / np.linalg.norm(corners[0]) * radius * rng.uniform(0.6, 1.35, (12, 1)) * (1.0, 0.75, 1.0)
    return points, triangles


def green(rng, base, light, count):
    return [tuple(np.clip(np.asarray(base) * light * rng.uniform(0.7, 1.3), 0.0, 1.0)) for _ in range(count)]


def broadleaf(rng):
    """A tree 9 m high with a round crown of tufts of leaves."""
    tree = Tree()
    bark = (0.07, 0.05, 0.035)
    tree.limb((0.0, -0.5, 0.0), (0.1, 2.6, 0.05), (0.34, 0.24), 12, bark)
    tree.limb((0.1, 2.6, 0.05), (0.0, 7.2, 0.0), (0.24, 0.06), 12, bark)
    for k in range(TUFTS):
        # Even over the crown's surface and, less densely, within it.
        turn, height = k * math.pi * (3.0 - 5.0**0.5), 1.0 - 2.0 * (k + 0.5) / TUFTS
        out = rng.uniform(0.55, 1.0) ** 0.5
        flat = math.sqrt(1.0 - height**2)
        centre = np.array(
            [2.9 * out * flat * math.cos(turn), 5.9 + 2.7 * out * height, 2.9 * out * flat * math.sin(turn)]
        )
        centre += rng.normal(0.0, 0.2, 3)
        if k % 9 == 0:
            tree.limb((0.05, 3.0 + 0.3 * centre[1], 0.0), centre, (0.07, 0.02), 5, bark)
        points, triangles = tuft(rng, rng.uniform(0.5, 0.9))
        light = 0.75 + 0.35 * out * (0.5 + 0.5 * height)
        tree.surface(points + centre, green(rng, (0.075, 0.135, 0.03), light, 12), triangles)
    return tree


def conifer(rng):
    """A spruce 12 m high: whorls of drooping boughs."""
    tree = Tree()
    tree.limb((0.0, -0.5, 0.0), (0.0, 11.6, 0.0), (0.26, 0.02), 12, (0.06, 0.04, 0.03))
    for whorl in range(WHORLS):
        part = whorl / (WHORLS - 1)
        base, length = 1.2 + 10.3 * part, 2.7 * (1.0 - part) ** 0.85 + 0.25
        for bough in range(BOUGHS):
            turn = 2.0 * math.pi * (bough + 0.5 * (whorl % 2) + rng.uniform(-0.2, 0.2)) / BOUGHS
            reach, droop = length * rng.uniform(0.75, 1.15), rng.uniform(0.2, 0.45)
            width = 0.18 + 0.2 * reach
            c, s = math.cos(turn), math.sin(turn)
            points = []
            for out, side, lift in (
                (0.05, 0, 0.0),
                (0.5, 1, -0.05),
                (0.5, 0, 0.14),
                (0.5, -1, -0.05),
                (0.8, 0.8, -0.04),
                (0.8, -0.8, -0.04),
                (1.0, 0, 0.0),
            ):
                r = out * reach
                points.append(
                    np.array(
                        [
                            c * r - s * side * width,
                            base + lift * (0.4 + reach / 3.0) - droop * r * out,
                            s * r + c * side * width,
                        ]
                    )
                )
            triangles = [(0, 2, 1), (0, 3, 2), (1, 2, 4), (2, 3, 5), (2, 6, 4), (2, 5, 6), (0, 1, 3), (1, 4, 6)]
            tree.surface(points, green(rng, (0.03, 0.075, 0.03), 0.8 + 0.5 * part, 7), triangles)
    return tree


def write_flight(name, heading, rows, digits):
    path = OUT / name
    with path.open("w", newline="\n") as file:
        file.write(f"t_s,{heading},roll_deg,pitch_deg,yaw_deg\n")
        for row in rows:
            file.write(",".join(f"{value:.{n}f}" for value, n in zip(row, (2, *digits, 3, 3, 3))) + "\n")
    print(path.name, path.stat().st_size)


def sway(t, *waves):
    """A sum of sines: amplitude, period in seconds, phase in turns."""
    return sum(a * np.sin(2.0 * np.pi * (t / period + phase)) for a, period, phase in waves)


def vio_flight():
    """23 s over the picture of the ground: a figure of eight at some 11 m, restless as a small drone in wind."""
    t = np.arange(0.0, 23.001, 0.02)
    north = sway(t, (12.0, 15.0, 0.0), (0.3, 2.3, 0.3))
    east = sway(t, (8.5, 7.5, 0.1), (0.3, 1.9, 0.7))
    down = -11.0 - sway(t, (0.9, 5.3, 0.2), (0.4, 2.1, 0.5))
    roll = sway(t, (6.0, 3.1, 0.0), (3.0, 1.3, 0.4))
    pitch = sway(t, (5.0, 2.7, 0.6), (2.5, 1.1, 0.1))
    yaw = sway(t, (35.0, 17.0, 0.1), (6.0, 4.1, 0.8))
    write_flight("vio_town.csv", "north_m,east_m,down_m", zip(t, north, east, down, roll, pitch, yaw), (4, 4, 4))


class Town:
    """The houses of `make_houses.py` in metres from the town's centre."""

    def __init__(self, ground):
        self.ground = ground
        self.lat_deg, self.lon_deg, self.north, self.east = centre()
        with (ROOT / "benches" / "houses" / "places.csv").open() as file:
            rows = [{key: float(value) for key, value in row.items()} for row in csv.DictReader(file)]
        self.houses = np.array(
            [
                (
                    (r["lat_deg"] - self.lat_deg) / self.north,
                    (r["lon_deg"] - self.lon_deg) / self.east,
                    r["heading_deg"],
                    r["scale"],
                )
                for r in rows
            ]
        )

    def geodetic_deg(self, north_m, east_m):
        return self.lat_deg + north_m * self.north, self.lon_deg + east_m * self.east

    def ground_m(self, north_m, east_m):
        return self.ground.at(*self.ground.pixel(*self.geodetic_deg(north_m, east_m)))

    def clearance_m(self, north_m, east_m):
        """Distance on the map to the nearest wall; eaves and gables hang over by up to 0.8 m."""
        n, e, heading, scale = self.houses.T
        turn = np.radians(heading)
        dn, de = n[:, None] - north_m, e[:, None] - east_m
        front = np.cos(turn)[:, None] * dn + np.sin(turn)[:, None] * de
        side = -np.sin(turn)[:, None] * dn + np.cos(turn)[:, None] * de
        beyond = [np.abs(front) - 4.5 * scale[:, None], np.abs(side) - 6.0 * scale[:, None]]
        return np.hypot(*(np.maximum(b, 0.0) for b in beyond)).min(axis=0)

    def fly(self, name, t, north, east, above_m, lean, noise):
        """Along a track, at a height above smoothed ground, turning with coordinated bank; `lean` is the pitch."""
        step_s = t[1] - t[0]
        vn, ve = np.gradient(north, step_s), np.gradient(east, step_s)
        yaw = np.unwrap(np.arctan2(ve, vn))
        bank = np.arctan(np.hypot(vn, ve) * np.gradient(yaw, step_s) / G)
        ground = np.array(
            [self.ground_m(north + n, east + e) for n, e in ((0, 0), (8, 0), (-8, 0), (0, 8), (0, -8))]
        ).max(axis=0)
        kernel = np.hanning(101) / np.hanning(101).sum()
        height = np.convolve(np.pad(ground, 50, mode="edge"), kernel, mode="valid") + above_m
        low, high = np.min(height - ground), np.max(height - self.ground_m(north, east))
        print(
            f"{name}: {low:.1f} to {high:.1f} m above ground,"
            f" {self.clearance_m(north, east).min():.1f} m from a wall on the map,"
            f" bank {np.degrees(np.abs(bank).max()):.0f} deg"
        )
        lat, lon = self.geodetic_deg(north, east)
        roll = np.degrees(bank) + sway(t, (noise, 0.7, 0.0), (0.6 * noise, 0.31, 0.3))
        pitch = lean + sway(t, (noise, 0.9, 0.2), (0.5 * noise, 0.37, 0.6))
        write_flight(
            name, "lat_deg,lon_deg,height_m", zip(t, lat, lon, height, roll, pitch, np.degrees(yaw)), (8, 8, 3)
        )


def town_flights(town):
    """A racing drone that weaves up a street, and a slow one that circles above the roofs."""
    t = np.arange(0.0, 20.001, 0.02)
    along = 18.0 * (t - 10.0)
    town.fly("fpv.csv", t, STREET[0] + along, STREET[1] + 5.0 * np.sin(2.0 * np.pi * along / 75.0), 8.0, -22.0, 1.5)
    turn = 2.0 * np.pi * t / 60.0
    town.fly("town.csv", t, STREET[0] + 70.0 * np.sin(turn), STREET[1] - 70.0 * np.cos(turn), 26.0, -6.0, 0.8)


def mapping_flight(town):
    """98 s of a line along the floor of the valley, 120 m above it: ten rows a second suffice for so steady a drone."""
    t = np.arange(0.0, 98.001, 0.1)
    heading = math.radians(LINE[2])
    north, east = LINE[0] + 10.0 * t * math.cos(heading), LINE[1] + 10.0 * t * math.sin(heading)
    below = town.ground_m(north, east)
    height = below.mean() + 120.0 + sway(t, (0.4, 9.0, 0.1))
    print(f"mapping.csv: {np.min(height - below):.0f} to {np.max(height - below):.0f} m above ground")
    roll, pitch = sway(t, (1.5, 4.3, 0.0), (0.8, 1.7, 0.4)), sway(t, (1.5, 3.9, 0.2), (0.8, 1.9, 0.7))
    yaw = LINE[2] + sway(t, (2.0, 11.0, 0.3))
    write_flight(
        "mapping.csv",
        "lat_deg,lon_deg,height_m",
        zip(t, *town.geodetic_deg(north, east), height, roll, pitch, yaw),
        (8, 8, 3),
    )


if __name__ == "__main__":
    OUT.mkdir(exist_ok=True)
    write_picture(ground_picture(np.random.default_rng(SEED)), OUT / "ground.jpg")
    for name, tree in (("broadleaf", broadleaf), ("conifer", conifer)):
        made = tree(np.random.default_rng(SEED))
        path = OUT / f"{name}.glb"
        write_glb(made, path, "make_scenes.py")
        print(f"{path.name}: {len(made.triangles)} triangles, {path.stat().st_size} bytes")
    town = Town(Ground())
    vio_flight()
    town_flights(town)
    mapping_flight(town)

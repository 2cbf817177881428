"""assets/demo_ortho.jpg: land cover invented for the demo's real DEM, as a summer picture from straight above.

    python make_ortho.py

Everything is derived from heights (slope, aspect, relief, drainage) and seeded noise: spruce and aspen up to the tree line, meadow,
tundra, scree, banded rock, late snow, streams, tarns, a valley road with a track over the pass, hay fields and a hamlet. Where the
places are is real; what grows and stands on them is not. The picture covers exactly the DEM's extent, at 3 m a pixel.
"""

import numpy as np
from PIL import Image, ImageDraw
from scipy import ndimage as nd
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import dijkstra

from ground import ASSETS, Ground
from hydrology import drainage, streams

PIXEL_M = 3.0
QUALITY = 76
SEED = 20

ground = Ground()
H = round(ground.rows * ground.cell_north_m / PIXEL_M)
W = round(ground.cols * ground.cell_east_m / PIXEL_M)
per_row, per_col = H / ground.rows, W / ground.cols
rng = np.random.default_rng(SEED)


def fine(grid, order=1):
    """A DEM-sized grid on the picture's pixels (pixel-is-area: edges coincide)."""
    i = (np.arange(H) + 0.5) / per_row - 0.5
    j = (np.arange(W) + 0.5) / per_col - 0.5
    return nd.map_coordinates(grid.astype(np.float32), np.meshgrid(i, j, indexing="ij"), order=order, mode="nearest")


def noise(wave_m, octaves=1, gain=0.55):
    """Smooth noise of about unit variance whose longest wave is `wave_m`."""
    total, weight, square = np.zeros((H, W), np.float32), 1.0, 0.0
    for _ in range(octaves):
        cells = max(wave_m / PIXEL_M, 1.0)
        grid = rng.standard_normal((int(H / cells) + 4, int(W / cells) + 4)).astype(np.float32)
        if cells > 1.01:
            i = np.arange(H, dtype=np.float32) / cells + 1.3
            j = np.arange(W, dtype=np.float32) / cells + 1.3
            layer = nd.map_coordinates(grid, np.meshgrid(i, j, indexing="ij"), order=3)
            layer /= layer.std()
        else:
            layer = grid[:H, :W]
        total += weight * layer
        square += weight**2
        weight *= gain
        wave_m /= 2.0
    return total / np.sqrt(square)


def ramp(x, low, high):
    """Smooth step from 0 at `low` to 1 at `high`; falling where high < low."""
    t = np.clip((x - low) / (high - low), 0.0, 1.0)
    return t * t * (3.0 - 2.0 * t)


def paint(picture, colour, weight):
    picture += weight[..., None] * (np.asarray(colour, np.float32) - picture)


def polyline(lines, width_px, scale=4):
    """Antialiased coverage of polylines of (row, col) in DEM pixels; `width_px` is one width per vertex of each line."""
    canvas = Image.new("L", (W * scale, H * scale))
    draw = ImageDraw.Draw(canvas)
    for line, widths in zip(lines, width_px):
        x, y = (line[:, 1] + 0.5) * per_col * scale, (line[:, 0] + 0.5) * per_row * scale
        for k, width in enumerate(np.broadcast_to(widths, len(line))[:-1] * scale):
            draw.line([x[k], y[k], x[k + 1], y[k + 1]], fill=255, width=max(1, round(width)))
            if width > 3:
                draw.ellipse([x[k] - width / 2, y[k] - width / 2, x[k] + width / 2, y[k] + width / 2], fill=255)
    return np.asarray(canvas.resize((W, H), Image.BOX), np.float32) / 255.0


# --- relief -------------------------------------------------------------------------------------------------------------
z = ground.height_m
gn, ge = np.gradient(z, ground.cell_north_m, ground.cell_east_m)
gn = -gn  # rows run south
relief = z - nd.gaussian_filter(z, 12)
hollow = nd.gaussian_filter(z, 4) - nd.gaussian_filter(z, 1.2)
Z = fine(z, 3)
slope = np.degrees(np.arctan(np.hypot(fine(gn), fine(ge))))
northness = -fine(nd.gaussian_filter(gn, 2)) / (np.hypot(fine(gn), fine(ge)) + 0.1)
relief, hollow = fine(relief), fine(hollow)

filled, receiver, area = drainage(z)
wet = fine(nd.gaussian_filter(np.log10(area), 1.5))
cell_m2 = ground.cell_north_m * ground.cell_east_m
lines = streams(receiver, area, 9e4 / cell_m2)
lakes = fine(nd.gaussian_filter((filled - z > 1.2).astype(float), 0.7)) > 0.5

n_large, n_mid, n_small = noise(900, 4), noise(150, 4), noise(24, 3)
n_pixel = noise(3)

# --- ground cover ---------------------------------------------------------------------------------------------------------
tree_line = 3430 + 55 * n_large - 45 * northness + 25 * n_mid
picture = np.empty((H, W, 3), np.float32)
picture[:] = (116, 124, 70)  # meadow
paint(picture, (92, 112, 56), ramp(wet + 0.25 * n_mid, 1.3, 2.4))
paint(picture, (146, 138, 84), 0.75 * ramp(n_mid + 0.6 * n_large, 0.2, 1.6))
tundra = ramp(Z + 40 * n_mid, 3380, 3560)
paint(picture, (128, 121, 82), tundra)
paint(picture, (104, 109, 66), tundra * ramp(n_mid + 2.0 * (wet - 1.2), 0.2, 1.5))

scree = ramp(slope + 5 * n_mid + 4 * n_small + 0.012 * (Z - 3400), 32, 38) * ramp(Z + 60 * n_large, 3150, 3420)
paint(picture, (150, 140, 126), scree)
bands = np.sin((Z + 14 * n_large + 5 * n_mid) / 8.5) + 0.6 * np.sin((Z + 20 * n_large) / 3.3)
rock = ramp(slope + 4 * n_mid + 3 * n_small + 0.10 * relief, 40, 46)
stone = np.stack([128 + 17 * bands, 116 + 14 * bands, 106 + 11 * bands], axis=-1) + 9 * n_small[..., None]
red = ramp(Z + 60 * n_large, 3520, 3680)[..., None]
stone = stone * (1 - red * (1 - np.array([1.10, 0.90, 0.80], np.float32)))
picture += rock[..., None] * (stone.astype(np.float32) - picture)

# --- the works of people, on the valley floors --------------------------------------------------------------------------------
def route(points, block=2, climb=14.0):
    """Cheapest path through (col, row) points, climbing dearly and keeping off the streams."""
    low = z[::block, ::block]
    rows, cols = low.shape
    index = np.arange(rows * cols).reshape(rows, cols)
    dear = 1.0 + 3.0 * ramp(nd.gaussian_filter(np.log10(area), 1.0)[::block, ::block], 2.6, 3.4)
    start, stop, cost = [], [], []
    for di, dj in [(0, 1), (1, 0), (1, 1), (1, -1), (1, 2), (2, 1), (1, -2), (2, -1)]:
        a = (slice(0, rows - di), slice(max(0, -dj), cols - max(0, dj)))
        b = (slice(di, rows), slice(max(0, dj), cols - max(0, -dj)))
        d = block * np.hypot(di * ground.cell_north_m, dj * ground.cell_east_m)
        grade = np.abs(low[a] - low[b]) / d
        c = d * (1.0 + climb * grade + (grade / 0.11) ** 4) * (dear[a] + dear[b])
        start += [index[a].ravel(), index[b].ravel()]
        stop += [index[b].ravel(), index[a].ravel()]
        cost += [c.ravel(), c.ravel()]
    graph = coo_matrix((np.concatenate(cost), (np.concatenate(start), np.concatenate(stop))), shape=(rows * cols,) * 2).tocsr()
    cells = []
    for (c0, r0), (c1, r1) in zip(points, points[1:]):
        source, cell = index[r0 // block, c0 // block], index[r1 // block, c1 // block]
        before = dijkstra(graph, indices=source, return_predecessors=True)[1]
        leg = []
        while cell >= 0:
            leg.append(cell)
            cell = before[cell]
        cells += leg[::-1]
    line = np.stack([np.array(cells) // cols * block, np.array(cells) % cols * block], axis=1).astype(float)
    return nd.gaussian_filter1d(line, 1.6, axis=0, mode="nearest")


road = route([(962, 630), (905, 470), (866, 330), (850, 175), (706, 62), (644, 2)])
track = route([(905, 470), (690, 405), (604, 300), (520, 150), (440, 195)])
lane = route([(2, 372), (120, 330), (230, 225)])

# Fields: rectangles along the lower valley, wherever the ground is nearly level.
level = ramp(fine(nd.gaussian_filter(np.hypot(gn, ge), 2)), 0.17, 0.12) * ramp(Z, 3010, 2960)
jj, ii = np.meshgrid(np.arange(W, dtype=np.float32) * PIXEL_M, np.arange(H, dtype=np.float32) * PIXEL_M)
turn = np.radians(24.0)
along, across = ii * np.cos(turn) + jj * np.sin(turn), jj * np.cos(turn) - ii * np.sin(turn)
strip = np.floor(across / 95.0)
shift = 60.0 * np.sin(strip * 12.9898)
plot = np.floor((along + shift) / 210.0)
code = (strip * 127.1 + plot * 311.7) % 7.0
edge = np.minimum(np.minimum(across % 95.0, 95.0 - across % 95.0), np.minimum((along + shift) % 210.0, 210.0 - (along + shift) % 210.0))
far_from_bank = ramp(wet, 3.6, 2.6)
field = ramp(level * far_from_bank + 0.12 * n_mid, 0.55, 0.75)
tones = np.array([(150, 158, 84), (116, 142, 66), (176, 164, 98), (98, 128, 60), (160, 150, 92), (132, 150, 74), (108, 120, 64)], np.float32)
mown = tones[code.astype(int)] + (6.0 * np.sign(np.sin(2 * np.pi * across / 12.0)) * (code < 4))[..., None]
picture += field[..., None] * (mown - picture)
paint(picture, (74, 88, 48), field * ramp(edge + 1.5 * n_small, 4.5, 2.0))

# --- trees: a canopy height model, dilated from single stems ----------------------------------------------------------------------
avalanche = ramp(wet + 0.15 * n_mid, 1.5, 1.9) * ramp(slope, 20, 26)
forest = ramp(tree_line - Z, -20, 90) * ramp(slope + 3 * n_mid, 47, 38)
forest *= ramp(0.75 * n_mid + 0.9 * n_large + 0.028 * slope - 0.55 * (wet - 1.3) + 0.4 * northness, -0.55, 0.35)
forest *= (1 - avalanche) * (1 - field) * (1 - scree) * (1 - 0.9 * rock)
willow = ramp(wet + 0.2 * n_mid, 2.3, 2.9) * ramp(slope, 16, 8) * (1 - field) * ramp(Z, 3450, 3350)
roads = polyline([road, track, lane], [2.4, 1.5, 1.7])
water = polyline(lines, [np.minimum(0.8 * (line[:, 2] * cell_m2 / 1e6) ** 0.5, 3.2) for line in lines])
clear = nd.maximum_filter(np.maximum(roads, water), 5)
aspen = ramp(1.1 * n_large - 1.5 * northness - (Z - 2960) / 150.0 + 0.7 * n_mid, 0.2, 0.8)


def crowns(density, stems_per_pixel, radius_px, height_m):
    """Canopy height of cones with rounded tops standing at random where the density allows."""
    stems = rng.random((H, W), np.float32) < stems_per_pixel * density
    tall = (stems * height_m * (0.65 + 0.35 * rng.random((H, W), np.float32))).astype(np.float32)
    r = int(np.ceil(radius_px))
    y, x = np.mgrid[-r : r + 1, -r : r + 1]
    fall = 0.6 * height_m * (x**2 + y**2) / radius_px**2
    canopy = np.zeros_like(tall)
    for dy, dx, drop in zip(y.ravel(), x.ravel(), fall.ravel()):
        if drop <= 0.75 * height_m:
            canopy = np.maximum(canopy, np.roll(tall, (dy, dx), (0, 1)) - drop)
    return canopy


open_forest = forest * (1 - clear)
spruce = np.maximum(crowns(open_forest * (1 - aspen), 0.10, 1.6, 17.0), crowns(open_forest * (1 - aspen), 0.03, 2.2, 22.0))
spruce = np.maximum(spruce, crowns((1 - clear) * (1 - field) * (1 - rock) * ramp(tree_line + 60 - Z, 0, 60) * ramp(slope, 5, 12), 0.0022, 1.9, 13.0))
leafy = crowns(open_forest * aspen, 0.13, 1.9, 13.0)
shrub = crowns(willow * (1 - clear), 0.16, 1.3, 3.0)
canopy = np.maximum(np.maximum(spruce, leafy), shrub)
paint(picture, (62, 72, 40), 0.7 * forest)  # forest floor
for layer, colour, full in ((shrub, (96, 116, 68), 1.2), (leafy, (88, 110, 56), 4.0), (spruce, (40, 62, 36), 5.0)):
    paint(picture, colour, ramp(layer, 0.2, full) * (layer >= canopy - 1e-3))
picture *= (1 + 0.10 * n_small + 0.05 * n_pixel * (1 + rock))[..., None]

# --- snow, water, roads, roofs -----------------------------------------------------------------------------------------------------
snow = ramp(0.35 * hollow + 1.1 * northness + (Z - 3560) / 130.0 + 0.55 * n_mid + 0.25 * n_small - 0.02 * np.maximum(slope - 42, 0), 1.35, 1.8)
paint(picture, (226, 230, 234), snow * ramp(Z, 3330, 3420))
paint(picture, (52, 82, 84), lakes.astype(np.float32) * 0.95)
gravel = nd.gaussian_filter(water, 2.2)
paint(picture, (168, 160, 142), np.clip(1.6 * gravel, 0, 0.75) * ramp(slope, 14, 7) * ramp(n_mid, -0.9, 0.4))
paint(picture, (66, 92, 92), 0.92 * water)
paint(picture, (196, 182, 150), roads)

houses = Image.new("RGBA", (W * 2, H * 2))
house_height = Image.new("L", (W * 2, H * 2))
draw, draw_height = ImageDraw.Draw(houses), ImageDraw.Draw(house_height)
roofs = [(150, 74, 56), (96, 104, 116), (182, 178, 170), (116, 86, 66), (138, 142, 146), (78, 96, 84)]
legs = np.diff(road, axis=0)
for k in range(8, len(road) - 8):
    r, c = road[k]
    dense = np.exp(-(((r - 470) / 34.0) ** 2)) + 0.6 * np.exp(-(((r - 560) / 20.0) ** 2)) + 0.5 * np.exp(-(((r - 176) / 9.0) ** 2))
    for side in (-1, 1, -2.1, 2.1, -3.2, 3.2):
        if rng.random() > 0.55 * dense:
            continue
        tangent = legs[k] * (ground.cell_north_m, ground.cell_east_m)
        tangent = tangent / (np.hypot(*tangent) + 1e-9)
        normal = np.array([-tangent[1], tangent[0]])
        position = np.array([(r + 0.5) * per_row, (c + 0.5) * per_col]) + side * (7.0 + 2 * rng.random()) * normal
        half = rng.uniform([1.8, 1.3], [3.6, 2.2])
        if rng.random() < 0.12:
            half *= 1.7
        ring = [(position + a * half[0] * tangent + b * half[1] * normal)[::-1] * 2 for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
        ridge = [(position + a * half[0] * tangent + b * half[1] * normal)[::-1] * 2 for a, b in ((-1, 0), (1, 0), (1, 1), (-1, 1))]
        tone = np.array(roofs[rng.integers(len(roofs))])
        draw.polygon([tuple(p) for p in ring], fill=tuple(int(v) for v in tone) + (255,))
        draw.polygon([tuple(p) for p in ridge], fill=tuple(int(v) for v in np.clip(tone * 1.28, 0, 255)) + (255,))
        draw_height.polygon([tuple(p) for p in ring], fill=70)
houses = np.asarray(houses.resize((W, H), Image.BOX), np.float32)
canopy = np.maximum(canopy, np.asarray(house_height.resize((W, H), Image.BOX), np.float32) / 10.0)
cover = houses[..., 3:] / 255.0
picture = picture * (1 - cover) + houses[..., :3] * cover

# --- light: a morning sun from the south-east, 48 degrees high, and its shadows ---------------------------------------------------------
azimuth, altitude = np.radians(142.0), np.radians(48.0)
sun = np.array([np.cos(azimuth) * np.cos(altitude), np.sin(azimuth) * np.cos(altitude), np.sin(altitude)])
top = Z + 0.55 * canopy
dn, de = np.gradient(top, PIXEL_M)
dn = -dn
facing = (-dn * sun[0] - de * sun[1] + sun[2]) / np.sqrt(1 + dn**2 + de**2)
shadow = np.zeros((H, W), bool)
for step in range(1, 9):  # canopy and roofs: up to 24 m
    dy, dx = -step * sun[0] / np.hypot(*sun[:2]), step * sun[1] / np.hypot(*sun[:2])
    shadow |= nd.shift(Z + canopy, (-dy, -dx), order=1, mode="nearest") > Z + canopy + step * PIXEL_M * np.tan(altitude) + 0.5
light = 0.42 + 0.80 * np.clip(facing, 0, 1) * (1 - 0.75 * nd.gaussian_filter(shadow.astype(np.float32), 0.6))
cast = np.zeros_like(z, bool)
for step in range(1, 140):  # ridges, on the DEM's own grid
    d = step * ground.cell_east_m
    dy, dx = -d * sun[0] / np.hypot(*sun[:2]) / ground.cell_north_m, d * sun[1] / np.hypot(*sun[:2]) / ground.cell_east_m
    cast |= nd.shift(z, (-dy, -dx), order=1, mode="nearest") > z + d * np.tan(altitude)
light *= 1 - 0.35 * fine(nd.gaussian_filter(cast.astype(float), 0.8))
shade = np.clip(light, 0, 1.5)[..., None]
tint = np.array([1.0, 1.0, 1.0]) + (1 - np.clip(shade, 0, 1)) * np.array([-0.05, 0.0, 0.10])
lit = picture * shade * tint * 1.06
lit += 0.16 * (lit.mean(axis=2, keepdims=True) - lit) + np.array([2.0, 3.0, 6.0])  # what air does to colours from high above
out = np.clip(lit, 0, 255).astype(np.uint8)

target = ASSETS / "demo_ortho.jpg"
Image.fromarray(out).save(target, quality=QUALITY, subsampling=2, optimize=True, progressive=False)
print(target, out.shape, target.stat().st_size)

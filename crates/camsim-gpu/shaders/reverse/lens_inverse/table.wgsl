// Tables of a distorting lens: FOLD_RAYS fold radii, then RADIAL_TABLE_LEN ratios for initial values.

@group(0) @binding(1) var<storage, read> lens_table: array<f32>;

const FOLD_RAYS: u32 = 720u;
const RADIAL_TABLE_LEN: u32 = 257u;
// Neighbouring fold radii with a larger ratio belong to different sheets of the fold: the nearer one counts.
const SHEET_RATIO: f32 = 1.1;

// Ideal radius of the border of the principal branch, in the direction of an ideal point.
fn fold_radius(ideal: vec2f) -> f32 {
    // atan2 is undefined at the origin; any direction serves there.
    let phi = select(0.0, atan2(ideal.y, ideal.x), dot(ideal, ideal) > 0.0);
    let revolutions = phi * 0.15915494;
    let position = (revolutions - floor(revolutions)) * f32(FOLD_RAYS);
    let ray = u32(position) % FOLD_RAYS;
    let here = lens_table[ray];
    let next = lens_table[(ray + 1u) % FOLD_RAYS];
    let near = min(here, next);
    if max(here, next) > SHEET_RATIO * near {
        return near;
    }
    return mix(here, next, position - floor(position));
}

// Undistorted over distorted radius (Kannala-Brandt: angle over distorted radius), uniform in s = sqrt(1 -
// distorted/distorted_max).
fn radial_ratio(distorted: f32) -> f32 {
    let s = sqrt(max(1.0 - distorted / lens.table_distorted_max, 0.0));
    let position = s * f32(RADIAL_TABLE_LEN - 1u);
    let below = min(u32(position), RADIAL_TABLE_LEN - 2u);
    let low = lens_table[FOLD_RAYS + below];
    let high = lens_table[FOLD_RAYS + below + 1u];
    return mix(low, high, position - f32(below));
}

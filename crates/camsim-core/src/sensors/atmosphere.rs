//! The International Standard Atmosphere (ISO 2533:1975).

/// Pressure at mean sea level, pascals.
pub(super) const SEA_LEVEL_PA: f64 = 101_325.0;
/// Standard gravity over the gas constant of air (287.052 87 J/(kg K)), K/m.
const GRAVITY_OVER_GAS: f64 = 9.806_65 / 287.052_87;
/// Radius of the Earth by which heights become geopotential, metres.
const RADIUS_M: f64 = 6_356_766.0;

/// Geopotential height of the foot, temperature there, and its gradient upwards, of each layer.
const LAYERS: [(f64, f64, f64); 6] = [
    (0.0, 288.15, -0.006_5),
    (11_000.0, 216.65, 0.0),
    (20_000.0, 216.65, 0.001),
    (32_000.0, 228.65, 0.002_8),
    (47_000.0, 270.65, 0.0),
    (51_000.0, 270.65, -0.002_8),
];

/// Pressure at a height above mean sea level, pascals. Meant for -5 to 71 km; the outer layers go on beyond,
/// and heights from 100 km on have the pressure there.
#[must_use]
pub fn isa_pressure_pa(height_m: f64) -> f64 {
    let height_m = height_m.clamp(-20e3, 100e3);
    let geopotential_m = RADIUS_M * height_m / (RADIUS_M + height_m);
    let mut pressure_pa = SEA_LEVEL_PA;
    for (i, layer) in LAYERS.iter().enumerate() {
        let top_m = LAYERS.get(i + 1).map_or(f64::INFINITY, |next| next.0);
        pressure_pa *= ratio(*layer, geopotential_m.min(top_m) - layer.0);
        if geopotential_m <= top_m {
            break;
        }
    }
    pressure_pa
}

/// Pressure `above_m` the foot of a layer over that at its foot.
fn ratio((_, kelvin, gradient): (f64, f64, f64), above_m: f64) -> f64 {
    if gradient == 0.0 {
        (-GRAVITY_OVER_GAS * above_m / kelvin).exp()
    } else {
        (1.0 + gradient * above_m / kelvin).powf(-GRAVITY_OVER_GAS / gradient)
    }
}

/// Height above mean sea level at which the standard atmosphere has a pressure, metres: the inverse of
/// [`isa_pressure_pa`]. A pressure that is not positive gives NaN.
#[must_use]
pub fn isa_altitude_m(pressure_pa: f64) -> f64 {
    if pressure_pa.is_nan() || pressure_pa <= 0.0 {
        return f64::NAN;
    }
    let mut foot_pa = SEA_LEVEL_PA;
    for (i, layer @ (foot_m, kelvin, gradient)) in LAYERS.into_iter().enumerate() {
        let top = LAYERS.get(i + 1).map(|next| (next.0, foot_pa * ratio(layer, next.0 - foot_m)));
        match top {
            Some((_, top_pa)) if pressure_pa < top_pa => foot_pa = top_pa,
            _ => {
                let quotient = pressure_pa / foot_pa;
                let above_m = if gradient == 0.0 {
                    -kelvin / GRAVITY_OVER_GAS * quotient.ln()
                } else {
                    kelvin / gradient * (quotient.powf(-gradient / GRAVITY_OVER_GAS) - 1.0)
                };
                let geopotential_m = foot_m + above_m;
                return RADIUS_M * geopotential_m / (RADIUS_M - geopotential_m);
            }
        }
    }
    f64::NAN
}

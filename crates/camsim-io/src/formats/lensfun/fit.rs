//! A rational Brown-Conrady for a polynomial with odd powers.

/// Number of radii at which the fit is made.
const SAMPLES: usize = 400;

/// The fit.
pub(super) struct Fit {
    /// `k1 k2 p1 p2 k3 k4 k5 k6`.
    pub(super) coefficients: [f64; 8],
    /// Largest error of the distorted radius, in units of the focal length.
    pub(super) error: f64,
}

/// Distorted radius of an ideal one.
fn distorted([c, b, a, e]: [f64; 4], r: f64) -> f64 {
    r * (1.0 + r * (c + r * (b + r * (a + r * e))))
}

/// Fits `r (1 + k1 r^2 + k2 r^4 + k3 r^6) / (1 + k4 r^2 + k5 r^4 + k6 r^6)` up to a distorted radius. `None` if the
/// polynomial does not reach it.
pub(super) fn rational(terms: [f64; 4], reach: f64) -> Option<Fit> {
    let largest = ideal_reach(terms, reach)?;
    // In x = r / largest the columns are of one size.
    let sample = |i: usize| (i as f64 + 1.0) / SAMPLES as f64;
    let mut normal = [[0.0; 7]; 6];
    for x in (0..SAMPLES).map(sample) {
        let (ideal, image) = (x, distorted(terms, x * largest) / largest);
        let (x2, x4, x6) = (x.powi(2), x.powi(4), x.powi(6));
        let row = [ideal * x2, ideal * x4, ideal * x6, -image * x2, -image * x4, -image * x6, image - ideal];
        for (i, line) in normal.iter_mut().enumerate() {
            line.iter_mut().zip(row).for_each(|(cell, value)| *cell += row[i] * value);
        }
    }
    // Of coefficients that hardly matter the small ones.
    normal.iter_mut().enumerate().for_each(|(i, line)| line[i] *= 1.0 + 1e-12);
    let k = solve(normal)?;
    let scale = |i: i32| largest.powi(-2 * i);
    let coefficients = [
        k[0] * scale(1),
        k[1] * scale(2),
        0.0,
        0.0,
        k[2] * scale(3),
        k[3] * scale(1),
        k[4] * scale(2),
        k[5] * scale(3),
    ];
    let error = (0..4 * SAMPLES).map(|i| {
        let r = largest * (i as f64 + 1.0) / (4 * SAMPLES) as f64;
        (fitted(&coefficients, r) - distorted(terms, r)).abs()
    });
    let error = error.fold(0.0, f64::max);
    error.is_finite().then_some(Fit { coefficients, error })
}

fn fitted([k1, k2, _, _, k3, k4, k5, k6]: &[f64; 8], r: f64) -> f64 {
    let s = r * r;
    r * (1.0 + s * (k1 + s * (k2 + s * k3))) / (1.0 + s * (k4 + s * (k5 + s * k6)))
}

/// The ideal radius of a distorted one, before the polynomial folds.
fn ideal_reach(terms: [f64; 4], reach: f64) -> Option<f64> {
    let step = 1e-3 * reach;
    let mut r = 0.0;
    while distorted(terms, r) < reach {
        if distorted(terms, r + step) <= distorted(terms, r) || r > 100.0 * reach {
            return None;
        }
        r += step;
    }
    Some(r)
}

/// Solves six equations, with the right side in the last column.
fn solve(mut rows: [[f64; 7]; 6]) -> Option<[f64; 6]> {
    for i in 0..6 {
        let pivot = (i..6).max_by(|a, b| rows[*a][i].abs().total_cmp(&rows[*b][i].abs()))?;
        rows.swap(i, pivot);
        let lead = rows[i];
        if lead[i] == 0.0 {
            return None;
        }
        for (_, row) in rows.iter_mut().enumerate().filter(|(k, _)| *k != i) {
            let factor = row[i] / lead[i];
            row.iter_mut().zip(lead).for_each(|(cell, value)| *cell -= factor * value);
        }
    }
    Some(std::array::from_fn(|i| rows[i][6] / rows[i][i]))
}

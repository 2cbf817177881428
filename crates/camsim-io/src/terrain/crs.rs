//! Coordinate reference systems of terrain files, to and from WGS-84 latitude and longitude.
//!
//! Transformations are horizontal: they run at height 0 of the source datum, as in the usual 2D tools, and heights never take part.

use proj4rs::{proj::Proj, transform::transform};

/// Radius of the sphere of EPSG:3857, metres.
const WEB_MERCATOR_RADIUS_M: f64 = 6_378_137.0;

/// A known coordinate reference system.
#[derive(Debug)]
pub(super) struct Crs {
    pub epsg: u16,
    kind: Kind,
}

#[derive(Debug)]
enum Kind {
    /// Longitude, latitude in degrees (the order of raster files: x is longitude).
    Geographic,
    WebMercator,
    Projected {
        projection: Box<Proj>,
        wgs84: Box<Proj>,
    },
}

impl Crs {
    /// `None` for a code that is not known.
    pub fn new(epsg: u16) -> Option<Self> {
        let kind = match epsg {
            4326 | 4258 | 4979 => Kind::Geographic,
            3857 => Kind::WebMercator,
            _ => Kind::Projected {
                projection: Box::new(Proj::from_proj_string(&projection_text(epsg)?).ok()?),
                wgs84: Box::new(Proj::from_proj_string("+proj=longlat +datum=WGS84 +no_defs").ok()?),
            },
        };
        Some(Self { epsg, kind })
    }

    pub fn is_geographic(&self) -> bool {
        matches!(self.kind, Kind::Geographic)
    }

    /// Latitude, longitude in radians; `None` outside of the projection's domain.
    pub fn geodetic_from_model(&self, [x, y]: [f64; 2]) -> Option<[f64; 2]> {
        let [latitude, longitude] = match &self.kind {
            Kind::Geographic => [y.to_radians(), x.to_radians()],
            Kind::WebMercator => [(y / WEB_MERCATOR_RADIUS_M).sinh().atan(), x / WEB_MERCATOR_RADIUS_M],
            Kind::Projected { projection, wgs84 } => {
                let mut point = (x, y, 0.0);
                transform(projection, wgs84, &mut point).ok()?;
                [point.1, point.0]
            }
        };
        let is_valid = latitude.abs() <= std::f64::consts::FRAC_PI_2 && longitude.is_finite();
        is_valid.then_some([latitude, longitude])
    }

    /// Model coordinates of latitude, longitude in radians; `None` outside of the projection's domain.
    pub fn model_from_geodetic(&self, [latitude, longitude]: [f64; 2]) -> Option<[f64; 2]> {
        let model = match &self.kind {
            Kind::Geographic => [longitude.to_degrees(), latitude.to_degrees()],
            Kind::WebMercator => [longitude * WEB_MERCATOR_RADIUS_M, latitude.tan().asinh() * WEB_MERCATOR_RADIUS_M],
            Kind::Projected { projection, wgs84 } => {
                let mut point = (longitude, latitude, 0.0);
                transform(wgs84, projection, &mut point).ok()?;
                [point.0, point.1]
            }
        };
        model.iter().all(|x| x.is_finite()).then_some(model)
    }
}

/// Definition in PROJ's notation, after the EPSG registry. ETRS89 is taken for WGS-84 (they differ by less than a metre).
fn projection_text(epsg: u16) -> Option<String> {
    const SWISS: &str = "+proj=somerc +lat_0=46.9524055555556 +lon_0=7.43958333333333 +k_0=1 +ellps=bessel \
                         +towgs84=674.374,15.056,405.346,0,0,0,0 +units=m +no_defs";
    Some(match epsg {
        32601..=32660 => format!("+proj=utm +zone={} +datum=WGS84 +units=m +no_defs", epsg - 32600),
        32701..=32760 => format!("+proj=utm +zone={} +south +datum=WGS84 +units=m +no_defs", epsg - 32700),
        25828..=25838 => format!("+proj=utm +zone={} +ellps=GRS80 +towgs84=0,0,0,0,0,0,0 +units=m +no_defs", epsg - 25800),
        21781 => format!("{SWISS} +x_0=600000 +y_0=200000"),
        2056 => format!("{SWISS} +x_0=2600000 +y_0=1200000"),
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    fn degrees(epsg: u16, model: [f64; 2]) -> [f64; 2] {
        Crs::new(epsg).unwrap().geodetic_from_model(model).unwrap().map(f64::to_degrees)
    }

    /// Metres on the ground are about 111 km a degree.
    fn assert_near(got: [f64; 2], expected: [f64; 2], metres: f64) {
        let [north, east] = [0, 1].map(|k: usize| (got[k] - expected[k]) * 111_000.0);
        assert!(north.hypot(east) < metres, "{got:?} {expected:?}: {} m", north.hypot(east));
    }

    #[test]
    fn published_points_are_met() {
        // Centres of two demo flights as their makers computed them (data README).
        assert_near(degrees(21781, [783_249.0, 178_821.0]), [46.735383, 9.836560], 0.2);
        assert_near(degrees(2056, [2_783_249.0, 1_178_821.0]), [46.735383, 9.836560], 0.2);
        assert_near(degrees(32615, [576_702.0, 5_188_162.0]), [46.842580, -91.994050], 0.2);
        // swisstopo's worked example of its approximate formulas; the three-parameter shift is good to 1 to 2 m.
        assert_near(degrees(21781, [700_000.0, 100_000.0]), [46.044_130, 8.730_497], 2.0);
        assert_near(degrees(3857, [1_113_194.907_932_735, 5_621_521.486_192_066]), [45.0, 10.0], 1e-3);
        assert_near(degrees(25832, [500_000.0, 0.0]), [0.0, 9.0], 1e-3);
        assert_near(degrees(32733, [500_000.0, 10_000_000.0]), [0.0, 15.0], 1e-3);
    }

    #[test]
    fn every_known_system_returns() {
        for (epsg, place) in [
            (21781, [46.8, 8.2]),
            (2056, [46.8, 8.2]),
            (32632, [50.0, 11.0]),
            (32733, [-20.0, 14.0]),
            (25830, [40.0, -3.0]),
            (3857, [-60.0, 179.0]),
            (4326, [10.0, 20.0]),
        ] {
            let crs = Crs::new(epsg).unwrap();
            let place = place.map(f64::to_radians);
            let back = crs.geodetic_from_model(crs.model_from_geodetic(place).unwrap()).unwrap();
            // 1e-9 rad is 6 mm; the datum shift drops its height, which costs some micrometres.
            assert!((0..2).all(|k| (back[k] - place[k]).abs() < 1e-9), "{epsg} {back:?} {place:?}");
        }
    }

    #[test]
    fn unknown_codes_and_impossible_places_have_no_answer() {
        assert!([0, 1, 2154, 32600, 32661, 32767, 25827].iter().all(|&epsg| Crs::new(epsg).is_none()));
        assert_eq!(Crs::new(4326).unwrap().geodetic_from_model([8.0, 95.0]), None);
        for model in [[f64::NAN, 0.0], [f64::INFINITY, 1.0], [1e300, 1e300]] {
            for epsg in [4326, 3857, 21781, 32632] {
                let _ = Crs::new(epsg).unwrap().geodetic_from_model(model);
            }
            assert_eq!(Crs::new(4326).unwrap().geodetic_from_model(model).filter(|p| p.iter().any(|x| !x.is_finite())), None);
        }
    }
}

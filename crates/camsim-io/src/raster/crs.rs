//! Coordinate reference systems of terrain files, to and from WGS-84 latitude and longitude.
//!
//! Transformations are horizontal: they run at height 0 of the source datum, as in common 2D tools, and leave
//! heights unchanged.

use proj4rs::{proj::Proj, transform::transform};

/// Radius of the sphere of EPSG:3857, metres.
const WEB_MERCATOR_RADIUS_M: f64 = 6_378_137.0;

/// Systems of the EPSG registry that are supported besides the UTM zones of WGS-84 and 3857:
/// kind;code;name;definition;accuracy of the datum shift in metres. Datums without a shift are taken as
/// WGS-84, from which they differ by a metre or two (ETRS89, NAD83 and similar).
pub(crate) const SYSTEMS: &str = include_str!("crs/systems.csv");

/// A known coordinate reference system.
#[derive(Debug)]
pub(crate) struct Crs {
    pub epsg: u16,
    pub name: String,
    /// Accuracy of its datum shift, metres.
    pub accuracy_m: Option<f64>,
    kind: Kind,
}

#[derive(Debug)]
enum Kind {
    /// Longitude, latitude in degrees; x is longitude, as in raster files.
    Geographic,
    WebMercator,
    Projected {
        projection: Box<Proj>,
        wgs84: Box<Proj>,
    },
}

/// A vertical system.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct VerticalCrs {
    pub epsg: u16,
    pub name: &'static str,
    /// Metres per unit; negative for depths.
    pub metres_per_unit: f64,
}

/// Name, definition and accuracy of a system in [`SYSTEMS`].
fn registry_line(kind: &str, epsg: u16) -> Option<[&'static str; 3]> {
    SYSTEMS.lines().find_map(|line| {
        let rest = line.strip_prefix(kind)?.strip_prefix(';')?;
        let (code, rest) = rest.split_once(';')?;
        let mut words = rest.split(';');
        (code.parse() == Ok(epsg)).then(|| [0; 3].map(|_| words.next().unwrap_or_default()))
    })
}

/// Codes of the horizontal and the vertical part of a compound system.
pub(crate) fn compound(epsg: u16) -> Option<[u16; 2]> {
    let [_, parts, _] = registry_line("compound", epsg)?;
    let (horizontal, vertical) = parts.split_once(' ')?;
    Some([horizontal.parse().ok()?, vertical.parse().ok()?])
}

impl VerticalCrs {
    /// `None` for an unknown code.
    pub fn new(epsg: u16) -> Option<Self> {
        let [name, metres, _] = registry_line("vertical", epsg)?;
        Some(Self { epsg, name, metres_per_unit: metres.parse().ok()? })
    }
}

impl Crs {
    /// `None` for an unknown code.
    pub fn new(epsg: u16) -> Option<Self> {
        let wgs84 = |name: String, kind| Some(Self { epsg, name, accuracy_m: None, kind });
        match epsg {
            3857 => return wgs84("WGS 84 / Pseudo-Mercator".into(), Kind::WebMercator),
            32601..=32660 => {
                return wgs84(
                    format!("WGS 84 / UTM zone {}N", epsg - 32600),
                    projected(&format!("+proj=utm +zone={} +ellps=WGS84", epsg - 32600))?,
                );
            }
            32701..=32760 => {
                return wgs84(
                    format!("WGS 84 / UTM zone {}S", epsg - 32700),
                    projected(&format!("+proj=utm +zone={} +south +ellps=WGS84", epsg - 32700))?,
                );
            }
            _ => {}
        }
        if let Some([name, ..]) = registry_line("geographic", epsg) {
            return wgs84(name.into(), Kind::Geographic);
        }
        let [name, definition, accuracy] = registry_line("projected", epsg)?;
        Some(Self {
            epsg,
            name: name.into(),
            accuracy_m: accuracy.parse().ok(),
            kind: projected(definition)?,
        })
    }

    /// Metres per unit of its coordinates; `None` for degrees.
    pub fn metres_per_unit(&self) -> Option<f64> {
        match &self.kind {
            Kind::Geographic => None,
            Kind::WebMercator => Some(1.0),
            Kind::Projected { projection, .. } => Some(projection.to_meter()),
        }
    }

    /// Period of x around the Earth; `None` for projections that do not repeat.
    pub fn period(&self) -> Option<f64> {
        match self.kind {
            Kind::Geographic => Some(360.0),
            Kind::WebMercator => Some(std::f64::consts::TAU * WEB_MERCATOR_RADIUS_M),
            Kind::Projected { .. } => None,
        }
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
            Kind::WebMercator => {
                [longitude * WEB_MERCATOR_RADIUS_M, latitude.tan().asinh() * WEB_MERCATOR_RADIUS_M]
            }
            Kind::Projected { projection, wgs84 } => {
                let mut point = (longitude, latitude, 0.0);
                transform(wgs84, projection, &mut point).ok()?;
                [point.0, point.1]
            }
        };
        model.iter().all(|x| x.is_finite()).then_some(model)
    }
}

/// A projection by its PROJ string.
fn projected(definition: &str) -> Option<Kind> {
    let shift = if definition.contains("+towgs84") { "" } else { "+towgs84=0,0,0" };
    Some(Kind::Projected {
        projection: Box::new(Proj::from_proj_string(&format!("{definition} {shift} +no_defs")).ok()?),
        wgs84: Box::new(Proj::from_proj_string("+proj=longlat +datum=WGS84 +no_defs").ok()?),
    })
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]
    use super::*;

    fn degrees(epsg: u16, model: [f64; 2]) -> [f64; 2] {
        Crs::new(epsg).unwrap().geodetic_from_model(model).unwrap().map(f64::to_degrees)
    }

    /// Metres on the ground are about 111 km a degree.
    fn assert_near(actual: [f64; 2], expected: [f64; 2], metres: f64) {
        let [north, east] = [0, 1].map(|k: usize| (actual[k] - expected[k]) * 111_000.0);
        assert!(north.hypot(east) < metres, "{actual:?} {expected:?}: {} m", north.hypot(east));
    }

    #[test]
    fn published_points_agree() {
        // Centres of two demo flights as their publishers state them.
        assert_near(degrees(21781, [783_249.0, 178_821.0]), [46.735383, 9.836560], 0.2);
        assert_near(degrees(2056, [2_783_249.0, 1_178_821.0]), [46.735383, 9.836560], 0.2);
        assert_near(degrees(32615, [576_702.0, 5_188_162.0]), [46.842580, -91.994050], 0.2);
        // swisstopo's worked example of its approximate formulas; the three-parameter shift is good to 1 to 2
        // m.
        assert_near(degrees(21781, [700_000.0, 100_000.0]), [46.044_130, 8.730_497], 2.0);
        assert_near(degrees(3857, [1_113_194.907_932_735, 5_621_521.486_192_066]), [45.0, 10.0], 1e-3);
        assert_near(degrees(25832, [500_000.0, 0.0]), [0.0, 9.0], 1e-3);
        assert_near(degrees(32733, [500_000.0, 10_000_000.0]), [0.0, 15.0], 1e-3);
    }

    /// Two points for each system, computed by PROJ: scripts/goldens/crs_table.py.
    #[test]
    fn every_system_agrees_with_proj() {
        let points =
            std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/data/crs_points.csv"))
                .unwrap();
        let mut seen = std::collections::BTreeSet::new();
        let mut wrong = Vec::new();
        for line in points.lines().skip(2) {
            let numbers: Vec<f64> = line.split(',').map(|word| word.parse().unwrap()).collect();
            let [epsg, x, y, lat, lon] = numbers[..] else { panic!("{line}") };
            let crs = Crs::new(epsg as u16).unwrap_or_else(|| panic!("{line}"));
            let forward_deg = crs.geodetic_from_model([x, y]).map(|point| point.map(f64::to_degrees));
            let back = crs.model_from_geodetic([lat.to_radians(), lon.to_radians()]);
            let (Some(forward_deg), Some(back)) = (forward_deg, back) else {
                wrong.push(line.to_owned());
                continue;
            };
            let unit_m = crs.metres_per_unit().unwrap();
            let error_m = [
                (forward_deg[0] - lat) * 111_000.0,
                (forward_deg[1] - lon) * 111_000.0 * lat.to_radians().cos(),
            ];
            let back_error_m = [(back[0] - x) * unit_m, (back[1] - y) * unit_m];
            // The dropped height of datum shifts costs some hundredths of a millimetre; the series of
            // projections are accurate to a millimetre.
            if error_m.iter().chain(&back_error_m).any(|metres| metres.abs() > 2e-3) {
                wrong.push(format!("{line}: error {error_m:?} m, inverse {back_error_m:?} m"));
            }
            seen.insert(epsg as u16);
        }
        assert!(wrong.is_empty(), "{} of {}:\n{}", wrong.len(), 2 * seen.len(), wrong.join("\n"));
        let listed = SYSTEMS.lines().filter(|line| line.starts_with("projected;")).count();
        assert_eq!(seen.len(), listed);
    }

    #[test]
    fn vertical_systems_have_units_and_compound_ones_their_parts() {
        let feet = VerticalCrs::new(6360).unwrap();
        assert!(
            feet.name == "NAVD88 height (ftUS)" && (feet.metres_per_unit - 1200.0 / 3937.0).abs() < 1e-15
        );
        assert_eq!(VerticalCrs::new(5773).map(|crs| crs.metres_per_unit), Some(1.0));
        assert_eq!(VerticalCrs::new(8228).map(|crs| crs.metres_per_unit), Some(0.3048));
        assert_eq!(VerticalCrs::new(32632), None);
        assert_eq!(
            (compound(7405), compound(7415), compound(4326)),
            (Some([27700, 5701]), Some([28992, 5709]), None)
        );
    }

    #[test]
    fn inverse_transformation_returns_the_point() {
        for (epsg, point_deg) in [
            (21781, [46.8, 8.2]),
            (2056, [46.8, 8.2]),
            (32632, [50.0, 11.0]),
            (32733, [-20.0, 14.0]),
            (25830, [40.0, -3.0]),
            (3857, [-60.0, 179.0]),
            (4326, [10.0, 20.0]),
        ] {
            let crs = Crs::new(epsg).unwrap();
            let point = point_deg.map(f64::to_radians);
            let back = crs.geodetic_from_model(crs.model_from_geodetic(point).unwrap()).unwrap();
            // 1e-9 rad is 6 mm; the datum shift drops its height, which costs some micrometres.
            assert!((0..2).all(|k| (back[k] - point[k]).abs() < 1e-9), "{epsg} {back:?} {point:?}");
        }
    }

    #[test]
    fn unknown_codes_and_points_outside_the_domain_give_none() {
        assert!([0, 1, 2100, 27573, 32600, 32767, 25827].iter().all(|&epsg| Crs::new(epsg).is_none()));
        assert_eq!(Crs::new(4326).unwrap().geodetic_from_model([8.0, 95.0]), None);
        for model in [[f64::NAN, 0.0], [f64::INFINITY, 1.0], [1e300, 1e300]] {
            for epsg in [4326, 3857, 21781, 32632] {
                let _ = Crs::new(epsg).unwrap().geodetic_from_model(model);
            }
            assert_eq!(
                Crs::new(4326)
                    .unwrap()
                    .geodetic_from_model(model)
                    .filter(|p| p.iter().any(|x| !x.is_finite())),
                None
            );
        }
    }
}

//! Names of columns of other programs, and of units that are not known.

use super::*;

#[test]
fn unknown_units_in_names_are_named() {
    let _report = FaultReport;
    assert_refused(
        "thousands of feet",
        log("t,lat,lon,alt_kft", "T,LAT,LON,1.6").as_bytes(),
        &track(),
        &["column 4 (`alt_kft`)", "`kft` is no unit known"],
    );
    assert_refused(
        "times in fortnights",
        log("time_ftn,lat,lon,alt", "T,LAT,LON,H").as_bytes(),
        &track(),
        &["`time_ftn`", "`ftn` is no unit known"],
    );
    let turns = log("t,lat,lon,alt,roll_turn,pitch_turn,yaw_turn", "T,LAT,LON,H,0,0,0.25");
    assert_flies("angles in turns", &turns, &track(), "column 5 (`roll_turn`) is not read");
    assert_refused("angles in turns", turns.as_bytes(), &auto(), &["no usable attitude"]);
    // Accuracies and rates are other quantities.
    assert_flies("accuracies", &log("t,lat,lon,alt,roll_err,yaw_rate", "T,LAT,LON,H,1,1"), &track(), "");
}

#[test]
fn stamps_of_ros_and_pressure_heights_are_read() {
    let _report = FaultReport;
    for names in ["header.stamp.sec,header.stamp.nanosec", "stamp_secs,stamp_nsecs", "sec,nanosec"] {
        let content = log(&format!("{names},lat,lon,alt"), "T,0,LAT,LON,H");
        assert_flies(names, &content, &track(), "");
    }
    let half =
        "header.stamp.sec,header.stamp.nanosec,lat,lon,alt\n1,0,47,8,500\n1,500000000,47.00001,8,500\n";
    let log_of = read_with(half.as_bytes(), &track()).unwrap();
    assert!((log_of.duration_s() - 0.5).abs() < 1e-12);
    let both = log("t,lat,lon,pressure_alt,gnss_alt", "T,LAT,LON,H,400");
    let pressure = FlightSpec { height_from: HeightSource::Pressure, ..track() };
    assert_flies("pressure", &both, &pressure, "`pressure_alt`, is by air pressure");
    let none = log("t,lat,lon,alt", "T,LAT,LON,H");
    assert_refused("no pressure", none.as_bytes(), &pressure, &["flight.height_from", "air pressure"]);
    let gnss = FlightSpec { height_from: HeightSource::Gnss, ..track() };
    let only = log("t,lat,lon,pressure_alt", "T,LAT,LON,H");
    assert_refused("no gnss", only.as_bytes(), &gnss, &["flight.height_from", "gnss"]);
}

#[test]
fn semicolons_and_decimal_commas_are_read_in_every_layout() {
    let european = |content: &str| content.replace(',', ";").replace('.', ",");
    let _report = FaultReport;
    for (what, header, row) in [
        ("lla", "", "T.5,LAT,8.0,H.0,0.0,0.0,30.5"),
        ("header", "t_s,lat_deg,lon_deg,alt_m,roll_deg,pitch_deg,yaw_deg", "T.5,LAT,8.0,H.0,0.5,0.5,30.5"),
        ("ned", "t,north,east,alt,roll_deg,pitch_deg,yaw_deg", "T.5,N.0,0.0,H.0,0.5,0.5,30.5"),
        ("quaternion", "t,north,east,alt,qw,qx,qy,qz", "T.5,N.0,0.0,H.0,1.0,0.0,0.0,0.0"),
    ] {
        let content = european(&log(header, row));
        let spec = auto();
        match read_with(content.as_bytes(), &spec) {
            Ok(log) => assert!((log.duration_s() - 20.0).abs() < 1e-9, "{what}"),
            Err(error) => fault(format!("{what}: {error}")),
        }
    }
    let tum = log("", "T.5 0.0 N.0 H.0 0.0 0.0 0.0 1.0").replace(' ', ";").replace('.', ",");
    let spec = FlightSpec { format: LogFormat::Tum, ..auto() };
    assert_flies("tum", &tum, &spec, "");
}

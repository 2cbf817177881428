//! Units of lengths, angles and times, with and without a name in the header.

use super::*;

#[test]
fn header_units_are_applied_or_refused() {
    let _report = FaultReport;
    let feet = |metres: f64| metres / 0.3048;
    let with_heights = |header: &str, scale: &dyn Fn(f64) -> f64| {
        let rows: Vec<String> = (0..21)
            .map(|i| {
                format!("{i},{:.9},8,{:.6}", 47.0 + f64::from(i) * 8.994_6e-5, scale(500.0 + f64::from(i)))
            })
            .collect();
        format!("{header}\n{}\n", rows.join("\n"))
    };
    assert_flies("feet behind a comma", &with_heights("t,lat,lon,\"alt, ft\"", &feet), &track(), "");
    assert_flies("feet in camel case", &with_heights("t,lat,lon,altitudeFt", &feet), &track(), "");
    assert_flies(
        "survey feet",
        &with_heights("t,lat,lon,alt [US survey feet]", &|m| m * 3937.0 / 1200.0),
        &track(),
        "",
    );
    assert_flies("millimetres", &with_heights("t,lat,lon,alt (mm)", &|m| m * 1e3), &track(), "");
    assert_flies("centimetres", &with_heights("t,lat,lon,alt_cm", &|m| m * 1e2), &track(), "");
    assert_flies("kilometres", &with_heights("t,lat,lon,alt/km", &|m| m * 1e-3), &track(), "");
    assert_flies(
        "feet above the sea",
        &with_heights("t,lat,lon,\"alt [ft, MSL]\"", &feet),
        &track(),
        "flight.height = \"msl\"",
    );
    let msl = FlightSpec { height: FlightHeight::Msl, ..track() };
    assert_flies("the key says so too", &with_heights("t,lat,lon,\"alt [ft, MSL]\"", &feet), &msl, "");
    assert_flies("hae", &with_heights("t,lat,lon,HAE_m", &|m| m), &msl, "flight.height = \"ellipsoid\"");
    assert_flies("a line of units", &with_heights("t,lat,lon,alt\ns,deg,deg,ft", &feet), &track(), "");
    assert_flies(
        "a commented line of units",
        &with_heights("# t,lat,lon,alt\n# [s],[deg],[deg],[ft]", &feet),
        &track(),
        "",
    );
    assert_refused(
        "furlongs",
        with_heights("t,lat,lon,alt [furlong]", &|m| m).as_bytes(),
        &track(),
        &["furlong", "column 4 (`alt [furlong]`)"],
    );
    assert_refused(
        "two units",
        with_heights("t,lat,lon,alt_m [ft]", &|m| m).as_bytes(),
        &track(),
        &["two units, m and ft"],
    );
    assert_refused(
        "metres of latitude",
        with_heights("t,lat [m],lon,alt", &|m| m).as_bytes(),
        &track(),
        &["m is no unit of angle"],
    );
    assert_refused(
        "millimetres unnamed",
        with_heights("t,lat,lon,alt", &|m| m * 1e3).as_bytes(),
        &track(),
        &["line 2, column 4 (`alt`)", "alt_mm"],
    );
    assert_refused(
        "above take-off",
        with_heights("t,lat,lon,rel_alt", &|m| m).as_bytes(),
        &track(),
        &["rel_alt", "take-off"],
    );
}

#[test]
fn angles_of_positions_need_a_unit_unless_degrees() {
    let _report = FaultReport;
    let e7: String = (0..21)
        .map(|i| format!("{i},{},80000000,{}\n", 470_000_000 + (f64::from(i) * 899.46) as i64, 500 + i))
        .collect();
    assert_flies("1e-7 degrees", &format!("t,lat_e7,lonE7,alt\n{e7}"), &track(), "");
    assert_flies(
        "1e-7 degrees in brackets",
        &format!("t,lat [1e-7 deg],lon [degE7],alt\n{e7}"),
        &track(),
        "",
    );
    assert_refused(
        "1e-7 degrees unnamed",
        format!("t,lat,lon,alt\n{e7}").as_bytes(),
        &track(),
        &["line 2, column 2 (`lat`)", "lat_e7"],
    );
    let radians: String = (0..21)
        .map(|i| {
            format!("{i},{:.12},0.13962634,{}\n", (47.0 + f64::from(i) * 8.994_6e-5).to_radians(), 500 + i)
        })
        .collect();
    assert_flies("radians of latitude", &format!("t,lat(rad),lon(rad),alt\n{radians}"), &track(), "");
    assert_refused(
        "radians of latitude unnamed",
        format!("t,lat,lon,alt\n{radians}").as_bytes(),
        &track(),
        &["lat_rad"],
    );
    assert_flies(
        "local feet",
        &(0..21)
            .map(|i| format!("{i},{},0,{}\n", 10.0 * f64::from(i) / 0.3048, f64::from(i) / 0.3048))
            .fold("t,north_ft,east_ft,alt_ft\n".to_owned(), |a, b| a + &b),
        &track(),
        "",
    );
    assert_refused(
        "letters of hemispheres",
        log("t,lat,N/S,lon,E/W,alt", "T,LAT,S,LON,W,H").as_bytes(),
        &track(),
        &["`N/S`", "signed degrees"],
    );
    assert_refused(
        "degrees with letters",
        log("t,lat,lon,alt", "T,LATN,LONE,H").replace("N,", "S,").as_bytes(),
        &track(),
        &["without a letter"],
    );
    assert_refused(
        "grid coordinates",
        log("t,easting,northing,alt", "T,500000,N,H").as_bytes(),
        &track(),
        &["easting", "grid"],
    );
}

#[test]
fn stated_time_units_are_applied() {
    let _report = FaultReport;
    let lla = "T,LAT,LON,H,0,0,30";
    let header = "time,lat,lon,alt,roll,pitch,yaw";
    for (name, per_second, unit) in [
        ("ms", 1e3, TimeUnit::Ms),
        ("us", 1e6, TimeUnit::Us),
        ("ns", 1e9, TimeUnit::Ns),
        ("min", 1.0 / 60.0, TimeUnit::Min),
        ("h", 1.0 / 3600.0, TimeUnit::H),
    ] {
        for header in [
            header.replace("time", &format!("time [{name}]")),
            header.replace("time", &format!("time_{name}")),
        ] {
            assert_flies(&header, &scaled(&header, lla, per_second), &auto(), "");
        }
        let key = FlightSpec { time_unit: unit, ..auto() };
        assert_flies(name, &scaled(header, lla, per_second), &key, "");
        assert_refused(
            name,
            scaled(&header.replace("time", "time_s"), lla, per_second).as_bytes(),
            &key,
            &["flight.time_unit", "`time_s`"],
        );
    }
    for name in
        ["TimeUS", "time_usec", "usec", "Timestamp (microseconds)", "\"time, us\"", "time_boot_us", "t [µs]"]
    {
        assert_flies(name, &scaled(&header.replace("time", name), lla, 1e6), &auto(), "");
    }
}

#[test]
fn unitless_times_are_inferred_or_refused() {
    let _report = FaultReport;
    let lla = "T,LAT,LON,H,0,0,30";
    let header = "time,lat,lon,alt,roll,pitch,yaw";
    assert_flies("microseconds", &scaled(header, lla, 1e6), &auto(), "read as us");
    assert_flies("nanoseconds", &scaled(header, lla, 1e9), &auto(), "read as ns");
    assert_flies("hours", &scaled(header, lla, 1.0 / 3600.0), &auto(), "read as h");
    assert_refused("milliseconds", scaled(header, lla, 1e3).as_bytes(), &auto(), &["flight.time_unit"]);
    assert_refused(
        "minutes",
        scaled(header, lla, 1.0 / 60.0).as_bytes(),
        &auto(),
        &["flight.time_unit", "m/s"],
    );
    let fast: String = (0..2001)
        .map(|i| {
            format!(
                "{},{:.9},8,{},0,0,30\n",
                10 * i,
                47.0 + f64::from(i) * 8.994_6e-7,
                500.0 + f64::from(i) * 0.01
            )
        })
        .collect();
    assert_refused(
        "100 Hz of milliseconds",
        format!("{header}\n{fast}").as_bytes(),
        &auto(),
        &["flight.time_unit"],
    );
    let still: String = (0..21).map(|i| format!("{},0,0,0,0,0,{}\n", 20 * i, 10 * i)).collect();
    assert_refused(
        "a still camera and milliseconds",
        still.as_bytes(),
        &spec(LogFormat::CsvNed),
        &["flight.time_unit", "rows 20 s apart"],
    );
    let epoch = |per_second: f64| {
        let rows: String = (0..21)
            .map(|i| {
                format!(
                    "{:.0},{:.9},8,{},0,0,30\n",
                    (1.7e9 + f64::from(i)) * per_second,
                    47.0 + f64::from(i) * 8.994_6e-5,
                    500 + i
                )
            })
            .collect();
        format!("{header}\n{rows}")
    };
    assert_flies("dates in s", &epoch(1.0), &auto(), "");
    assert_flies("dates in ms", &epoch(1e3), &auto(), "read as ms");
    assert_flies("dates in us", &epoch(1e6), &auto(), "(2023)");
}

#[test]
fn several_time_columns_are_joined_or_refused() {
    let _report = FaultReport;
    let lla = "T,LAT,LON,H,0,0,30";
    let header = "time,lat,lon,alt,roll,pitch,yaw";
    let unknown = header.replace("time", "time [fortnights]");
    assert_refused("fortnights", log(&unknown, lla).as_bytes(), &auto(), &["fortnights", "column 1"]);
    assert_refused(
        "two times",
        log("t,time,lat,lon,alt", "T,T,LAT,LON,H").as_bytes(),
        &track(),
        &["1 (`t`) and 2 (`time`)"],
    );
    assert_flies(
        "two times, one with a unit",
        &log("time,time_s,lat,lon,alt", "7,T,LAT,LON,H"),
        &track(),
        "",
    );
    let ros: String = (0..21)
        .map(|i| {
            format!(
                "{},{},{:.9},8,{}\n",
                1_700_000_000 + i / 2,
                i % 2 * 500_000_000,
                47.0 + f64::from(i) * 8.994_6e-5,
                500 + i
            )
        })
        .collect();
    let log_of_two = read_with(format!("secs,nsecs,lat,lon,alt\n{ros}").as_bytes(), &track()).unwrap();
    assert!(
        (log_of_two.duration_s() - 10.0).abs() < 1e-9 && log_of_two.rows.len() == 21,
        "{}",
        log_of_two.duration_s()
    );
    assert_refused(
        "nanoseconds beside a time",
        format!("time,nsecs,lat,lon,alt\n{ros}").as_bytes(),
        &track(),
        &["`nsecs`"],
    );
    // Spreadsheets count times in days.
    let days: String = (0..21)
        .map(|i| {
            format!(
                "{:.9},{:.9},8,{}\n",
                45_000.5 + f64::from(i) / 86_400.0,
                47.0 + f64::from(i) * 8.994_6e-5,
                500 + i
            )
        })
        .collect();
    assert_refused(
        "days of a spreadsheet",
        format!("time,lat,lon,alt\n{days}").as_bytes(),
        &track(),
        &["flight.time_unit"],
    );
    assert_flies(
        "seconds that creep along are seconds by the key",
        &log("t,north,east,alt", "T,N,0,H"),
        &FlightSpec { time_unit: TimeUnit::S, ..track() },
        "",
    );
}

#[test]
fn units_of_euroc_and_tum_times_are_known() {
    let _report = FaultReport;
    // EuRoC stamps of small value, and EuRoC names without a unit.
    let euroc: String =
        (0..21).map(|i| format!("{},0,{},{},1,0,0,0\n", i * 1_000_000_000_i64, 10 * i, i)).collect();
    assert_flies(
        "EuRoC, with its unit",
        &format!(
            "#timestamp [ns],p_RS_R_x [m],p_RS_R_y [m],p_RS_R_z [m],q_RS_w [],q_RS_x [],q_RS_y [],q_RS_z \
                []\n{euroc}"
        ),
        &auto(),
        "",
    );
    assert_flies(
        "EuRoC",
        &format!(
            "#timestamp, p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w, q_RS_x, q_RS_y, q_RS_z\n{euroc}"
        ),
        &auto(),
        "",
    );
    let seconds: String = (0..21).map(|i| format!("{i},0,{},{},1,0,0,0\n", 10 * i, i)).collect();
    assert_refused(
        "EuRoC in whole seconds",
        seconds.as_bytes(),
        &spec(LogFormat::Euroc),
        &["flight.time_unit", "EuRoC"],
    );
    let tum_in_ns: String = (0..21)
        .map(|i| {
            format!("{} 0 {} {} 0 0 0 1\n", 1_700_000_000_000_000_000 + i * 1_000_000_000_i64, 10 * i, i)
        })
        .collect();
    assert_refused("TUM in nanoseconds", tum_in_ns.as_bytes(), &auto(), &["tum", "euroc"]);
    assert_flies("TUM in nanoseconds, by the key", &tum_in_ns, &spec(LogFormat::Tum), "read as ns");
}

#[test]
fn columns_that_qualify_a_quantity_are_refused_or_noted() {
    let _report = FaultReport;
    let minutes = log("t,lat_deg,lat_min,lat_sec,lon_deg,lon_min,alt", "T,47,30,0,8,15,H");
    assert_refused(
        "minutes",
        minutes.as_bytes(),
        &track(),
        &["`lat_min`", "`lat_sec`", "`lon_min`", "decimals"],
    );
    for (name, value) in [("alt_units", "ft"), ("alt_datum", "MSL"), ("units", "ft")] {
        assert_flies(
            name,
            &log(&format!("t,lat,lon,alt,{name}"), &format!("T,LAT,LON,H,{value}")),
            &track(),
            name,
        );
    }
    let attitude = log("t,lat,lon,alt,roll,pitch,yaw,magnetic_declination", "T,LAT,LON,H,2,-3,30,10");
    assert_flies("declination", &attitude, &auto(), "`magnetic_declination`");
    assert_flies(
        "small tilts",
        &log("t,lat,lon,alt,roll,pitch,yaw", "T,LAT,LON,H,0.2,-0.15,3T"),
        &auto(),
        "flight.angle_unit",
    );
    let numbered = log("t,lat,lon,alt,q0,q1,q2,q3", "T,LAT,LON,H,1,0,0,0");
    assert_refused("q0", numbered.as_bytes(), &auto(), &["no usable attitude", "qw, qx, qy, qz"]);
    for prefix in ["", "vehicle_attitude.", "vehicle_attitude_"] {
        let names: Vec<String> = (0..4).map(|i| format!("{prefix}q[{i}]")).collect();
        let px4 = log(&format!("t,lat,lon,alt,{}", names.join(",")), "T,LAT,LON,H,0.866025404,0,0,0.5");
        assert_flies("PX4's quaternion", &px4, &auto(), "as PX4 writes");
        let yaw =
            read_with(px4.as_bytes(), &auto()).unwrap().rows[0].ned_from_body.to_euler(glam::EulerRot::ZYX).0;
        assert!((yaw.to_degrees() - 60.0).abs() < 1e-5, "{yaw}");
    }
}

#[test]
fn angle_units_and_quaternion_norms_are_checked() {
    let _report = FaultReport;
    let header = "t,lat,lon,alt,roll,pitch,yaw";
    let yaw_of = |content: &str, spec: &FlightSpec| {
        let log = read_with(content.as_bytes(), spec).unwrap();
        log.rows[10].ned_from_body.to_euler(glam::EulerRot::ZYX).0.to_degrees()
    };
    let near_pi = log(header, "T,LAT,LON,H,0.1,-0.05,0.5");
    assert_refused(
        "within pi",
        near_pi.as_bytes(),
        &auto(),
        &["flight.angle_unit", "yaw_rad", "column 7 (`yaw`)"],
    );
    assert_refused(
        "within pi, no header",
        near_pi.replace(&format!("{header}\n"), "").as_bytes(),
        &auto(),
        &["flight.angle_unit"],
    );
    let [deg, rad] = [AngleUnit::Deg, AngleUnit::Rad].map(|angle_unit| FlightSpec { angle_unit, ..auto() });
    assert!((yaw_of(&near_pi, &deg) - 0.5).abs() < 1e-4);
    assert!((yaw_of(&near_pi, &rad) - 0.5_f64.to_degrees()).abs() < 1e-4);
    assert_refused(
        "header against key",
        near_pi.replace("yaw", "yaw_rad").as_bytes(),
        &deg,
        &["flight.angle_unit", "`yaw_rad`"],
    );
    assert_flies("all zero", &log(header, "T,LAT,LON,H,0,0,0"), &auto(), "");
    assert_flies("a pitch beyond pi", &log(header, "T,LAT,LON,H,0,-3,2"), &auto(), "");
    let yaws: String = (0..21)
        .map(|i| {
            format!(
                "{i},{:.9},8,{},0.1,0.1,{:.4}\n",
                47.0 + f64::from(i) * 8.994_6e-5,
                500 + i,
                (5.9 + 0.05 * f64::from(i)) % std::f64::consts::TAU
            )
        })
        .collect();
    assert_flies("a compass in radians", &format!("{header}\n{yaws}"), &auto(), "radians");
    assert_refused(
        "hundredths of degrees",
        log(header, "T,LAT,LON,H,0,0,3000").as_bytes(),
        &auto(),
        &["yaw_cdeg", "3000"],
    );
    assert!(
        (yaw_of(&log(&header.replace("yaw", "yaw [cdeg]"), "T,LAT,LON,H,0,0,3000"), &auto()) - 30.0).abs()
            < 1e-4
    );
    let continuous = FlightSpec { angles: AngleKind::Continuous, ..auto() };
    assert!((yaw_of(&log(header, "T,LAT,LON,H,0,0,3000"), &continuous) - 120.0).abs() < 1e-4);
    let tum = |q: &str| log("", &format!("T 0 N H {q}"));
    assert_flies("twice a quaternion", &tum("0 0 0 2"), &spec(LogFormat::Tum), "length 2.000");
    assert_refused(
        "no quaternion",
        (0..21).map(|i| format!("{i} 0 {} {i} {i} 0 0 1\n", 10 * i)).collect::<String>().as_bytes(),
        &spec(LogFormat::Tum),
        &["lengths from 1.000", "no quaternions"],
    );
    assert_refused(
        "quaternions of nothing",
        tum("0 0 0 0").as_bytes(),
        &spec(LogFormat::Tum),
        &["no usable attitude"],
    );
    assert_flies(
        "a key without use",
        &tum("0 0 0 1"),
        &FlightSpec { angle_unit: AngleUnit::Rad, ..spec(LogFormat::Tum) },
        "not used",
    );
}

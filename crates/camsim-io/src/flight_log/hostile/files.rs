//! Separators, quotes, missing values, columns, and files of other formats.

use super::*;

#[test]
fn separators_quotes_and_missing_values_are_read_or_refused() {
    let _report = FaultReport;
    let lla = "t,lat,lon,alt,roll,pitch,yaw";
    let row = "T,LAT,LON,H,0,0,30";
    let usual = log(lla, row);
    assert_flies("tabs", &usual.replace(',', "\t"), &auto(), "");
    assert_flies(
        "tabs and blanks in names",
        &log(
            "Time [s]\tLatitude\tLongitude\tAlt MSL (m)\tRoll Angle\tPitch Angle\tTrue Heading",
            &row.replace(',', "\t"),
        ),
        &auto(),
        "msl",
    );
    assert_flies("bars of blanks", &usual.replace(',', "   "), &auto(), "");
    assert_flies(
        "names with units between blanks",
        &log("# t [s] lat [deg] lon [deg] alt [m]", "T LAT LON H"),
        &track(),
        "",
    );
    assert_flies("old line ends", &usual.replace('\n', "\r"), &auto(), "");
    assert_flies("a comma at every end", &usual.replace('\n', ",\n"), &auto(), "");
    assert_flies(
        "text with commas in quotes",
        &log("t,note,lat,lon,alt", "T,\"a, \"\"b\"\", c\",LAT,LON,H"),
        &track(),
        "",
    );
    assert_flies(
        "columns that nobody uses",
        &log("name,t,lat,lon,alt,state", "Drone 1,T,LAT,LON,H,OK"),
        &track(),
        "",
    );
    assert_flies("attitudes that nobody uses", &log(lla, "T,LAT,LON,H,?,?,?"), &track(), "");
    assert_flies("an index without a name", &log(",t,lat,lon,alt", "7,T,LAT,LON,H"), &track(), "");
    assert_refused(
        "an index that shifts the names",
        log("t,lat,lon,alt", "7,T,LAT,LON,H").as_bytes(),
        &track(),
        &["line 1", "4 columns, but the rows have 5"],
    );
    assert_refused(
        "names without their columns",
        log("t,x,lat,lon,alt", "T,LAT,LON,H").as_bytes(),
        &track(),
        &["5 columns, but the rows have 4"],
    );
    assert_refused(
        "a comma in a field",
        log("t,lat,lon,alt,note", "T,LAT,LON,H,a").replace("507,a", "507,a,b").as_bytes(),
        &track(),
        &["line 9 has 6 columns", "quotes"],
    );
    assert_refused("a shifted row", usual.replace("507,0,0", "507,x,0,0").as_bytes(), &auto(), &["line 9"]);
    assert_flies("decimal commas", &usual.replace('.', "#").replace(',', ";").replace('#', ","), &auto(), "");
    assert_flies(
        "decimal commas between tabs",
        &usual.replace('.', "#").replace(',', "\t").replace('#', ","),
        &auto(),
        "",
    );
    assert_refused(
        "decimal commas between commas",
        usual.replace('.', ",").as_bytes(),
        &auto(),
        &["decimal commas need semicolons"],
    );
    assert_refused(
        "commas and points",
        usual.replace(',', ";").replace(";507;", ";1.507,5;").as_bytes(),
        &auto(),
        &["`1.507,5`", "line 9, column 4 (`alt`)"],
    );
    assert_refused(
        "one decimal comma",
        usual.replace(',', ";").replace(";507;", ";507,5;").as_bytes(),
        &auto(),
        &["`507,5`", "with a point"],
    );
    assert_refused(
        "a header again",
        usual.replace("\n7,", &format!("\n{lla}\n7,")).as_bytes(),
        &auto(),
        &["line 9, column 1 (`t`): `t`", "second header"],
    );
    assert_refused("no closing quote", usual.replace("\n7,", "\n\"7,").as_bytes(), &auto(), &["line 9"]);
    let missing =
        usual.replace("\n7,", "\nNULL,").replace(",508,", ",-,").replace(",509,0,0,30", ",509,n/a,None,");
    let log_of_gaps = read_with(missing.as_bytes(), &auto()).unwrap();
    assert_eq!(
        (log_of_gaps.report.unusable.count, log_of_gaps.rows.len()),
        (2, 19),
        "{}",
        log_of_gaps.report
    );
    // A completely missing attitude is interpolated; a partial one counts as faulty.
    assert_eq!(
        read_with(usual.replace(",509,0,0,30", ",509,0,None,").as_bytes(), &auto())
            .unwrap()
            .report
            .attitude_missing
            .count,
        1
    );
    assert_refused(
        "missing by a number",
        usual.replace(",508,", ",-9999,").as_bytes(),
        &auto(),
        &["line 10, column 4 (`alt`): -9999", "empty"],
    );
}

#[test]
fn ambiguous_columns_are_refused() {
    let _report = FaultReport;
    assert_refused(
        "two latitudes",
        log("t,lat,latitude,lon,alt", "T,LAT,LAT,LON,H").as_bytes(),
        &track(),
        &["2 (`lat`) and 3 (`latitude`)"],
    );
    assert_refused(
        "two heights",
        log("t,lat,lon,alt,elevation", "T,LAT,LON,0,H").as_bytes(),
        &track(),
        &["`alt`", "`elevation`"],
    );
    assert_flies(
        "two datums",
        &log("t,lat,lon,alt_msl,alt_hae", "T,LAT,LON,0,H"),
        &track(),
        "`alt_hae` counts",
    );
    let msl = FlightSpec { height: FlightHeight::Msl, ..track() };
    assert_flies(
        "two datums, the other one",
        &log("t,lat,lon,alt_msl,alt_hae", "T,LAT,LON,H,0"),
        &msl,
        "`alt_msl` counts",
    );
    assert_refused(
        "two of one datum",
        log("t,lat,lon,alt_msl,amsl", "T,LAT,LON,H,0").as_bytes(),
        &msl,
        &["one quantity"],
    );
    assert_flies("by air pressure too", &log("t,lat,lon,baro_alt,alt", "T,LAT,LON,0,H"), &track(), "");
    assert_flies("by air pressure only", &log("t,lat,lon,baro_alt", "T,LAT,LON,H"), &track(), "air pressure");
    assert_refused(
        "two rolls",
        log("t,lat,lon,alt,roll,roll,pitch,yaw", "T,LAT,LON,H,1,2,3,30").as_bytes(),
        &auto(),
        &["`roll`"],
    );
    assert_flies(
        "angles and a quaternion",
        &log("t,lat,lon,alt,roll,pitch,yaw,qw,qx,qy,qz", "T,LAT,LON,H,9,9,30,1,0,0,0"),
        &auto(),
        "quaternion counts",
    );
    assert_flies(
        "a gimbal",
        &log("t,lat,lon,alt,roll,pitch,yaw,gimbal_pitch", "T,LAT,LON,H,9,9,30,-90"),
        &auto(),
        "camera.mount",
    );
    assert_flies(
        "magnetic",
        &log("t,lat,lon,alt,roll,pitch,heading [deg magnetic]", "T,LAT,LON,H,9,9,30"),
        &auto(),
        "declination",
    );
    assert_refused(
        "half of an attitude",
        log("t,lat,lon,alt,heading", "T,LAT,LON,H,30").as_bytes(),
        &auto(),
        &["flight.attitude"],
    );
    assert_refused(
        "course for heading",
        log("t,lat,lon,alt,roll,pitch,course", "T,LAT,LON,H,1,2,30").as_bytes(),
        &auto(),
        &["flight.attitude"],
    );
}

#[test]
fn unknown_axes_are_refused_unless_the_format_states_them() {
    let _report = FaultReport;
    for (header, format) in
        [("t,tx,ty,tz,roll,pitch,yaw", LogFormat::Auto), ("t,x,y,z,roll,pitch,yaw", LogFormat::Tum)]
    {
        assert_refused(
            header,
            log(header, "T,0,N,H,9,9,30").as_bytes(),
            &spec(format),
            &["quaternion", "csv-xya"],
        );
    }
    assert_flies(
        "angles by the key",
        &log("t,x,y,z,roll,pitch,yaw", "T,N,0,H,9,9,30"),
        &spec(LogFormat::CsvXya),
        "",
    );
    assert_flies(
        "a quaternion in a world of heights",
        &log("t,north,east,alt,qw,qx,qy,qz", "T,N,0,H,1,0,0,0"),
        &auto(),
        "PX4",
    );
    let own = "t_s,n_m,e_m,d_m,vn,ve,vd,an,ae,ad,qw,qx,qy,qz,wx,wy,wz,alphax,alphay,alphaz";
    let row = "T,N,0,-H,0,0,0,0,0,0,1,0,0,0,0,0,0,0,0,0";
    assert_flies("what `camsim track` writes", &log(own, row), &auto(), "");
    for header in [
        "t,x,y,z,qx,qy,qz,qw",
        "t,x,y,z,qw,qx,qy,qz",
        "t,pos_x,pos_y,pos_z,q_w,q_x,q_y,q_z",
        "t,x,y,alt,qw,qx,qy,qz",
    ] {
        assert_refused(
            header,
            log(header, "T,N,0,H,0,0,0,1").as_bytes(),
            &auto(),
            &["flight.format", "csv-ned", "tum"],
        );
    }
    assert_refused(
        "UTM under other names",
        log("t,x,y,alt", "T,N,0,H").as_bytes(),
        &track(),
        &["csv-xya", "north, east"],
    );
    assert_flies(
        "north is x by the key",
        &log("t,x,y,alt", "T,N,0,H"),
        &FlightSpec { format: LogFormat::CsvXya, ..track() },
        "",
    );
    assert_flies(
        "ROS by the key",
        &log(
            "%time,field.pose.position.x,field.pose.position.y,field.pose.position.z,\
             field.pose.orientation.x,field.pose.orientation.y,field.pose.orientation.z,field.pose.orientation.w",
            "T,0,N,H,0,0,0,1",
        ),
        &spec(LogFormat::Tum),
        "",
    );
    assert_flies("both kinds of positions", &log("t,lat,lon,alt,x,y,z", "T,LAT,LON,H,0,0,0"), &track(), "");
    assert_flies(
        "both kinds, by the key",
        &log("t,lat,lon,north,east,down,alt", "T,0,0,N,0,H,H").replace("500,500", "-500,500"),
        &FlightSpec { format: LogFormat::CsvXya, ..track() },
        "",
    );
    let ned = FlightSpec { format: LogFormat::CsvNed, ..track() };
    assert_refused(
        "up and down",
        log("t,north,east,alt", "T,N,0,H").as_bytes(),
        &ned,
        &["csv-ned", "named otherwise"],
    );
}

#[test]
fn prose_before_the_names_of_a_header_is_skipped() {
    let _report = FaultReport;
    for header in [
        "# columns: t tx ty tz qx qy qz qw",
        "# The columns are t tx ty tz qx qy qz qw",
        "# ground truth\n% timestamp(s) tx ty tz qx qy qz qw\n# of today",
        "# fields = t x y z qx qy qz qw",
    ] {
        assert_flies(header, &log(header, "T 0 N H 0 0 0 1"), &auto(), "");
    }
    assert_flies(
        "too many names",
        &log("# t tx ty tz qx qy qz qw cov", "T 0 N H 0 0 0 1"),
        &auto(),
        "line 1 names 9 columns, but the rows have 8",
    );
    assert_refused(
        "a name is lost",
        log("# t tx ty tz qx qy qz", "T 0 N H 0 0 0 1").as_bytes(),
        &auto(),
        &["7 columns, but the rows have 8"],
    );
}

#[test]
fn other_formats_are_refused() {
    let _report = FaultReport;
    for (content, words) in [
        (&b"FMT, 128, 89, FMT, BBnNZ, Type,Length,Name,Format,Columns\n"[..], &["ArduPilot", ".bin"][..]),
        (b"#ROSBAG V2.0\n", &["mcap convert"]),
        (b"SQLite format 3\0", &["ROS 2", "ros2 bag convert"]),
        (b"\x1f\x8b\x08", &["unpack"]),
        (b"PK\x03\x04", &["CSV"]),
        (b"\xff\xfet\0,\0", &["UTF-16", "UTF-8"]),
        (b"t,lat (\xb0),lon,alt\n0,1,2,3\n", &["UTF-8", "offset 7"]),
        (b"$GPGGA,123519,4807.038,N,01131.000,E,1,08,0.9,545.4,M\n", &["NMEA", "gpsbabel"]),
        (b"AXXXABC FLIGHT:1\r\nHFDTE160701\r\n", &["IGC", "no fixes"]),
        (b"{\"t\": 0}", &["JSON"]),
        (b"<?xml version=\"1.0\"?><kml><Placemark/></kml>", &["KML", "gx:Track"]),
        (b"<svg/>", &["XML other than GPX"]),
        (b"<gpx><trk>", &["not valid XML"]),
        (b"<gpx><wpt lat=\"1\" lon=\"2\"/></gpx>", &["no track points"]),
        (
            b"<gpx><trk><trkseg><trkpt lat=\"1\" \
            lon=\"2\"><ele>3</ele></trkpt></trkseg></trk></gpx>",
            &["`time`"],
        ),
        (
            b"<gpx><trk><trkseg><trkpt lat=\"1\" \
            lon=\"2\"><time>2023-05-01T10:00:00Z</time></trkpt></trkseg></trk></gpx>",
            &["`ele`"],
        ),
        (
            b"<gpx><trk><trkseg><trkpt lat=\"91\" \
                lon=\"2\"><ele>3</ele><time>2023-05-01T10:00:00Z</time></trkpt></trkseg></trk></gpx>",
            &["91"],
        ),
        (
            b"<gpx><trk><trkseg><trkpt lat=\"1\" \
            lon=\"2\"><ele>3</ele><time>yesterday</time></trkpt></trkseg></trk></gpx>",
            &["yesterday"],
        ),
    ] {
        assert_refused(&String::from_utf8_lossy(content), content, &track(), words);
    }
    assert_refused(
        "no GPX",
        log("t,lat,lon,alt", "T,LAT,LON,H").as_bytes(),
        &FlightSpec { format: LogFormat::Gpx, ..track() },
        &["no XML"],
    );
}

#[test]
fn gpx_tracks_are_read() {
    let _report = FaultReport;
    let gpx = |points: &str| {
        format!(
            "<?xml version=\"1.0\"?>\n<gpx \
                xmlns=\"http://www.topografix.com/GPX/1/1\"><trk><trkseg>{points}</trkseg></trk></gpx>"
        )
    };
    let points: String = (0..21)
        .map(|i| {
            format!(
                "<trkpt lat=\"{:.9}\" \
            lon=\"8\"><ele>{}</ele><time>2023-05-01T10:00:{i:02}Z</time>\
             <extensions><course>30</course></extensions></trkpt>\n",
                47.0 + f64::from(i) * 8.994_6e-5,
                500 + i
            )
        })
        .collect();
    let msl = FlightSpec { height: FlightHeight::Msl, ..track() };
    assert_flies("GPX", &gpx(&points), &msl, "not used: course");
    assert_flies(
        "GPX above the ellipsoid",
        &gpx(&points.replace("course", "hr")),
        &track(),
        "mean sea level",
    );
    let two = gpx(&points.replace("course", "hr").replacen("\n<trkpt", "\n</trkseg><trkseg><trkpt", 3));
    assert_flies("GPX in segments", &two, &msl, "");
}

/// Texts of random pieces never panic the reader.
#[test]
fn random_texts_do_not_panic() {
    let pieces = [
        "0",
        "1",
        "47.5",
        "-9",
        ",",
        ";",
        "\t",
        " ",
        "\n",
        "\"",
        "#",
        ":",
        "-",
        "T",
        "t",
        "lat",
        "lon",
        "alt",
        "x",
        "y",
        "z",
        "[",
        "]",
        "(ft)",
        "_ms",
        "nan",
        "é",
        "1e400",
        "12:00:00",
        "2023-05-01",
    ];
    let mut state = 12_345_u64;
    for _ in 0..3000 {
        let mut text = String::new();
        for _ in 0..60 {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            text += pieces[(state >> 33) as usize % pieces.len()];
        }
        for format in [LogFormat::Auto, LogFormat::CsvNed, LogFormat::Tum] {
            let _ = read_table(&text, &FlightSpec { format, ..track() });
        }
    }
}

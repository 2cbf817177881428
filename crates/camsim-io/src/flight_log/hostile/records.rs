//! Flight records, KML and bags of messages, damaged and unusual.

use std::fmt::Write as _;

use super::{
    formats::{golden, read_named, refused, topic, warnings},
    *,
};

/// A flight record with `B` records of these bodies behind the `B`.
fn igc(records: &[&str]) -> String {
    let mut text = "AXXXABC FLIGHT:1\r\nHFDTE010523\r\n".to_owned();
    for record in records {
        write!(text, "B{record}\r\n").unwrap();
    }
    text
}

#[test]
fn flight_records_are_read_or_refused_line_by_line() {
    let _report = FaultReport;
    let record = |text: &str, spec: &FlightSpec| read_named("a.igc", text.as_bytes(), spec);
    let midnight = igc(&["2359594700000N00800000EA0050000540", "0000004700010N00800000EA0050100541"]);
    let log = record(&midnight, &track()).unwrap();
    assert!((log.duration_s() - 1.0).abs() < 1e-12);
    assert!((log.frame.unwrap().origin().height_m - 540.0).abs() < 1e-9);
    assert_eq!(log.epoch_ns, 1_682_985_599_000_000_000);
    assert!((log.rows[1].position_ned_m.x - 18.53).abs() < 0.01, "{:?}", log.rows[1]);
    let pressure = FlightSpec { height_from: HeightSource::Pressure, ..track() };
    assert!((record(&midnight, &pressure).unwrap().frame.unwrap().origin().height_m - 500.0).abs() < 1e-9);
    let blind = igc(&["2359594700000S00800000WV0050000000"]);
    let log = record(&blind, &track()).unwrap();
    let origin = log.frame.unwrap().origin();
    assert!((origin.lat_deg() + 47.0).abs() < 1e-9 && (origin.lon_deg() + 8.0).abs() < 1e-9);
    assert!(warnings(&log).contains("all GNSS heights are 0"), "{}", warnings(&log));
    let gnss = FlightSpec { height_from: HeightSource::Gnss, ..track() };
    refused("a.igc", blind.as_bytes(), &gnss, &["flight.height_from"]);
    refused("a.igc", midnight.as_bytes(), &auto(), &["flight.attitude = \"track\""]);
    for (bad, word) in [
        ("2459594700000N00800000EA0050000540", "time"),
        ("2359594760000N00800000EA0050000540", "latitude"),
        ("2359599100000N00800000EA0050000540", "position"),
        ("2359594700000X00800000EA0050000540", "hemisphere"),
        ("2359594700000N00800000EA00x0000540", "height"),
        ("2359594700000N00800000EA00500", "cut off"),
    ] {
        let text = igc(&["2359594700000N00800000EA0050000540", bad]);
        refused("a.igc", text.as_bytes(), &track(), &["line 4", word, "remove the line"]);
    }
    let geoid = igc(&["2359594700000N00800000EA0050000540"]).replace("HFDTE", "HFALGALTGPS:GEO\r\nHFDTE");
    assert!(warnings(&record(&geoid, &track()).unwrap()).contains("flight.height = \"msl\""));
    // Pilots' names in Latin-1.
    let mut latin = igc(&["2359594700000N00800000EA0050000540"]).into_bytes();
    latin.extend(b"HFPLTPILOT:J\xfcrg\r\n");
    assert!(read_named("a.igc", &latin, &track()).is_ok());
}

fn kml(inner: &str) -> String {
    format!("<kml xmlns:gx=\"http://www.google.com/kml/ext/2.2\"><Placemark>{inner}</Placemark></kml>")
}

#[test]
fn kml_without_times_or_heights_is_refused() {
    let _report = FaultReport;
    let spec = || FlightSpec { height: FlightHeight::Msl, ..track() };
    let track_of =
        |points: &str| kml(&format!("<gx:Track><altitudeMode>absolute</altitudeMode>{points}</gx:Track>"));
    let when = |second: u32| format!("<when>2023-05-01T10:00:{second:02}Z</when>");
    let at = |lat: &str| format!("<gx:coord>8 {lat} 500</gx:coord>");
    let good = track_of(&format!("{}{}{}{}", when(0), when(1), at("47"), at("47.0001")));
    let log = read_named("a.kml", good.as_bytes(), &spec()).unwrap();
    assert_eq!((log.rows.len(), warnings(&log).as_str()), (2, ""));
    // A missing position is an empty coordinate.
    let missing = track_of(&format!("{}{}{}<gx:coord></gx:coord>", when(0), when(1), at("47")));
    assert_eq!(read_named("a.kml", missing.as_bytes(), &spec()).unwrap().report.unusable.count, 1);
    let point = "<TimeStamp><when>2023-05-01T10:00:00Z</when></TimeStamp><Point>\
        <altitudeMode>absolute</altitudeMode><coordinates>8,47,500</coordinates></Point>";
    assert_eq!(read_named("a.kml", kml(point).as_bytes(), &spec()).unwrap().rows.len(), 1);
    for (content, words) in [
        (track_of(&format!("{}{}{}", when(0), when(1), at("47"))), &["2 when, 1 gx:coord"][..]),
        (track_of(&format!("<when>soon</when>{}", at("47"))), &["`soon` is no time"]),
        (track_of(&format!("{}{}", when(0), at("97"))), &["latitude 97"]),
        (track_of(&format!("{}{}", when(0), at("NaN"))), &["no usable position"]),
        (track_of(&format!("{}<gx:coord>8 47</gx:coord>", when(0))), &["not three numbers"]),
        (track_of(""), &["no points"]),
        (good.replace("absolute", "relativeToGround"), &["relativeToGround", "absolute"]),
        (good.replace("<altitudeMode>absolute</altitudeMode>", ""), &["clampToGround"]),
        (format!("{good}{good}"), &["not valid XML"]),
        (good[..good.len() / 2].to_owned(), &["not valid XML"]),
        (kml("<Point><coordinates>8,47,5</coordinates></Point>"), &["no gx:Track"]),
    ] {
        refused("a.kml", content.as_bytes(), &spec(), words);
    }
    let relative = good.replace("absolute", "relativeToGround");
    let above_ground = FlightSpec { height: FlightHeight::Ground, ..track() };
    assert_eq!(warnings(&read_named("a.kml", relative.as_bytes(), &above_ground).unwrap()), "");
    refused("a.kml", good.as_bytes(), &above_ground, &["flight.height = \"msl\""]);
    let two = good.replace(
        "</Placemark>",
        &format!(
            "{}</Placemark>",
            &good[good.find("<gx:Track>").unwrap()..good.find("</Placemark>").unwrap()]
        ),
    );
    refused("a.kml", two.as_bytes(), &spec(), &["fly at the same time"]);
}

#[test]
fn bags_name_their_topics() {
    let _report = FaultReport;
    let bag = golden("odometry.mcap");
    refused(
        "a.mcap",
        &bag,
        &auto(),
        &[
            "flight.topic",
            "/odom (nav_msgs/Odometry), /pose_cov (geometry_msgs/PoseWithCovarianceStamped), \
                /tf#base_link (tf2_msgs/TFMessage), /tf#lidar (tf2_msgs/TFMessage)",
        ],
    );
    refused("a.mcap", &bag, &topic("/tf"), &["several frames", "/tf#base_link"]);
    refused("a.mcap", &bag, &topic("/nothing"), &["`/nothing` is no topic with positions", "/odom"]);
    refused(
        "a.mcap",
        &golden("fix_imu.mcap"),
        &topic("/imu"),
        &["`/imu` is no topic with positions", "/fix"],
    );
    let unclosed = &bag[..bag.len() - 8];
    let log = read_named("a.mcap", unclosed, &topic("/odom")).unwrap();
    assert!(warnings(&log).contains("was not closed"), "{}", warnings(&log));
    // A chunk of which a byte is wrong.
    let mut damaged = golden("pose_plain.mcap");
    let at = damaged.len() / 3;
    damaged[at] ^= 0x10;
    refused("a.mcap", &damaged, &auto(), &["checksum is wrong"]);
}

/// An MCAP file of one topic of `PoseStamped`, in ROS 1's form or in CDR of either byte order.
fn poses(encoding: &str, big_endian: bool, count: u32) -> Vec<u8> {
    let mut file = std::io::Cursor::new(Vec::new());
    let mut writer = mcap::WriteOptions::new().compression(None).create(&mut file).unwrap();
    let schema = writer.add_schema("geometry_msgs/PoseStamped", "ros1msg", b"").unwrap();
    let channel = writer.add_channel(schema, "/p", encoding, &std::collections::BTreeMap::new()).unwrap();
    for i in 0..count {
        let is_ros1 = encoding == "ros1";
        let mut body = Vec::new();
        let number = |value: u32| if big_endian { value.to_be_bytes() } else { value.to_le_bytes() };
        if is_ros1 {
            body.extend(number(i));
        }
        // Seconds, nanoseconds, and the frame `map`, which CDR ends with a zero.
        body.extend(number(100 + i));
        body.extend(number(0));
        body.extend(number(if is_ros1 { 3 } else { 4 }));
        body.extend(b"map");
        if !is_ros1 {
            body.push(0);
            body.resize(body.len().next_multiple_of(8), 0);
        }
        for value in [0.0, f64::from(i), 5.0, 0.0, 0.0, 0.0, 1.0_f64] {
            body.extend(if big_endian { value.to_be_bytes() } else { value.to_le_bytes() });
        }
        let mut data = if is_ros1 { Vec::new() } else { vec![0, u8::from(!big_endian), 0, 0] };
        data.extend(body);
        let header =
            mcap::records::MessageHeader { channel_id: channel, sequence: i, log_time: 1, publish_time: 1 };
        writer.write_to_known_channel(&header, &data).unwrap();
    }
    writer.finish().unwrap();
    drop(writer);
    file.into_inner()
}

#[test]
fn messages_are_decoded_in_both_byte_orders_and_as_ros_1() {
    let _report = FaultReport;
    for (encoding, big_endian) in [("cdr", false), ("cdr", true), ("ros1", false)] {
        let log = read_named("a.mcap", &poses(encoding, big_endian, 9), &auto()).unwrap();
        assert_eq!(log.rows.len(), 9, "{encoding} {big_endian}");
        assert!((log.rows[8].position_ned_m - DVec3::new(8.0, 0.0, -5.0)).length() < 1e-12);
        assert!((log.duration_s() - 8.0).abs() < 1e-12 && log.epoch_ns == 100_000_000_000);
        // A level body that looks along x looks east.
        let forward = log.rows[0].ned_from_body * DVec3::X;
        assert!((forward - DVec3::Y).length() < 1e-12, "{forward}");
    }
    refused(
        "a.mcap",
        &poses("json", false, 9),
        &auto(),
        &["no positions", "/p (geometry_msgs/PoseStamped as json)"],
    );
    refused("a.mcap", &poses("cdr", false, 0), &auto(), &["no positions"]);
}

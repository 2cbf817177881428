//! Clocks, dates, times in parts, gaps, and positions without a fix.

use super::*;

#[test]
fn clock_times_and_dates_are_read_across_rollovers() {
    let _report = FaultReport;
    let log_with_times = |time: &dyn Fn(u32) -> String| {
        let rows: String = (0..21)
            .map(|i| format!("{},{:.9},8,{}\n", time(i), 47.0 + f64::from(i) * 8.994_6e-5, 500 + i))
            .collect();
        format!("time,lat,lon,alt\n{rows}")
    };
    assert_flies("clock", &log_with_times(&|i| format!("10:00:{i:02}.5")), &track(), "");
    assert_flies(
        "clock past midnight",
        &log_with_times(&|i| {
            format!(
                "{:02}:{:02}:{:02}",
                if i < 5 { 23 } else { 0 },
                if i < 5 { 59 } else { 0 },
                (55 + i) % 60
            )
        }),
        &track(),
        "midnight",
    );
    assert_flies("half a clock", &log_with_times(&|i| format!("9:59:{i:02} AM")), &track(), "");
    assert_flies(
        "noon",
        &log_with_times(&|i| {
            if i < 5 { format!("11:59:{} AM", 55 + i) } else { format!("12:00:{:02} PM", i - 5) }
        }),
        &track(),
        "",
    );
    assert_flies("offset", &log_with_times(&|i| format!("2023-05-01T10:00:{i:02}+02:00")), &track(), "");
    assert_flies(
        "blank, quotes, slashes",
        &log_with_times(&|i| format!("\"2023/05/01 10:00:{i:02}.250\"")),
        &track(),
        "",
    );
    assert_flies(
        "over a leap day",
        &log_with_times(&|i| {
            if i < 10 {
                format!("2024-02-28T23:59:{}Z", 50 + i)
            } else {
                format!("2024-02-29T00:00:{:02}Z", i - 10)
            }
        }),
        &track(),
        "",
    );
    assert_flies(
        "seconds of the week",
        &log_with_times(&|i| format!("{}", (604_790 + i) % 604_800)),
        &track(),
        "GPS",
    );
    assert_flies(
        "a full counter",
        &log_with_times(&|i| format!("{}", (4_294_960_000_u64 + u64::from(i) * 1_000_000) % 4_294_967_296))
            .replace("time", "time_us"),
        &track(),
        "counter",
    );
    assert_refused(
        "day first",
        log_with_times(&|i| format!("01/05/2023 10:00:{i:02}")).as_bytes(),
        &track(),
        &["line 2, column 1 (`time`)", "year-month-day"],
    );
    assert_refused(
        "minutes and seconds",
        log_with_times(&|i| format!("0:{i:02}")).as_bytes(),
        &track(),
        &["hours:minutes:seconds"],
    );
    assert_refused(
        "a number among times",
        log_with_times(&|i| if i == 7 { "7".into() } else { format!("10:00:{i:02}") }).as_bytes(),
        &track(),
        &["line 9, column 1 (`time`): `7`"],
    );
    assert_refused(
        "a time among numbers",
        log_with_times(&|i| if i == 7 { "10:00:07".into() } else { format!("{i}") }).as_bytes(),
        &track(),
        &["line 9", "other rows have numbers"],
    );
    // Rows out of order are sorted: they do not fall by half of a rollover period.
    let log = read_with(
        log_with_times(&|i| {
            format!(
                "{}",
                if i == 7 {
                    9
                } else if i == 9 {
                    7
                } else {
                    i
                }
            )
        })
        .as_bytes(),
        &track(),
    )
    .unwrap();
    assert_eq!((log.report.out_of_order.count, log.duration_s()), (2, 20.0));
    let two = (0..21)
        .map(|i| format!("2023-05-01,10:00:{i:02},47.0 8.0,{}\n", 500 + i))
        .fold("Date,Time,GPS,Alt(m)\n".to_owned(), |a, b| a + &b);
    assert_eq!(read_with(two.as_bytes(), &track()).unwrap().duration_s(), 20.0);
    assert_refused(
        "three numbers of two",
        two.replace("47.0 8.0", "47.0 8.0 500").as_bytes(),
        &track(),
        &["`47.0 8.0 500`", "column 3 (`GPS`)"],
    );
    let key = FlightSpec { time_unit: TimeUnit::Ms, ..track() };
    assert_flies("a key without use", &log_with_times(&|i| format!("10:00:{i:02}")), &key, "not used");
}

#[test]
fn times_in_parts_and_vehicles_are_read_or_refused() {
    let _report = FaultReport;
    let log_with_times = |header: &str, time: &dyn Fn(u32) -> String| {
        let rows: String = (0..21)
            .map(|i| format!("{},{:.9},8,{}\n", time(i), 47.0 + f64::from(i) * 8.994_6e-5, 500 + i))
            .collect();
        format!("{header},lat,lon,alt\n{rows}")
    };
    let digits = log_with_times("time", &|i| {
        if i < 10 { format!("1541{}", 50 + i) } else { format!("1542{:02}", i - 10) }
    });
    assert_refused("digits of a clock", digits.as_bytes(), &track(), &["hhmmss", "flight.time_unit"]);
    assert_refused(
        "hours, minutes, seconds",
        log_with_times("hour,min,sec", &|i| format!("10,{},{}", i / 10, i % 10)).as_bytes(),
        &track(),
        &["several columns", "`sec`"],
    );
    assert_refused(
        "seconds and milliseconds",
        log_with_times("time,ms", &|i| format!("10:00:{:02},500", i)).as_bytes(),
        &track(),
        &["`time`", "`ms`"],
    );
    assert_flies(
        "an hour beside a time",
        &log_with_times("time_s,hour", &|i| format!("{i},10")),
        &track(),
        "",
    );
    assert_flies(
        "a date that never changes",
        &log_with_times("date,time", &|i| format!("1.5.23,10:00:{i:02}")),
        &track(),
        "holds dates that are not read (`1.5.23`)",
    );
    assert_refused(
        "dates day first",
        log_with_times("date,time", &|i| format!("{}/5/2023,10:00:{i:02}", 1 + i / 10)).as_bytes(),
        &track(),
        &["column 1 (`date`)", "year-month-day"],
    );
    assert_flies(
        "commas before fractions",
        &log_with_times("time", &|i| format!("\"10:00:{i:02},250\"")),
        &track(),
        "",
    );
    assert_refused(
        "two vehicles",
        log_with_times("callsign,t", &|i| format!("{},{i}", if i % 2 == 0 { "A" } else { "B" })).as_bytes(),
        &track(),
        &["line 3", "`B`", "one vehicle"],
    );
    assert_flies("one vehicle", &log_with_times("Vehicle Name,t", &|i| format!("A,{i}")), &track(), "");
    assert_refused(
        "two flights",
        log_with_times("t", &|i| format!("{}", i % 11)).as_bytes(),
        &track(),
        &["line 13", "several flights"],
    );
    let named = log_with_times("timestamp [ns]", &|i| format!("{i}"));
    let notes = read_with(named.as_bytes(), &track()).unwrap().notes;
    assert!(
        notes.iter().any(|note| note.is_warning && note.text.contains("the header's unit of time")),
        "{notes:?}"
    );
    assert_refused(
        "DJI's two heights",
        log_with_times("t,OSD.height [ft]", &|i| format!("{i},9")).replace("alt", "rel_alt").as_bytes(),
        &track(),
        &["take-off"],
    );
    let px4 = log_with_times("timestamp,time_utc_usec", &|i| {
        format!("{},{}", 112_574_307 + i * 1_000_000, 1_700_000_000_000_000_u64 + u64::from(i) * 1_000_000)
    });
    assert_flies("PX4's two times", &px4, &track(), "");
    let ground_station =
        log_with_times("Timestamp,altitudeRelative", &|i| format!("2023-05-01 10:00:{i:02}.123,9"))
            .replace(",alt\n", ",altitudeAMSL\n");
    assert_flies(
        "a ground station",
        &ground_station,
        &FlightSpec { height: FlightHeight::Msl, ..track() },
        "",
    );
    // Streams one after the other are one flight.
    let mut streams = "t,lat,lon,alt,roll,pitch,yaw\n".to_owned();
    streams
        .extend((0..21).map(|i| format!("{i},{:.9},8.0,{},,,\n", 47.0 + f64::from(i) * 8.994_6e-5, 500 + i)));
    streams.extend((0..40).map(|i| format!("{},,,,0,0,30\n", f64::from(i) * 0.5 + 0.25)));
    assert_flies("streams one after the other", &streams, &auto(), "positions are interpolated");
}

#[test]
fn null_fixes_jumps_and_sparse_rows_are_handled() {
    let _report = FaultReport;
    let header = "t,lat,lon,alt,roll,pitch,yaw";
    let usual = log(header, "T,LAT,LON,H,0,0,30");
    let nulls = usual
        .lines()
        .enumerate()
        .map(
            |(i, line)| if (1..4).contains(&i) { format!("{},0,0,0,0,0,30", i - 1) } else { line.to_owned() },
        )
        .collect::<Vec<_>>()
        .join("\n");
    let report = read_with(nulls.as_bytes(), &auto()).unwrap().report;
    assert_eq!((report.null_fixes.count, report.unusable.count), (3, 0), "{report}");
    // Half of the flight is elsewhere: that is a jump, not a spike.
    let away: String = usual
        .lines()
        .enumerate()
        .map(|(i, line)| if i > 10 { line.replace(",8.0,", ",9.0,") + "\n" } else { line.to_owned() + "\n" })
        .collect();
    let notes = read_with(away.as_bytes(), &auto()).unwrap().notes;
    assert!(notes.iter().any(|note| note.is_warning && note.text.contains("jumps by 76")), "{notes:?}");
    // Streams of position, height and attitude at three rates.
    let mut rows = vec!["t,lat,lon,alt,roll,pitch,yaw".to_owned()];
    for i in 0..=60 {
        let t = f64::from(i) / 3.0;
        rows.push(match i % 3 {
            0 => format!("{t:.4},{:.9},8.0,,,,", 47.0 + t * 8.994_6e-5),
            1 => format!("{t:.4},,,{:.4},,,", 500.0 + t),
            _ => format!("{t:.4},,,,1,2,30"),
        });
    }
    let log = read_with(rows.join("\n").as_bytes(), &auto()).unwrap();
    let moved = log.rows.last().unwrap().position_ned_m - log.rows[0].position_ned_m;
    let speed = moved / log.duration_s();
    assert!((speed.x - 10.0).abs() < 1e-2 && (speed.z + 1.0).abs() < 1e-2, "{speed}");
    assert!(
        log.notes.iter().any(|note| note.is_warning && note.text.contains("heights and positions")),
        "{:?}",
        log.notes
    );
}

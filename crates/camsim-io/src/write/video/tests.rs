#![allow(clippy::unwrap_used, reason = "tests")]

use std::{path::Path, process::Command};

use camsim_core::{
    frame::RenderedFrame,
    scenario::{ImageFormat, OutputEncoding, OutputSpec, VideoCodec, VideoSpec},
};

use crate::write::{FrameFiles, FrameWriter, WriteError};

/// x265 refuses smaller ones.
const SIZE: [u32; 2] = [64, 48];

/// A picture of one colour, which changes with the number of the frame, and a white corner.
fn frame(index: u64) -> RenderedFrame {
    let colour = [0.1 * index as f32, 0.5, 0.9 - 0.1 * index as f32, 1.0];
    let mut color_rgba = colour.repeat((SIZE[0] * SIZE[1]) as usize);
    color_rgba[..4].copy_from_slice(&[1.0, f32::NAN, 2.0, 1.0]);
    RenderedFrame {
        index,
        stamp_ns: 1_000_000_000 + 40_000_000 * index as i64,
        ..RenderedFrame::picture(SIZE, color_rgba)
    }
}

fn files(folder: &Path, format: ImageFormat, video: VideoSpec) -> FrameFiles {
    let output = OutputSpec { format: vec![format, ImageFormat::Png], video, ..OutputSpec::default() };
    FrameFiles::new(folder, &output, OutputEncoding::Srgb8)
}

/// Writes frames as a video and as PNG files.
fn write(folder: &Path, format: ImageFormat, video: VideoSpec, frames: &[u64]) -> FrameFiles {
    let files = files(folder, format, video);
    let mut writer = FrameWriter::new(files.clone(), 2).with_videos(25.0, frames).unwrap();
    frames.iter().for_each(|&index| writer.write(frame(index)).unwrap());
    let summary = writer.finish().unwrap();
    let on_disk: u64 = names(folder).iter().map(|name| folder.join(name).metadata().unwrap().len()).sum();
    assert_eq!((summary.frames, summary.bytes), (frames.len() as u64, on_disk));
    files
}

/// Files in the folder and in `color`.
fn names(folder: &Path) -> Vec<String> {
    let list = |prefix: &str| {
        let entries = std::fs::read_dir(folder.join(prefix)).unwrap().flatten();
        let files = entries.filter(|entry| entry.path().is_file());
        files.map(|entry| format!("{prefix}{}", entry.file_name().to_string_lossy())).collect::<Vec<_>>()
    };
    let mut names = [list(""), list("color/")].concat();
    names.sort();
    names
}

#[test]
fn y4m_has_the_documented_bytes() {
    let folder = tempfile::tempdir().unwrap();
    let files = write(folder.path(), ImageFormat::Y4m, VideoSpec::default(), &[3, 4]);
    assert!(files.has_video() && files.exist(3) && files.exist(4));
    let bytes = std::fs::read(folder.path().join("color.y4m")).unwrap();
    let header = b"YUV4MPEG2 W64 H48 F25:1 Ip A1:1 C444 XCOLORRANGE=LIMITED\n";
    assert!(bytes.starts_with(header));
    let plane = (SIZE[0] * SIZE[1]) as usize;
    assert_eq!(bytes.len(), header.len() + 2 * (6 + 3 * plane));
    // sRGB of (0.3, 0.5, 0.6) is (0.5838, 0.7354, 0.7977); Y' = 0.6972, Cb = 0.0567, Cr = -0.0809.
    let first = &bytes[header.len() + 6..];
    assert_eq!([first[1], first[plane + 1], first[2 * plane + 1]], [169, 141, 110]);
    // White with NaN for green is magenta: Y' = 0.413.
    assert_eq!(first[0], 106);
}

#[test]
fn ten_bits_have_finer_codes() {
    let folder = tempfile::tempdir().unwrap();
    let video = VideoSpec { bits: 10, ..VideoSpec::default() };
    write(folder.path(), ImageFormat::Y4m, video, &[3]);
    let bytes = std::fs::read(folder.path().join("color.y4m")).unwrap();
    let begin = bytes.windows(6).position(|window| window == b"FRAME\n").unwrap() + 6;
    assert!(bytes.starts_with(b"YUV4MPEG2 W64 H48 F25:1 Ip A1:1 C444p10 "));
    assert_eq!(bytes.len(), begin + 6 * (SIZE[0] * SIZE[1]) as usize);
    assert_eq!(u16::from_le_bytes([bytes[begin + 2], bytes[begin + 3]]), 675);
}

#[test]
fn a_video_without_all_its_frames_is_removed() {
    let folder = tempfile::tempdir().unwrap();
    let files = files(folder.path(), ImageFormat::Y4m, VideoSpec::default());
    let mut writer = FrameWriter::new(files.clone(), 1).with_videos(25.0, &[0, 1, 2]).unwrap();
    writer.write(frame(0)).unwrap();
    writer.finish().unwrap();
    assert_eq!(names(folder.path()), ["color/frame_000000.png"]);
    assert!(!files.exist(0));
}

#[test]
fn frames_must_be_equally_spaced() {
    let folder = tempfile::tempdir().unwrap();
    let start = |frames: &[u64]| {
        let files = files(folder.path(), ImageFormat::Y4m, VideoSpec::default());
        FrameWriter::new(files, 1).with_videos(25.0, frames)
    };
    assert!(start(&[]).is_ok() && start(&[7]).is_ok() && start(&[1, 4, 7]).is_ok());
    let error = start(&[1, 4, 5]).err().map(|error: WriteError| error.to_string()).unwrap();
    assert!(
        error.contains("color.y4m: a video needs frames at equal distances, but 5 comes after 4"),
        "{error}"
    );
}

/// Code values of a video's frames, by ffmpeg; `None` if there is no ffmpeg.
fn decoded(path: &Path, pixel_format: &str) -> Option<Vec<u8>> {
    let mut command = Command::new("ffmpeg");
    command.args(["-loglevel", "error", "-i"]).arg(path);
    let output = command.args(["-f", "rawvideo", "-pix_fmt", pixel_format, "-"]).output().ok()?;
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    Some(output.stdout)
}

#[test]
fn ffv1_gives_back_the_codes_of_the_png_files() {
    if Command::new("ffmpeg").arg("-version").output().is_err() {
        return eprintln!("skipped: there is no ffmpeg");
    }
    let folder = tempfile::tempdir().unwrap();
    let video = VideoSpec { codec: VideoCodec::Ffv1, ..VideoSpec::default() };
    write(folder.path(), ImageFormat::Mkv, video, &[0, 2, 4]);
    let Some(codes) = decoded(&folder.path().join("color.mkv"), "rgb24") else { return };
    let pictures = [0, 2, 4].map(|index| {
        let path = folder.path().join(format!("color/frame_{index:06}.png"));
        image::open(path).unwrap().to_rgb8().into_raw()
    });
    assert_eq!(codes, pictures.concat());
}

#[test]
fn h264_and_h265_keep_colours_and_rate() {
    if Command::new("ffmpeg").arg("-version").output().is_err() {
        return eprintln!("skipped: there is no ffmpeg");
    }
    for (codec, bits, format) in [
        (VideoCodec::H264, 8, ImageFormat::Mp4),
        (VideoCodec::H264, 10, ImageFormat::Mkv),
        (VideoCodec::H265, 10, ImageFormat::Mp4),
    ] {
        let folder = tempfile::tempdir().unwrap();
        write(folder.path(), format, VideoSpec { codec, bits, crf: 4 }, &[0, 1, 2, 3]);
        let path = folder.path().join(format!("color.{}", format.ending()));
        let Some(codes) = decoded(&path, "rgb24") else { return };
        let plane = (SIZE[0] * SIZE[1] * 3) as usize;
        assert_eq!(codes.len(), 4 * plane, "{codec:?}");
        // In the middle, away from the corner; two codes for rounding to Y', Cb, Cr and quantisation.
        let middle = &codes[3 * plane + plane / 2 + 96..][..3];
        let expected = [0.3, 0.5, 0.6].map(crate::write::srgb8);
        assert!(
            middle.iter().zip(expected).all(|(a, b)| a.abs_diff(b) <= 2),
            "{codec:?} {middle:?} {expected:?}"
        );
        let rate = Command::new("ffprobe")
            .args([
                "-v",
                "error",
                "-show_entries",
                "stream=avg_frame_rate:format_tags=comment",
                "-of",
                "csv=p=0",
            ])
            .arg(&path)
            .output()
            .unwrap();
        let rate = String::from_utf8(rate.stdout).unwrap();
        assert!(rate.contains("25/1") && rate.contains("stamp 1000000000 ns"), "{rate}");
    }
}

//! Files hold the drawn pictures and appear completely or not at all. Failures name the file and the reason.

use crate::common;
use std::time::Duration;

use crate::common::{Folder, read_png};
use marathon_render::{
    Camera, Corner, Format, GifWriter, Image, Mp4Writer, Recorder, RenderError, Renderer, status_line, strip,
};

/// Pictures of a moving camera, like a video of a run.
fn video(count: usize) -> Vec<Image> {
    let (frame, camera) = common::shapes();
    let renderer = Renderer::new(96, 60).unwrap();
    let shot = |i: usize| {
        let x = 0.05 * i as f64;
        let camera = Camera {
            eye: [camera.eye[0] + x, camera.eye[1], camera.eye[2]],
            target: [camera.target[0] + x, camera.target[1], camera.target[2]],
            ..camera
        };
        renderer.render(&frame, &camera)
    };
    (0..count).map(shot).collect()
}

#[test]
fn png_holds_the_pixels() {
    let folder = Folder::new("png");
    let image = &video(1)[0];
    image.save_png(folder.path("a.png")).unwrap();
    assert_eq!(read_png(&folder.path("a.png")), (96, 60, image.rgb().to_vec()));
    assert_eq!(folder.names(), ["a.png"]);
}

#[test]
fn gif_has_every_frame_at_its_time_and_looks_alike() {
    let folder = Folder::new("gif");
    // more frames than the palette is learned from, with a still moment in between
    let mut frames = video(30);
    frames[12] = frames[11].clone();
    let mut writer = GifWriter::create(folder.path("run.gif"), 30.0).unwrap();
    for frame in &frames {
        writer.push(frame).unwrap();
    }
    assert!(!folder.names().contains(&"run.gif".to_owned()), "the file appeared before it was finished");
    writer.finish().unwrap();
    assert_eq!(folder.names(), ["run.gif"]);

    let file = std::fs::File::open(folder.path("run.gif")).unwrap();
    let mut options = gif::DecodeOptions::new();
    options.set_color_output(gif::ColorOutput::RGBA);
    let mut decoder = options.read_info(file).unwrap();
    assert_eq!([decoder.width(), decoder.height()], [96, 60]);

    let mut canvas = vec![0_u8; 96 * 60 * 3];
    let (mut count, mut hundredths) = (0, 0);
    while let Some(part) = decoder.read_next_frame().unwrap() {
        for (i, pixel) in part.buffer.chunks_exact(4).enumerate().filter(|(_, pixel)| pixel[3] > 0) {
            let x = usize::from(part.left) + i % usize::from(part.width);
            let y = usize::from(part.top) + i / usize::from(part.width);
            canvas[3 * (y * 96 + x)..][..3].copy_from_slice(&pixel[..3]);
        }
        hundredths += u32::from(part.delay);
        let gaps = canvas.iter().zip(frames[count].rgb()).map(|(a, b)| u64::from(a.abs_diff(*b)));
        let mean = gaps.sum::<u64>() as f64 / canvas.len() as f64;
        assert!(mean < 5.0, "frame {count} differs by {mean:.1} of 255 on average");
        count += 1;
    }
    assert_eq!((count, hundredths), (30, 100));
    assert_eq!(decoder.repeat(), gif::Repeat::Infinite);
}

#[test]
fn strip_puts_frames_side_by_side() {
    let frames = video(5);
    let image = strip(&frames, 3).unwrap();
    assert_eq!([image.width(), image.height()], [3 * 96 + 2, 2 * 60 + 1]);
    for (i, frame) in frames.iter().enumerate() {
        let (left, top) = ((i % 3) * 97, (i / 3) * 61);
        for (x, y) in [(0, 0), (95, 59), (40, 31)] {
            assert_eq!(image.pixel(left + x, top + y), frame.pixel(x, y), "frame {i}");
        }
    }
    assert_eq!(image.pixel(96, 10), [246, 248, 250]);

    assert_eq!(strip(&[], 3).unwrap_err().to_string(), "strip: no frames");
    let odd = [frames[0].clone(), frames[1].crop_width(50)];
    let message = strip(&odd, 2).unwrap_err().to_string();
    assert_eq!(message, "frame 1 is [50, 60] pixels, expected [96, 60] like the first one");
}

#[test]
fn recorder_goes_by_the_extension() {
    let folder = Folder::new("recorder");
    for name in ["a.png", "a.GIF"] {
        let mut recorder = Recorder::create(folder.path(name), 25.0, 2).unwrap();
        for frame in video(3) {
            recorder.push(&frame).unwrap();
        }
        recorder.finish().unwrap();
    }
    assert_eq!(folder.names(), ["a.GIF", "a.png"]);
    assert_eq!(read_png(&folder.path("a.png")).0, 2 * 96 + 1);

    assert_eq!(Format::of("x.mp4").unwrap(), Format::Mp4);
    let message = |path: &str| Format::of(path).unwrap_err().to_string();
    assert_eq!(message("x.gfi"), "x.gfi: unknown extension 'gfi', expected png, gif or mp4; did you mean 'gif'?");
    assert_eq!(message("run"), "run: unknown extension '', expected png, gif or mp4; did you mean 'png'?");
}

#[test]
fn failures_name_the_file_and_leave_none() {
    let folder = Folder::new("failures");
    let frames = video(2);

    let nowhere = folder.path("missing/a.png");
    let message = frames[0].save_png(&nowhere).unwrap_err().to_string();
    assert!(message.starts_with(&format!("{}: cannot create: ", nowhere.display())), "{message}");

    let gif = folder.path("a.gif");
    let empty = GifWriter::create(&gif, 25.0).unwrap().finish().unwrap_err();
    assert_eq!(empty.to_string(), format!("{}: no frames", gif.display()));
    assert!(matches!(GifWriter::create(&gif, 60.0), Err(RenderError::Fps { .. })));
    assert!(matches!(GifWriter::create(&gif, f64::NAN), Err(RenderError::Fps { .. })));

    let mut writer = GifWriter::create(&gif, 25.0).unwrap();
    writer.push(&frames[0]).unwrap();
    let wrong = writer.push(&frames[1].crop_width(40)).unwrap_err();
    assert!(matches!(wrong, RenderError::FrameSize { index: 1, .. }), "{wrong}");
    drop(writer);

    let mp4 = folder.path("a.mp4");
    let Err(error) = Mp4Writer::with_program(&mp4, 25.0, "no-such-ffmpeg") else { panic!("there is no such program") };
    let message = error.to_string();
    assert!(message.contains("a.mp4") && message.contains("install ffmpeg") && message.contains(".gif"), "{message}");

    assert_eq!(folder.names(), [""; 0], "a failed write left something behind");
    assert!(matches!(Renderer::new(0, 10), Err(RenderError::Size { .. })));
    assert!(matches!(Image::new(10, 1 << 40, [0; 3]), Err(RenderError::Size { .. })));
}

/// A stand-in for ffmpeg: lists one encoder, checks its input's size and copies it to the output file.
#[cfg(unix)]
fn stand_in(folder: &Folder, body: &str) -> String {
    use std::os::unix::fs::PermissionsExt;
    let path = folder.path("encoder.sh");
    let listing = "case \"$*\" in *-encoders*) echo ' V....D libx264 H.264'; exit 0;; esac";
    std::fs::write(&path, format!("#!/bin/sh\n{listing}\n{body}\n")).unwrap();
    std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o755)).unwrap();
    // the file may still count as open for writing in a process that another test forks just now
    std::thread::sleep(Duration::from_millis(50));
    path.display().to_string()
}

#[cfg(unix)]
#[test]
fn mp4_feeds_the_encoder_every_byte() {
    let folder = Folder::new("mp4");
    // put the frames into the boxes of a video, with a table that counts them
    let count = 3_u8;
    let frames = video(count.into());
    let mut table = vec![0, 0, 0, 20, b's', b't', b's', b'z', 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, count];
    for kind in [b"stbl", b"minf", b"mdia", b"trak", b"moov"] {
        table = [&(8 + table.len() as u32).to_be_bytes()[..], kind, &table].concat();
    }
    let sent: Vec<u8> = frames.iter().flat_map(|frame| frame.rgb().iter().copied()).collect();
    let head = [b"\0\0\0\x0cftypisom", &table[..], &(8 + sent.len() as u32).to_be_bytes(), b"mdat"].concat();
    std::fs::write(folder.path("encoder.sh.head"), &head).unwrap();

    let body = "echo \"$*\" > \"$0.args\"; for last; do :; done; cat \"$0.head\" - > \"$last\"";
    let mut writer = Mp4Writer::with_program(folder.path("run.mp4"), 25.0, &stand_in(&folder, body)).unwrap();
    for frame in &frames {
        writer.push(frame).unwrap();
    }
    writer.finish().unwrap();
    assert_eq!(std::fs::read(folder.path("run.mp4")).unwrap(), [head, sent].concat());
    let arguments = std::fs::read_to_string(folder.path("encoder.sh.args")).unwrap();
    assert!(arguments.contains("-pix_fmt rgb24 -s 96x60 -r 25 -i - -c:v libx264"), "{arguments}");
    assert_eq!(folder.names(), ["encoder.sh", "encoder.sh.args", "encoder.sh.head", "run.mp4"]);
}

#[cfg(unix)]
#[test]
fn mp4_reports_the_encoders_own_words() {
    let folder = Folder::new("mp4-fails");
    let program = stand_in(&folder, "echo 'no space for this video' >&2; exit 3");
    let mut writer = Mp4Writer::with_program(folder.path("run.mp4"), 25.0, &program).unwrap();
    // the pipe may take a few frames before the writer notices that its reader is gone
    let failed = video(40).iter().find_map(|frame| writer.push(frame).err());
    let message = match failed {
        Some(error) => error.to_string(),
        None => writer.finish().unwrap_err().to_string(),
    };
    assert!(message.contains("run.mp4") && message.contains("no space for this video"), "{message}");
    assert!(!folder.names().contains(&"run.mp4".to_owned()));
}

#[test]
fn captions_stay_inside_and_are_legible() {
    let mut image = Image::new(400, 180, [90, 90, 90]).unwrap();
    for corner in [Corner::TopLeft, Corner::TopRight, Corner::BottomLeft, Corner::BottomRight] {
        image.caption(corner, &[status_line(3.2, 10.42, 3.31)]);
    }
    let bright = |x0: usize, y0: usize| {
        let pixels = (x0..x0 + 200).flat_map(|x| (y0..y0 + 90).map(move |y| (x, y)));
        pixels.filter(|&(x, y)| image.pixel(x, y)[0] > 200).count()
    };
    let ink = bright(0, 0);
    assert!(ink > 100, "{ink} lit dots");
    assert_eq!([bright(200, 0), bright(0, 90), bright(200, 90)], [ink; 3]);
    assert_eq!(image.pixel(200, 90), [90; 3]);

    assert_eq!(status_line(3.2, 10.42, 3.31), " 3.20 s   10.4 m   3.3 m/s");
    // off every edge: cut off, no panic
    image.text(-20, -3, 2, [255; 3], "left");
    image.text(290, 175, 3, [255; 3], "right \u{1F3C3}");
    Image::new(3, 3, [0; 3]).unwrap().caption(Corner::BottomRight, &["much too long for this"]);
}

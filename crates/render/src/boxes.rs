//! Checks that an MP4 file is complete. Encoders may report success after the disk has filled up.

use std::io::{self, Read, Seek, SeekFrom};

/// Path of boxes from the file to the table of the frames.
const TABLE: [&[u8; 4]; 6] = [b"moov", b"trak", b"mdia", b"minf", b"stbl", b"stsz"];

/// Checks that the boxes of a file fill it exactly, that it contains the video's data, and that it has `frames` frames.
///
/// # Errors
/// [`io::ErrorKind::InvalidData`] with the missing part, or the file's I/O error.
pub(crate) fn check(file: &mut (impl Read + Seek), frames: usize) -> io::Result<()> {
    let length = file.seek(SeekFrom::End(0))?;
    let top = boxes(file, 0..length)?;
    let find = |all: &[Box], kind: &[u8; 4]| {
        all.iter().find(|b| b.kind == *kind).map(|b| b.body.clone()).ok_or_else(|| missing(kind))
    };
    find(&top, b"ftyp")?;
    find(&top, b"mdat")?;
    let mut body = 0..length;
    for kind in TABLE {
        body = find(&boxes(file, body)?, kind)?;
    }
    // version and flags, one size for all frames, number of frames
    let mut table = [0; 12];
    file.seek(SeekFrom::Start(body.start))?;
    file.read_exact(&mut table)?;
    let found = u32::from_be_bytes([table[8], table[9], table[10], table[11]]) as usize;
    if found < frames { Err(invalid(format!("it has {found} of {frames} frames"))) } else { Ok(()) }
}

struct Box {
    kind: [u8; 4],
    body: std::ops::Range<u64>,
}

/// The boxes in a range of the file, which they must fill.
fn boxes(file: &mut (impl Read + Seek), range: std::ops::Range<u64>) -> io::Result<Vec<Box>> {
    let cut = || invalid("it is cut short".into());
    let mut all = Vec::new();
    let mut at = range.start;
    while at < range.end {
        let mut head = [0; 16];
        file.seek(SeekFrom::Start(at))?;
        file.read_exact(&mut head[..8]).map_err(|_| cut())?;
        let [a, b, c, d, kind @ ..] = *head.first_chunk::<8>().unwrap_or(&[0; 8]);
        let (size, begins) = match u32::from_be_bytes([a, b, c, d]) {
            // a 64-bit size follows
            1 => {
                file.read_exact(&mut head[8..]).map_err(|_| cut())?;
                (u64::from_be_bytes(*head.last_chunk().unwrap_or(&[0; 8])), 16)
            }
            size => (u64::from(size), 8),
        };
        let end = at.checked_add(size).filter(|end| size >= begins && *end <= range.end).ok_or_else(cut)?;
        all.push(Box { kind, body: at + begins..end });
        at = end;
    }
    Ok(all)
}

fn missing(kind: &[u8; 4]) -> io::Error {
    invalid(format!("its part '{}' is missing", kind.escape_ascii()))
}

fn invalid(problem: String) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, problem)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Cursor;

    fn one(kind: &[u8; 4], body: &[u8]) -> Vec<u8> {
        [&(8 + body.len() as u32).to_be_bytes()[..], kind, body].concat()
    }

    fn video(frames: u32) -> Vec<u8> {
        let mut table = one(b"stsz", &[[0; 4], [0; 4], frames.to_be_bytes()].concat());
        for kind in TABLE.iter().rev().skip(1) {
            table = [one(b"free", b"x"), one(kind, &table)].concat();
        }
        // a box with a 64-bit size, as in videos above 4 GB
        let long = [&1u32.to_be_bytes()[..], b"mdat", &20u64.to_be_bytes(), b"data"].concat();
        [one(b"ftyp", b"isom"), table, long].concat()
    }

    #[test]
    fn a_whole_video_passes_and_a_part_of_it_does_not() {
        let whole = video(7);
        check(&mut Cursor::new(&whole), 7).unwrap();
        let error = check(&mut Cursor::new(&whole), 8).unwrap_err().to_string();
        assert_eq!(error, "it has 7 of 8 frames");
        for n in 0..whole.len() {
            let error = check(&mut Cursor::new(&whole[..n]), 7).unwrap_err();
            assert_eq!(error.kind(), io::ErrorKind::InvalidData, "{n} bytes: {error}");
        }
        let longer = [&whole[..], &[0; 9]].concat();
        assert_eq!(check(&mut Cursor::new(&longer), 7).unwrap_err().to_string(), "it is cut short");
        let error = check(&mut Cursor::new(one(b"ftyp", b"isom")), 7).unwrap_err().to_string();
        assert_eq!(error, "its part 'mdat' is missing");
    }
}

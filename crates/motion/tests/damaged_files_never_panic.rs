//! Readers do not panic on randomly damaged files, and name the file in every error.

use crate::common::shipped;
use marathon_motion::{Clip, import};

/// Reproducible pseudorandom numbers (Steele, Lea and Flood, splitmix64).
struct Random(u64);

impl Random {
    fn below(&mut self, end: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) % end as u64) as usize
    }
}

/// A file with some bytes replaced, left out or repeated.
fn damaged(good: &[u8], random: &mut Random) -> Vec<u8> {
    const PARTS: [&[u8]; 12] = [b"-", b"e9", b"0", b"9", b"{", b"}", b"[", b",", b"nan", b"1e308", b" ", b"\xff"];
    let mut bytes = good.to_vec();
    for _ in 0..1 + random.below(4) {
        let at = random.below(bytes.len());
        match random.below(4) {
            0 => bytes.truncate(at + 1),
            1 => drop(bytes.remove(at)),
            2 => drop(bytes.splice(at..at, PARTS[random.below(PARTS.len())].iter().copied())),
            _ => {
                let end = (at + random.below(40)).min(bytes.len());
                let part = bytes[at..end].to_vec();
                bytes.splice(at..at, part);
            }
        }
        if bytes.is_empty() {
            break;
        }
    }
    bytes
}

#[test]
fn damaged_files_are_read_or_refused_by_name() {
    let walk = String::from_utf8(shipped("walker2d", "run").to_bytes()).unwrap();
    // with the checksum, every change would be refused early
    let walk: String = walk.lines().filter(|line| !line.contains("checksum")).map(|line| format!("{line}\n")).collect();
    let walk = walk.into_bytes();
    let bvh =
        b"HIERARCHY\nROOT Hips\n{\n  OFFSET 0 0 0\n  CHANNELS 3 Xposition Yposition Zrotation\n  JOINT Leg\n  {\n    \
        OFFSET 0 -80 0\n    CHANNELS 1 Xrotation\n    End Site\n    {\n      OFFSET 0 -10 0\n    }\n  }\n}\n\
        MOTION\nFrames: 3\nFrame Time: 0.1\n0 90 0 0\n0 90 0 5\n0 90 1 9\n";
    let turns = |count: usize| ",1,0,0,0".repeat(count);
    let [four, two, one] = [4, 2, 1].map(turns);
    let frame = format!("[0.1,0,0.9,0{four},0.1{two},0.2{one},0.3{two},0.4]");
    let deepmimic = format!("{{\"Loop\": \"wrap\", \"Frames\": [{frame}, {frame}, {frame}]}}");
    let mut random = Random(7);
    let (mut read, mut refused) = (0, 0);
    for i in 0..30_000 {
        let result = match i % 3 {
            0 => Clip::parse_without_checksum("f.motion".as_ref(), &damaged(&walk, &mut random)),
            1 => import::any("f.bvh".as_ref(), &damaged(bvh, &mut random))
                .and_then(|a| a.looped("f.bvh".as_ref()).map(|a| a.clip().clone())),
            _ => import::any("f.json".as_ref(), &damaged(deepmimic.as_bytes(), &mut random))
                .and_then(|a| a.looped("f.json".as_ref()).map(|a| a.clip().clone())),
        };
        match result {
            Ok(clip) => {
                read += 1;
                assert_eq!(Clip::parse("f.motion".as_ref(), &clip.to_bytes()).as_ref(), Ok(&clip));
                let _ = clip.resample("f.motion".as_ref(), 0.03);
                let _ = clip.smooth("f.motion".as_ref(), 0.05);
            }
            Err(error) => {
                refused += 1;
                assert!(error.to_string().starts_with("f."), "{error}");
            }
        }
    }
    assert!(read > 1000 && refused > 10_000, "{read} read, {refused} refused");
}

//! Arguments of a task as two entries: `options`, and `clips`, the motion clips in them that do not come with Marathon, as
//! texts of `.motion` files by their names. An entry that would be empty is left out.
//!
//! For serde's `flatten` and `with`.

use marathon_envs::{Clips, NamedClip, Options};
use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::collections::BTreeMap;

#[derive(Serialize, Deserialize)]
struct Stored {
    #[serde(default, skip_serializing_if = "Options::is_empty", with = "super")]
    options: Options,
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    clips: BTreeMap<String, String>,
}

/// Writes arguments and their clips.
///
/// # Errors
/// Those of the serializer.
pub fn serialize<S: Serializer>(options: &Options, serializer: S) -> Result<S::Ok, S::Error> {
    let text = |bytes: Vec<u8>| String::from_utf8_lossy(&bytes).into_owned();
    let clips = options.given_clips().into_iter().map(|(name, clip)| (name.into(), text(clip.to_bytes()))).collect();
    Stored { options: options.clone(), clips }.serialize(serializer)
}

/// Reads arguments and puts the clips in place of their names.
///
/// # Errors
/// If a value is none that an argument can have, or a clip is damaged or has a name that is no file's.
pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Options, D::Error> {
    let Stored { options, clips } = Stored::deserialize(deserializer)?;
    let (count, most) = (clips.len(), Clips::MOST);
    if count > most {
        return Err(D::Error::custom(format!("found {count} clips, expected at most {most}")));
    }
    let clip = |(name, text): (&String, &String)| match NamedClip::file_name(name) == *name {
        true => NamedClip::parse(name, text.as_bytes()).map_err(D::Error::custom),
        false => Err(D::Error::custom(format!("clip '{name}', expected a file's name that ends in .motion"))),
    };
    Ok(options.bind_clips(&clips.iter().map(clip).collect::<Result<Vec<_>, _>>()?))
}

#[cfg(test)]
mod tests {
    use super::*;
    use marathon_envs::agents::marathon::marathon_man::clips::shipped;
    use serde_json::json;

    #[derive(Debug, PartialEq, Serialize, Deserialize)]
    struct File {
        agent: String,
        #[serde(flatten, with = "super")]
        options: Options,
        act: f32,
    }

    fn file(options: Options) -> File {
        File { agent: "MarathonMan-v0".into(), options, act: 0.1 }
    }

    #[test]
    fn clips_come_back_as_they_were() {
        let kick = shipped("kick").unwrap();
        let clips = [NamedClip::shipped("walk"), NamedClip::new("mine", kick.clone()), NamedClip::shipped("run")];
        let written = file(Options::new().with("future", 2.0).with("clip", Clips::from_iter(clips)));
        let text = serde_json::to_string(&written).unwrap();
        assert!(
            text.starts_with(r#"{"agent":"MarathonMan-v0","options":{"future":2.0,"clip":"walk,mine.motion,run"},"#)
        );
        let read: File = serde_json::from_str(&text).unwrap();
        assert_eq!(read, written);
        assert_eq!(*read.options.given_clips()["mine.motion"], kick);
        // names alone need nothing beside them
        let text = serde_json::to_value(file(Options::new().with("clip", "walk"))).unwrap();
        assert_eq!(text, json!({"agent": "MarathonMan-v0", "options": {"clip": "walk"}, "act": 0.1_f32}));
    }

    #[test]
    fn bad_clips_are_refused_by_name() {
        let refused = |clips: serde_json::Value| {
            let document = json!({"agent": "a", "options": {"clip": "mine.motion"}, "clips": clips, "act": 1.0});
            serde_json::from_value::<File>(document).unwrap_err().to_string()
        };
        let error = refused(json!({"../mine.motion": ""}));
        assert_eq!(error, "clip '../mine.motion', expected a file's name that ends in .motion");
        assert!(refused(json!({"walk": ""})).contains("clip 'walk'"));
        assert!(refused(json!({"mine.motion": "{}"})).contains("mine.motion"));
        let many: BTreeMap<String, String> =
            (0..=Clips::MOST).map(|i| (format!("{i}.motion"), String::new())).collect();
        assert_eq!(refused(json!(many)), "found 1001 clips, expected at most 1000");
    }
}

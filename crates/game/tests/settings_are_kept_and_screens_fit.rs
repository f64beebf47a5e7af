//! Settings are kept in one readable file; a bad file is renamed and reported. All screens fit windows of every size.

use crate::windowless::{self, frames};
use bevy::prelude::*;
use bevy::window::WindowResolution;
use bevy_egui::{EguiContext, PrimaryEguiContext, egui};
use marathon_game::app::{
    Bindable, Bindings, Detail, Hud, Menu, Mode, Press, Prompts, QualityChoice, Scenario, Screen, Settings,
    SettingsFile, ShippedPolicies, Steer, Volumes, load_settings, switch_mode,
};
use std::error::Error;
use std::time::Duration;

const FRAME: Duration = Duration::from_millis(20);

#[test]
fn settings_come_back_in_the_next_game() -> Result<(), Box<dyn Error>> {
    let folder = tempfile::tempdir()?;
    let path = folder.path().join("marathon/settings.json");
    let mut app = windowless::game(&["hopper"], FRAME, |app| {
        app.insert_resource(SettingsFile(path.clone()));
    });
    assert!(!path.exists(), "nothing has changed");
    let mut settings = app.world_mut().resource_mut::<Settings>();
    settings.sound.master = 0.25;
    settings.display.quality = QualityChoice::High;
    settings.interface.detail = Detail::Play;
    app.world_mut().resource_mut::<Bindings>().bind(Bindable::Steer(Steer::Jump), Press::Key(KeyCode::KeyU));
    frames(&mut app, 60);
    assert_eq!(app.world().resource::<Volumes>().master, 0.25, "they take effect");
    assert_eq!(*app.world().resource::<bevy_marathon::look::Quality>(), bevy_marathon::look::Quality::High);
    assert_eq!(app.world().resource::<Hud>().detail, Detail::Play);
    let loaded = load_settings(&path);
    assert_eq!(loaded.notes, Vec::<String>::new());
    assert_eq!(loaded.settings, *app.world().resource::<Settings>());
    assert_eq!(loaded.settings.bindings.steering_key(Steer::Jump), KeyCode::KeyU);
    let text = std::fs::read_to_string(&path)?;
    assert!(text.contains("\"master\": 0.25") && text.contains("\"jump\": \"U\""), "{text}");
    // a change just before the end is saved as well
    app.world_mut().resource_mut::<Settings>().sound.master = 0.5;
    app.world_mut().write_message(AppExit::Success);
    frames(&mut app, 1);
    assert_eq!(load_settings(&path).settings.sound.master, 0.5);
    Ok(())
}

#[test]
fn a_bad_file_is_renamed_and_reported_with_its_place() -> Result<(), Box<dyn Error>> {
    let folder = tempfile::tempdir()?;
    let path = folder.path().join("settings.json");
    for (text, parts) in [
        ("{\"sound\": {\"master\": 0.5,}}", &["line 1", "column"][..]),
        ("{\n \"display\": {\"quality\": \"hgih\"}}", &["hgih", "high", "line 2"]),
        ("{\"sound\": {\"master\": 7}}", &["sound.master is 7", "from 0 to 1"]),
        ("{\"bindings\": {\"keys\": {\"jump\": \"Spaec\"}}}", &["did you mean 'Space'"]),
        ("[", &["line 1"]),
    ] {
        std::fs::write(&path, text)?;
        let loaded = load_settings(&path);
        assert_eq!(loaded.settings, Settings::default(), "{text}");
        let note = loaded.notes.join(" ");
        assert!(parts.iter().all(|part| note.contains(part)) && note.contains(".bad"), "{text}: {note}");
        assert!(!path.exists());
        assert_eq!(std::fs::read_to_string(folder.path().join("settings.json.bad"))?, text);
    }
    // unknown names are reported, and the rest counts
    std::fs::write(&path, r#"{"sound": {"mastr": 1, "effects": 0.5}, "bindings": {"keys": {"jmup": "U"}}}"#)?;
    let loaded = load_settings(&path);
    assert_eq!(loaded.settings.sound.effects, 0.5);
    let notes = loaded.notes.join("\n");
    assert!(notes.contains("sound.mastr; did you mean 'master'?"), "{notes}");
    assert!(notes.contains("bindings.keys.jmup; did you mean 'jump'?") && path.exists(), "{notes}");
    Ok(())
}

/// An area over the picture, with its name.
type Named = (String, egui::Rect);

/// The visible areas over the picture, and the room that they have.
fn areas(app: &mut App) -> Result<(Vec<Named>, egui::Rect), Box<dyn Error>> {
    let mut contexts = app.world_mut().query_filtered::<&mut EguiContext, With<PrimaryEguiContext>>();
    let ctx = contexts.single_mut(app.world_mut())?.get_mut().clone();
    let layers: Vec<_> = ctx.memory(|memory| memory.areas().visible_layer_ids().into_iter().collect());
    let shown = layers.iter().filter(|layer| layer.order != egui::Order::Background);
    let rect = |layer: &egui::LayerId| ctx.memory(|memory| memory.area_rect(layer.id));
    let rects = shown.filter_map(|layer| Some((format!("{:?}", layer.id), rect(layer)?)));
    Ok((rects.collect(), ctx.content_rect()))
}

/// Describes areas that leave the window, and, if `apart` is set, areas that overlap.
fn faults(app: &mut App, what: &str, apart: bool) -> Result<Vec<String>, Box<dyn Error>> {
    let (areas, room) = areas(app)?;
    let mut faults = Vec::new();
    assert!(!areas.is_empty(), "{what}: there is something on the screen");
    for (i, (name, rect)) in areas.iter().enumerate() {
        if !room.expand(0.6).contains_rect(*rect) {
            faults.push(format!("{what}: {name} at {rect:?} leaves {room:?}"));
        }
        for (other, at) in areas[i + 1..].iter().filter(|_| apart) {
            if rect.shrink(0.5).intersects(at.shrink(0.5)) {
                faults.push(format!("{what}: {name} at {rect:?} overlaps {other} at {at:?}"));
            }
        }
    }
    Ok(faults)
}

/// Sizes of windows, physical pixels, their scale, and factors of the size of text.
const WINDOWS: [(u32, u32, f32, f32); 6] = [
    (854, 480, 1.0, 1.0),
    (1280, 720, 1.0, 1.0),
    (1920, 1080, 1.0, 1.0),
    (1920, 1080, 2.0, 1.0),
    (854, 480, 1.0, 1.5),
    (1280, 720, 1.0, 2.0),
];

#[test]
fn no_screen_overflows_and_no_text_overlaps() -> Result<(), Box<dyn Error>> {
    let mut all = Vec::new();
    for (width, height, scale, text_size) in WINDOWS {
        let resolution = WindowResolution::new(width, height).with_scale_factor_override(scale);
        let window = Window { resolution, ..default() };
        let mut app = windowless::game_in(Some(window), &["MarathonManController"], FRAME, |app| {
            let interface = &mut app.world_mut().resource_mut::<Settings>().interface;
            (interface.prompts, interface.text_size) = (true, text_size);
        });
        let name = |what: &str| format!("{width} x {height}, scale {scale}, text {text_size}: {what}");
        for screen in Screen::ALL {
            app.world_mut().resource_mut::<Menu>().show(screen);
            frames(&mut app, 6);
            all.extend(faults(&mut app, &name(&format!("{screen:?}")), true)?);
        }
        app.world_mut().resource_mut::<Menu>().close();
        frames(&mut app, 60);
        assert!(app.world().resource::<Prompts>().current().is_some(), "a prompt is there");
        for mode in [Mode::Watch, Mode::Push, Mode::Imitate, Mode::Course, Mode::Testbed] {
            let mut scenario = app.world().resource::<Scenario>().clone();
            switch_mode(&mut scenario, mode, &app.world().resource::<ShippedPolicies>().clone());
            app.world_mut().resource_mut::<Menu>().start(scenario);
            for detail in [Detail::Play, Detail::Full] {
                // with all numbers, text that is larger than the picture allows may cover it
                if detail == Detail::Full && text_size > 1.0 {
                    continue;
                }
                app.world_mut().resource_mut::<Settings>().interface.detail = detail;
                // messages about the start are gone by then
                frames(&mut app, 300);
                all.extend(faults(&mut app, &name(&format!("{mode:?}, {detail:?}")), true)?);
            }
        }
    }
    assert!(all.is_empty(), "{}", all.join("\n"));
    Ok(())
}

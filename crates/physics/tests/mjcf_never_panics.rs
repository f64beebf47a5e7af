//! The loader never panics: any bytes and any damage to a valid file lead to a model or an error.
//!
//! A loaded model is valid: lengths agree, indices are in range, and every number is finite.

use marathon_physics::Model;
use marathon_physics::model::{EqualityKind, TendonKind, Transmission};
use proptest::prelude::*;
use std::path::Path;

/// The valid files that are damaged here: the models of `models/mjcf`.
fn corpus() -> Vec<String> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/models/mjcf");
    let mut files: Vec<_> = std::fs::read_dir(folder).expect("the models").map(|e| e.expect("a file").path()).collect();
    files.retain(|file| file.extension().is_some_and(|end| end == "xml"));
    files.sort();
    files.iter().map(|f| std::fs::read_to_string(f).expect("a model")).collect()
}

/// Loads the text and checks the result.
fn load(text: &str) -> Result<(), TestCaseError> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/models/mjcf");
    let read = |name: &str| std::fs::read(folder.join(name)).map_err(|e| e.to_string());
    let Ok(model) = Model::from_xml_str_with(text, "damaged.xml", &read) else { return Ok(()) };
    let coordinates = |m: &Model| m.joints.iter().map(|j| j.qpos_adr).max().is_none_or(|last| last < m.nq);
    prop_assert!(model.qpos0.len() == model.nq && model.qpos_spring.len() == model.nq && coordinates(&model));
    prop_assert_eq!(model.dofs.len(), model.nv);
    prop_assert_eq!(model.actuators.len(), model.nu);
    for (i, body) in model.bodies.iter().enumerate() {
        prop_assert!(body.parent <= i && body.weld_id <= i && body.root_id <= i);
        prop_assert!(body.joint_start + body.joint_count <= model.joints.len());
        prop_assert!(body.dof_start + body.dof_count <= model.nv);
        prop_assert!(body.geom_start + body.geom_count <= model.geoms.len());
        let numbers = [body.pos, body.ipos, body.inertia].concat();
        prop_assert!(
            numbers.iter().chain(&body.quat).chain(&body.iquat).chain(&body.invweight0).all(|x| x.is_finite())
        );
        prop_assert!(body.mass.is_finite() && body.subtree_mass.is_finite());
    }
    prop_assert!(model.dofs.iter().all(|d| d.invweight0.is_finite() && d.damping.is_finite()));
    prop_assert!(model.geoms.iter().all(|g| g.pos.iter().chain(&g.quat).all(|x| x.is_finite())));
    let finite = |numbers: &[f64]| numbers.iter().all(|x| x.is_finite());
    for actuator in &model.actuators {
        let target = match actuator.transmission {
            Transmission::Joint(j) | Transmission::JointInParent(j) => j < model.joints.len(),
            Transmission::Tendon(t) => t < model.tendons.len(),
            Transmission::Body(b) => b < model.bodies.len(),
            Transmission::Site { site, reference } => site.max(reference.unwrap_or(0)) < model.sites.len(),
            Transmission::SliderCrank { crank, slider, rod } => {
                crank.max(slider) < model.sites.len() && finite(&[rod]) && rod > 0.0
            }
        };
        prop_assert!(target && finite(&actuator.bias) && finite(&actuator.act_range));
        prop_assert!(actuator.act.is_none_or(|a| a < model.na));
    }
    for tendon in &model.tendons {
        match &tendon.kind {
            TendonKind::Fixed(path) => {
                let known = |(j, coef): &(usize, f64)| *j < model.joints.len() && coef.is_finite();
                prop_assert!(!path.is_empty() && path.iter().all(known));
            }
            spatial => {
                let spans = spatial.spans();
                prop_assert!(!spans.is_empty());
                for span in spans {
                    let around = span.wrap.map_or(0, |(geom, _)| geom);
                    let side = span.wrap.and_then(|(_, side)| side).unwrap_or(0);
                    prop_assert!(span.sites.iter().chain([&side]).all(|s| *s < model.sites.len()));
                    prop_assert!(around < model.geoms.len().max(1) && span.divisor > 0.0);
                }
            }
        }
        prop_assert!(finite(&tendon.spring_length) && finite(&[tendon.length0, tendon.invweight0, tendon.damping]));
    }
    for equality in &model.equalities {
        match &equality.kind {
            EqualityKind::Connect { bodies, anchors, .. } | EqualityKind::Weld { bodies, anchors, .. } => {
                prop_assert!(bodies.iter().all(|b| *b < model.bodies.len()) && finite(&anchors.concat()));
            }
            EqualityKind::Joint { joint1, joint2, .. } => {
                prop_assert!(joint2.iter().chain([joint1]).all(|j| *j < model.joints.len()));
            }
            EqualityKind::Tendon { tendon1, tendon2, .. } => {
                prop_assert!(tendon2.iter().chain([tendon1]).all(|t| *t < model.tendons.len()));
            }
        }
    }
    for hfield in &model.hfields {
        prop_assert_eq!(hfield.data.len(), hfield.nrow * hfield.ncol);
        prop_assert!(hfield.data.iter().all(|x| (0.0..=1.0).contains(x)));
    }
    prop_assert!(model.geoms.iter().all(|g| g.hfield.is_none_or(|h| h < model.hfields.len())));
    let values: usize = model.sensors.iter().map(|s| s.dim).sum();
    prop_assert!(model.sensors.iter().all(|s| s.adr + s.dim <= values));
    let mocap = model.bodies.iter().filter(|b| b.mocap).count();
    prop_assert!(model.keyframes.iter().all(|k| k.act.len() == model.na && k.mpos.len() == mocap));
    prop_assert!(model.pairs.iter().all(|p| p.geoms.iter().all(|&g| g < model.geoms.len())));
    prop_assert!(model.keyframes.iter().all(|k| k.qpos.len() == model.nq && k.qvel.len() == model.nv));
    let stat = &model.stat;
    prop_assert!([stat.extent, stat.mean_mass, stat.mean_inertia].iter().chain(&stat.center).all(|x| x.is_finite()));
    Ok(())
}

/// Pieces of MJCF that are combined at random.
const PIECES: [&str; 58] = [
    "<mujoco>",
    "</mujoco>",
    "<worldbody>",
    "</worldbody>",
    "<body ",
    "</body>",
    "<geom ",
    "<joint ",
    "<freejoint",
    "<inertial ",
    "<default ",
    "</default>",
    "<frame ",
    "<include file='a'/>",
    "/>",
    ">",
    "size='1 2 3'",
    "size='-1'",
    "type='box'",
    "type='free'",
    "type='ball'",
    "pos='1 2 3'",
    "pos=''",
    "mass='1e308'",
    "mass='0'",
    "quat='0 0 0 1'",
    "euler='1e300 0 0'",
    "fromto='0 0 0 1 1 1'",
    "class='a'",
    "range='-1 1'",
    "diaginertia='1 1 1'",
    "name='a'",
    "<actuator>",
    "<motor joint='a'/>",
    "</actuator>",
    "<tendon><fixed name='a'>",
    "<joint joint='a' coef='2'/>",
    "</fixed></tendon>",
    "<tendon><spatial name='a' stiffness='1'>",
    "<site site='a'/>",
    "<site name='a'/>",
    "<geom geom='a' sidesite='a'/>",
    "<pulley divisor='2'/>",
    "</spatial></tendon>",
    "<equality>",
    "<weld body1='a'/>",
    "<connect body1='a' anchor='1 2 3'/>",
    "<joint joint1='a'/>",
    "</equality>",
    "<intvelocity tendon='a' kp='1'/>",
    "<asset><hfield name='a' nrow='2' ncol='2' size='1 1 1 1'/></asset>",
    "<sensor><framepos objtype='body' objname='a'/></sensor>",
    "hfield='a'",
    "<!--",
    "-->",
    "&lt;",
    "<![CDATA[",
    "]]>",
];

/// Numbers at the limits of the number formats.
const NUMBERS: [&str; 14] =
    ["0", "-1", "1e308", "-1e308", "1e-308", "1e-15", "1e155", "nan", "inf", "", "99999999999", "1 2", "0x10", "1e400"];

proptest! {
    #![proptest_config(ProptestConfig { cases: 1000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn any_bytes(bytes in proptest::collection::vec(any::<u8>(), 0..300)) {
        load(&String::from_utf8_lossy(&bytes))?;
    }

    #[test]
    fn pieces_in_any_order(pieces in proptest::collection::vec(proptest::sample::select(&PIECES[..]), 0..30)) {
        let middle = pieces.join(" ");
        load(&middle)?;
        load(&format!("<mujoco><worldbody>{middle}</worldbody></mujoco>"))?;
    }

    #[test]
    fn damaged_bytes(
        which in any::<prop::sample::Index>(),
        edits in proptest::collection::vec((any::<prop::sample::Index>(), any::<u8>(), 0..3), 1..6),
    ) {
        let corpus = corpus();
        let mut bytes = which.get(&corpus).clone().into_bytes();
        for (at, byte, kind) in edits {
            if bytes.is_empty() {
                break;
            }
            let at = at.index(bytes.len());
            match kind {
                0 => bytes[at] = byte,
                1 => drop(bytes.remove(at)),
                _ => bytes.insert(at, byte),
            }
        }
        load(&String::from_utf8_lossy(&bytes))?;
    }

    /// Replaces whole attribute values, which passes the XML parser.
    #[test]
    fn damaged_values(
        which in any::<prop::sample::Index>(),
        edits in proptest::collection::vec((any::<prop::sample::Index>(), proptest::sample::select(&NUMBERS[..]), any::<bool>()), 1..4),
    ) {
        let corpus = corpus();
        let text = which.get(&corpus);
        // odd parts between quotation marks are attribute values
        let mut parts: Vec<String> = text.split('"').map(str::to_owned).collect();
        for (at, number, whole) in edits {
            let values = parts.len() / 2;
            if values == 0 {
                break;
            }
            let value = &mut parts[2 * at.index(values) + 1];
            let words: Vec<&str> = value.split_ascii_whitespace().collect();
            *value = if whole || words.len() < 2 { number.to_owned() } else { [number, &words[1..].join(" ")].join(" ") };
        }
        load(&parts.join("\""))?;
    }

    /// Moves, repeats and removes whole lines, and with them elements.
    #[test]
    fn shuffled_lines(
        which in any::<prop::sample::Index>(),
        edits in proptest::collection::vec((any::<prop::sample::Index>(), any::<prop::sample::Index>(), 0..3), 1..4),
    ) {
        let corpus = corpus();
        let mut lines: Vec<&str> = which.get(&corpus).lines().collect();
        for (from, to, kind) in edits {
            if lines.is_empty() {
                break;
            }
            let (from, to) = (from.index(lines.len()), to.index(lines.len()));
            match kind {
                0 => lines.swap(from, to),
                1 => lines.insert(to, lines[from]),
                _ => drop(lines.remove(from)),
            }
        }
        load(&lines.join("\n"))?;
    }
}

/// Very deep, very wide and very long files end quickly and without exhausting the stack.
#[test]
fn extreme_sizes() {
    let nested = |open: &str, close: &str, n: usize| {
        let (head, tail) = ("<mujoco><worldbody>", "</worldbody></mujoco>");
        format!("{head}{}{}{tail}", open.repeat(n), close.repeat(n))
    };
    assert!(Model::from_xml_str(&nested("<body>", "</body>", 100_000), "deep").is_err());
    assert!(Model::from_xml_str(&"<a>".repeat(100_000), "open").is_err());
    assert!(
        Model::from_xml_str(&nested("<body pos='0 0 1'><joint/><geom size='1'/>", "</body>", 150), "chain").is_ok()
    );
    let wide = "<body><joint/><geom size='1'/></body>".repeat(3000);
    assert!(Model::from_xml_str(&format!("<mujoco><worldbody>{wide}</worldbody></mujoco>"), "wide").is_ok());
    let long = format!("<mujoco><custom><numeric name='{}' data='1'/></custom></mujoco>", "n".repeat(1_000_000));
    assert!(Model::from_xml_str(&long, "long").is_ok());
    let key = "<mujoco><size nkey='2000000000'/></mujoco>";
    assert!(Model::from_xml_str(key, "keys").is_err());
    let big = "<mujoco><custom><numeric name='a' data='1' size='2000000000'/></custom></mujoco>";
    assert!(Model::from_xml_str(big, "numbers").is_err());
}

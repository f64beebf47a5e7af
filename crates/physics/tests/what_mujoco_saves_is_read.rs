//! The loader reads MuJoCo's output: a model that loads still loads after MuJoCo has saved it.
//!
//! MuJoCo's writer expands includes, classes and shortcuts in its own way. MuJoCo saves every public model that the
//! tests install (see `docs/research/models.md`) with `MjSpec.to_xml`, the writer of `mj_saveLastXML`. If the loader accepts the
//! original, it accepts the saved file, and compiles it to MuJoCo's model. The loader also knows every element and
//! attribute of MuJoCo's schema, which the writer can emit. It may refuse one by name, but does not report it as a
//! spelling mistake.

use crate::common::compiled::differ;
use crate::common::oracle;
use marathon_physics::Model;
use marathon_physics::mjcf::MjcfErrorKind;
use serde_json::{Value, json};
use std::path::Path;

#[test]
fn public_models_load_after_mujoco_has_saved_them() {
    let files = oracle("foreign_models.py", &Value::Null);
    let field = |file: &Value, name: &str| file[name].as_str().expect("a text").to_owned();
    let files: Vec<(String, String)> = files
        .as_array()
        .expect("a list")
        .iter()
        .filter(|file| file["same_as"].is_null() && file["error"].is_null())
        .map(|file| (field(file, "id"), field(file, "path")))
        .collect();
    let paths: Vec<&String> = files.iter().map(|(_, path)| path).collect();
    let answers = oracle("saved_models.py", &json!(paths));
    let (mut loaded, mut servos, mut failures) = (0, 0, Vec::new());
    for ((id, path), answer) in files.iter().zip(answers.as_array().expect("an answer per file")) {
        if Model::from_xml_file(path).is_err() || answer.is_null() {
            continue;
        }
        loaded += 1;
        let saved = answer["saved"].as_str().expect("a text");
        servos += usize::from(saved.contains("input=\""));
        let folder = Path::new(path).parent().expect("a folder");
        let read = |name: &str| std::fs::read(folder.join(name)).map_err(|e| e.to_string());
        match Model::from_xml_str_with(saved, id, &read) {
            Err(error) => failures.push(format!("refused after it was saved: {error}")),
            Ok(_) if answer["model"].is_null() => failures.push(format!("{id}: uses what was not compared")),
            Ok(model) => {
                let mut differences = Vec::new();
                differ("", &serde_json::to_value(&model).expect("a model is JSON"), &answer["model"], &mut differences);
                failures.extend(differences.iter().take(3).map(|d| format!("{id}, saved: {d}")));
            }
        }
    }
    println!("{loaded} models, {servos} with named inputs");
    assert!(loaded > 120 && servos > 10, "{loaded} models, {servos} with named inputs");
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

/// An element of the schema: its path from the top, and its attributes.
struct Element {
    path: Vec<String>,
    attributes: Vec<String>,
}

/// Reads the output of `mj_printSchema`: names indented by their depth, a mark for the allowed number, attributes.
fn schema() -> Vec<Element> {
    let text = oracle("schema.py", &Value::Null);
    let (mut elements, mut stack): (Vec<Element>, Vec<String>) = (Vec::new(), Vec::new());
    for line in text.as_str().expect("a text").lines().filter(|line| !line.trim().is_empty()) {
        let indent = line.len() - line.trim_start().len();
        let mut words = line.split_whitespace().map(str::to_owned);
        // a body or the world is "(world)body (R)"
        if line.trim_end().contains(" (") {
            stack.truncate(indent / 3);
            stack.push(words.next().expect("a name"));
            words.next();
            elements.push(Element { path: stack.clone(), attributes: words.collect() });
        } else {
            elements.last_mut().expect("an element").attributes.extend(words);
        }
    }
    elements
}

#[test]
fn every_attribute_of_mujocos_schema_is_known() {
    let elements = schema();
    let (mut count, mut failures) = (0, Vec::new());
    for element in &elements {
        let mut path = element.path.clone();
        if path.get(1).is_some_and(|name| name == "(world)body") {
            path.splice(1..2, ["worldbody".to_owned(), "body".to_owned()]);
        }
        let (name, outer) = path.split_last().expect("a name");
        let open: String = outer.iter().map(|name| format!("<{name}>")).collect();
        let close: String = outer.iter().rev().map(|name| format!("</{name}>")).collect();
        for attribute in element.attributes.iter().map(Some).chain([None]) {
            let own = attribute.map(|a| format!(" {a}=\"\"")).unwrap_or_default();
            let text = format!("{open}<{name}{own}/>{close}");
            let Err(error) = Model::from_xml_str(&text, "schema.xml") else { continue };
            count += 1;
            if matches!(error.kind, MjcfErrorKind::UnknownAttribute { .. } | MjcfErrorKind::UnknownElement { .. }) {
                failures.push(format!("{text}: {error}"));
            }
        }
    }
    assert!(elements.len() > 150 && count > 500, "{} elements, {count} attributes", elements.len());
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

//! `marathon play --help` prints the game's help without the game. With MARATHON_BLESS=1, this test writes the file.

use std::path::Path;
use std::process::Command;

#[test]
fn the_copy_is_up_to_date() {
    let output = Command::new(env!("CARGO_BIN_EXE_marathon-game"))
        .arg("--help")
        .env_remove("COLUMNS")
        .output()
        .expect("the game starts");
    let help = String::from_utf8(output.stdout).expect("help is text");
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../cli/src/commands/play_help.txt");
    if std::env::var_os("MARATHON_BLESS").is_some() {
        std::fs::write(&path, &help).expect("the file can be written");
    }
    let copy = std::fs::read_to_string(&path).expect("the file is there");
    assert!(copy == help, "{} is out of date: run this test with MARATHON_BLESS=1", path.display());
}

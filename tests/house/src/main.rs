//! `cargo run -p house` writes `docs/images/house.svg`, the picture of `docs/project/architecture.md`. `cargo run -p house -- order`
//! prints for each crate an order in which its rooms can stand, and the imports that stand in the way of one.
//! `cargo run -p house -- circles` prints the groups of files that import each other, and their imports.

use house::{House, Order, picture};
use std::path::Path;

fn main() -> Result<(), house::Error> {
    let house = House::read(Path::new("."))?;
    match std::env::args().nth(1).as_deref() {
        Some("order") => {
            print_orders(&house);
            return Ok(());
        }
        Some("circles") => {
            print_circles(&house);
            return Ok(());
        }
        _ => {}
    }
    let order = Order::read(&house.root.join("docs/project/architecture.md"))?;
    let path = house.root.join("docs/images/house.svg");
    std::fs::write(&path, picture::svg(&house, &order)).map_err(|source| house::Error::Io { path, source })
}

fn print_orders(house: &House) {
    for found in &house.crates {
        println!("{}: {}", found.name, found.order().join(", "));
        let Some(ring) = found.ring() else { continue };
        println!("  ring: {}", ring.join(", "));
        for import in found.between_rooms().filter(|i| ring.contains(&i.from) && ring.contains(&i.to)) {
            println!("  src/{}:{}: {} imports {}", import.file.display(), import.line, import.from, import.to);
        }
    }
}

fn print_circles(house: &House) {
    for found in &house.crates {
        for circle in found.circles() {
            let files: Vec<_> = circle.iter().map(|file| file.display().to_string()).collect();
            println!("crates/{}/src: {}", found.name, files.join(", "));
            for import in found.imports_within(&circle) {
                println!("  {}:{} imports {}", import.file.display(), import.line, import.target.display());
            }
        }
    }
}

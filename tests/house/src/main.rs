//! `cargo run -p house` writes `docs/images/house.svg`, the picture of `docs/architecture.md`. `cargo run -p house -- order`
//! prints for each crate an order in which its rooms can stand, and the imports that stand in the way of one.

use house::{House, Order, picture};
use std::path::Path;

fn main() -> Result<(), house::Error> {
    let house = House::read(Path::new("."))?;
    if std::env::args().nth(1).is_some_and(|argument| argument == "order") {
        print_orders(&house);
        return Ok(());
    }
    let order = Order::read(&house.root.join("docs/architecture.md"))?;
    let path = house.root.join("docs/images/house.svg");
    std::fs::write(&path, picture::svg(&house, &order)).map_err(|source| house::Error::Io { path, source })
}

fn print_orders(house: &House) {
    for found in &house.crates {
        println!("{}: {}", found.name, found.order().join(", "));
        let Some(ring) = found.ring() else { continue };
        println!("  ring: {}", ring.join(", "));
        for import in found.imports.iter().filter(|i| ring.contains(&i.from) && ring.contains(&i.to)) {
            println!("  src/{}:{}: {} imports {}", import.file.display(), import.line, import.from, import.to);
        }
    }
}

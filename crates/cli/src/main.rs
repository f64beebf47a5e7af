//! The `marathon` command; all of it is in the library.

fn main() -> std::process::ExitCode {
    marathon_cli::main(std::env::args_os()).into()
}

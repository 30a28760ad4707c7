//! Lists what may be a rig, without opening it: `devices`. Asks who is at an address: `devices ADDRESS`.

use device_io::discovery::{list, probe};
use std::process::ExitCode;

fn main() -> ExitCode {
    let Some(address) = std::env::args().nth(1) else {
        for found in list() {
            println!("{}  {}", found.address, found.description);
            if let Some(obstacle) = found.obstacle {
                println!("    {}; {}", obstacle.why, obstacle.remedy);
            }
        }
        return ExitCode::SUCCESS;
    };
    let asked = address.parse().map_err(|error| format!("{error}"));
    match asked.and_then(|address| probe(&address).map_err(|error| error.to_string())) {
        Ok(greeting) => {
            println!("{greeting:?}");
            ExitCode::SUCCESS
        }
        Err(why) => {
            eprintln!("{why}");
            ExitCode::FAILURE
        }
    }
}

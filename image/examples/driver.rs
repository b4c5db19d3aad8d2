//! Opens and closes the door of a control, its input DOOR, twice a second, and prints its output PUMP when it changes.
//! cargo run -p plcc-image --example driver -- IMAGE ROUNDS

use std::error::Error;
use std::path::Path;
use std::thread::sleep;
use std::time::Duration;

use plcc_image::{ImageReader, InputWriter, Number, State};

fn main() -> Result<(), Box<dyn Error>> {
    let mut words = std::env::args().skip(1);
    let path = words.next().ok_or("driver IMAGE ROUNDS")?;
    let rounds: i64 = words.next().ok_or("driver IMAGE ROUNDS")?.parse()?;
    let image = ImageReader::open(Path::new(&path))?;
    let symbols = image.symbols();
    let pump = symbols.iter().find(|symbol| symbol.name == "PUMP").ok_or("there is no PUMP")?;
    let mut inputs = InputWriter::open(Path::new(&path), "driver in Rust")?;
    let door = inputs.claim("DOOR")?;
    let mut before = None;
    for round in 0..rounds {
        // In every round, so that it is never late.
        inputs.set(door, Number::Int(round / 50 % 2))?;
        inputs.publish()?;
        sleep(Duration::from_millis(10));
        let tick = image.read().ok_or("the control has died while it wrote a tick")?;
        let now = tick.output(pump);
        if let Some(now) = now.filter(|_| now != before) {
            println!("PUMP {now}");
        }
        before = now;
        if !matches!(tick.state, Some(State::Prepared | State::Running | State::Stopped)) {
            return Err("the control has ended, or another file has this name now".into());
        }
    }
    // The input takes its safe value when the writer is dropped.
    Ok(())
}

//! `[[simulator.motor]]`: what the simulated motors of a PMAC are fastened to.
//!
//! ```toml
//! [simulator]
//! [[simulator.motor]]
//! number = 1
//! stroke = [-50000, 250000]
//! limits = [-40000, 240000]
//! home = [[10000, 12000]]
//! ```

use alloc::{
    format,
    string::{String, ToString},
    vec::Vec,
};

use serde::Deserialize;
use toml::Spanned;

use crate::pmac::motion::Plant;

/// The highest number of a motor of any controller.
const MAX_MOTOR: i64 = 32;

#[derive(Deserialize)]
struct File {
    simulator: Option<Simulator>,
}

/// Only the motors; other keys are read elsewhere.
#[derive(Deserialize)]
struct Simulator {
    #[serde(default)]
    motor: Vec<Spanned<Motor>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Motor {
    number: i64,
    stroke: Option<[f64; 2]>,
    limits: Option<[f64; 2]>,
    home: Option<Vec<[f64; 2]>>,
    index: Option<i64>,
    index_at: Option<i64>,
    lag: Option<i64>,
    open_loop: Option<f64>,
}

/// The motors of a machine file's text, by rising number.
///
/// # Errors
/// An unknown key, a motor twice, or a value that is out of range; the message names the line.
pub(super) fn read(text: &str) -> Result<Vec<Plant>, String> {
    let file: File = toml::from_str(text).map_err(|error| error.to_string())?;
    let mut plants: Vec<Plant> = Vec::new();
    for entry in file.simulator.map(|simulator| simulator.motor).unwrap_or_default() {
        let line =
            text.get(..entry.span().start).map_or(1, |before| before.matches('\n').count() + 1);
        let motor = entry.into_inner();
        let number = motor.number;
        let plant = plant(motor).map_err(|why| format!("line {line}: motor {number}: {why}"))?;
        if plants.iter().any(|other| other.number == plant.number) {
            return Err(format!("line {line}: motor {number} is there twice"));
        }
        plants.push(plant);
    }
    plants.sort_by_key(|plant| plant.number);
    Ok(plants)
}

fn plant(motor: Motor) -> Result<Plant, String> {
    let Motor { number, stroke, limits, home, index, index_at, lag, open_loop } = motor;
    if !(1..=MAX_MOTOR).contains(&number) {
        return Err(format!("motors have the numbers 1 to {MAX_MOTOR}"));
    }
    let interval = |name: &str, [from, to]: [f64; 2]| {
        if !from.is_finite() || !to.is_finite() {
            return Err(format!("`{name}` needs finite numbers"));
        }
        if from > to {
            return Err(format!("`{name}` goes from {from} to {to}, which is below"));
        }
        Ok((from, to))
    };
    let mut plant = Plant::new(number as u8);
    plant.stroke = stroke.map(|given| interval("stroke", given)).transpose()?;
    plant.limits = limits.map(|given| interval("limits", given)).transpose()?;
    if let Some(home) = home {
        let intervals: Result<Vec<_>, _> =
            home.into_iter().map(|given| interval("home", given)).collect();
        plant.home = Plant::joined(intervals?);
    }
    if let Some(index) = index {
        if !(0..=16_777_216).contains(&index) {
            return Err("`index` is 0 to 16777216 counts".to_string());
        }
        plant.index = index as u32;
    }
    plant.index_at = index_at.unwrap_or(0);
    if let Some(lag) = lag {
        if !(0..=1000).contains(&lag) {
            return Err("`lag` is 0 to 1000 servo cycles".to_string());
        }
        plant.lag = lag as u16;
    }
    if let Some(open_loop) = open_loop {
        if !open_loop.is_finite() {
            return Err("`open_loop` needs a finite number".to_string());
        }
        plant.open_loop = open_loop;
    }
    Ok(plant)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn motors_are_read_with_their_defaults() {
        let plants = read(
            "[simulator]\n[[simulator.motor]]\nnumber = 2\nhome = [[5, 9], [0, 5.5]]\nlag = 3\n\
             [[simulator.motor]]\nnumber = 1\nstroke = [-1, 2]\n",
        );
        let plants = plants.unwrap();
        let [one, two] = plants.as_slice() else { panic!("two motors") };
        assert_eq!((one.stroke, one.index, one.open_loop), (Some((-1.0, 2.0)), 4000, 32.0));
        assert_eq!((two.home.as_slice(), two.lag), ([(0.0, 9.0)].as_slice(), 3));
        assert_eq!(read("[simulator]\n"), Ok(Vec::new()));
        assert_eq!(read(""), Ok(Vec::new()));
    }

    #[test]
    fn a_wrong_motor_is_refused_with_its_line() {
        for (entry, part) in [
            ("number = 0", "1 to 32"),
            ("number = 33", "1 to 32"),
            ("number = 1\nstroke = [2, 1]", "below"),
            ("number = 1\nlimits = [nan, 1]", "finite"),
            ("number = 1\nhome = [[1, inf]]", "finite"),
            ("number = 1\nindex = 16777217", "index"),
            ("number = 1\nlag = 1001", "lag"),
            ("number = 1\nopen_loop = inf", "open_loop"),
            ("number = 1\n[[simulator.motor]]\nnumber = 1", "twice"),
        ] {
            let error = read(&format!("[simulator]\n[[simulator.motor]]\n{entry}\n")).unwrap_err();
            assert!(error.contains(part) && error.contains("line "), "{error}");
        }
        let error = read("[[simulator.motor]]\nnumber = 1\nspeed = 3\n").unwrap_err();
        assert!(error.contains("speed"), "{error}");
    }
}

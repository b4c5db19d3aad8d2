//! The functions that programs may call: arithmetic of fixed width, which the standard leaves open where a result does not fit,
//! bits of numbers, and rounding.

mod float;
mod integer;

use crate::project::Function;

/// All of them, each after those that it calls.
pub fn all() -> impl Iterator<Item = &'static Function> {
    integer::FUNCTIONS.iter().chain(float::FUNCTIONS)
}

#[cfg(test)]
mod tests {
    use super::all;

    #[test]
    fn each_function_stands_behind_those_that_it_calls() {
        let all: Vec<_> = all().collect();
        for (at, function) in all.iter().enumerate() {
            let before = &all[..at];
            for name in function.needs {
                assert!(before.iter().any(|other| other.name == *name), "{}", function.name);
            }
            for other in &all {
                let calls =
                    function.body.iter().any(|line| line.contains(&format!("{}(", other.name)));
                assert_eq!(
                    calls,
                    function.needs.contains(&other.name),
                    "{} {}",
                    function.name,
                    other.name
                );
            }
        }
    }
}

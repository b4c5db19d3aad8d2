//! The names that variables have as pins of LinuxCNC's hardware abstraction layer (HAL).

/// A variable's name as a name of HAL: small letters, digits and `-`. `@FRO` becomes `at-fro`, `A[3]`
/// `a-3`, `&2Q5` `cs2-q5`.
pub fn hal_pin_name(variable: &str) -> String {
    let name = variable.replace('@', "at-");
    let name = match name.strip_prefix('&') {
        Some(rest) => format!("cs{}", rest.replacen('Q', "-Q", 1)),
        None => name,
    };
    let plain: String =
        name.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '-' }).collect();
    let words: Vec<&str> = plain.split('-').filter(|word| !word.is_empty()).collect();
    words.join("-").to_ascii_lowercase()
}

#[cfg(test)]
mod tests {
    use super::hal_pin_name;

    #[test]
    fn names_of_variables_become_names_of_pins() {
        for (variable, pin) in [
            ("LS27", "ls27"),
            ("@FRO", "at-fro"),
            ("SPINDLE_ON", "spindle-on"),
            ("A[3]", "a-3"),
            ("@NVINT[1]", "at-nvint-1"),
            ("Y012", "y012"),
            ("X:$0700", "x-0700"),
            ("&2Q5", "cs2-q5"),
        ] {
            assert_eq!(hal_pin_name(variable), pin);
        }
    }
}

//! Numbers that name a program and a label in it: those of CALL and B, and those of G, M, T and D codes (guide, Writing a Motion
//! Program).

/// How many labels stand after the point.
const LABELS: f64 = 100_000.0;

/// A program and a label in it, as a number gives them: any numbers, of which not each names something. The label 0 is the top.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Destination {
    /// The program.
    pub program: f64,
    /// The label.
    pub label: f64,
}

impl Destination {
    /// That of CALL and B: the program in front of the point, the label after it.
    pub fn of_number(number: f64) -> Self {
        let program = libm::floor(number);
        Self { program, label: libm::round((number - program) * LABELS) }
    }

    /// That of a code G (0), M (1), T (2) or D (3): hundreds choose the program, from 1000 on, and the rest the label.
    pub fn of_code(code: u8, number: f64) -> Self {
        let hundreds = libm::floor(number / 100.0);
        let label = libm::round((number - hundreds * 100.0) * 1000.0);
        Self { program: 1000.0 + 10.0 * hundreds + f64::from(code), label }
    }

    /// The number that names a program and a label.
    pub fn number(program: u32, label: u32) -> f64 {
        f64::from(program) + f64::from(label) / LABELS
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_name_programs_and_labels() {
        let of = |found: Destination| (found.program, found.label);
        assert_eq!(of(Destination::of_number(10.25)), (10.0, 25_000.0));
        assert_eq!(of(Destination::of_number(7.0)), (7.0, 0.0));
        assert_eq!(of(Destination::of_code(0, 54.1)), (1000.0, 54_100.0));
        assert_eq!(of(Destination::of_code(1, 230.0)), (1021.0, 30_000.0));
        assert_eq!(of(Destination::of_number(Destination::number(3, 99_999))), (3.0, 99_999.0));
    }
}

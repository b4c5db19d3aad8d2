//! Compares the values of random expressions with a second implementation of the manual's rules. It
//! computes each value while it generates the text, without the front end's types, operations or
//! precedences.
#![allow(clippy::panic, clippy::unwrap_used, clippy::indexing_slicing)]

mod support;

use plcc_abi::Outcome;
use plcc_random::Rng;
use support::Control;

#[derive(Clone, Copy, Debug, PartialEq)]
enum Ty {
    Logical,
    Integer,
    Long,
}

/// A value and its type.
#[derive(Clone, Copy, Debug)]
struct Value {
    ty: Ty,
    value: i64,
    /// All 32 bits of a product. It is `None` once any operation has followed; parentheses are
    /// none.
    product: Option<i64>,
}

impl Value {
    fn of(ty: Ty, value: i64) -> Self {
        let value = match ty {
            Ty::Logical => i64::from(value != 0),
            Ty::Integer => i64::from(value as i16),
            Ty::Long => i64::from(value as i32),
        };
        Self { ty, value, product: None }
    }

    fn truth(self) -> bool {
        self.value != 0
    }
}

/// The result of an operation (PMI 2.3.3.7 and 2.3.7); `None` if an operand is LONG and must not
/// be.
fn binary(operator: &str, a: Value, b: Value) -> Option<Value> {
    let long = a.ty == Ty::Long || b.ty == Ty::Long;
    let sum = if long { Ty::Long } else { Ty::Integer };
    let logical = |truth: bool| Some(Value::of(Ty::Logical, truth.into()));
    match operator {
        "+" => Some(Value::of(sum, a.value + b.value)),
        "-" => Some(Value::of(sum, a.value - b.value)),
        "*" if long => None,
        "*" => {
            let all = a.value * b.value;
            Some(Value { product: Some(all), ..Value::of(Ty::Integer, all) })
        }
        "/" | "%" if b.ty == Ty::Long => None,
        "/" | "%" => {
            let dividend = a.product.unwrap_or(a.value);
            let result = match (operator, b.value) {
                (_, 0) => dividend,
                ("/", divisor) => dividend / divisor,
                (_, divisor) => dividend % divisor,
            };
            Some(Value::of(Ty::Integer, result))
        }
        "=" => logical(a.value == b.value),
        "/=" => logical(a.value != b.value),
        "<" => logical(a.value < b.value),
        "<=" => logical(a.value <= b.value),
        ">" => logical(a.value > b.value),
        ">=" => logical(a.value >= b.value),
        "&" => logical(a.truth() && b.truth()),
        _ => logical(a.truth() || b.truth()),
    }
}

/// Generates expressions.
struct Generator {
    rng: Rng,
}

/// Variables and constants with their values; the program assigns the variables first.
const NAMES: &[(&str, Ty, i64)] = &[
    ("A", Ty::Integer, 300),
    ("B", Ty::Integer, -7),
    ("C", Ty::Integer, 32_767),
    ("D", Ty::Integer, -32_767),
    ("Z", Ty::Integer, 0),
    ("L", Ty::Long, 100_000),
    ("M", Ty::Long, -999_999_999),
    ("N", Ty::Long, 5),
    ("X", Ty::Logical, 1),
    ("Y", Ty::Logical, 0),
    ("KI", Ty::Integer, 181),
    ("KL", Ty::Long, -70_000),
    ("KX", Ty::Logical, 1),
];

/// The binary operators by precedence, the loosest first.
const LEVELS: [&[&str]; 5] =
    [&["!"], &["&"], &["=", "/=", "<", "<=", ">", ">="], &["+", "-"], &["*", "/", "%"]];

impl Generator {
    fn below(&mut self, n: usize) -> usize {
        self.rng.below(n)
    }

    fn chain(&mut self, level: usize, depth: usize) -> (String, Value) {
        let Some(operators) = LEVELS.get(level) else { return self.unary(depth) };
        let (mut text, mut value) = self.chain(level + 1, depth);
        while self.below(4) == 0 {
            let operator = operators[self.below(operators.len())];
            let (right, b) = self.chain(level + 1, depth);
            if let Some(result) = binary(operator, value, b) {
                text = format!("{text}{operator}{right}");
                value = result;
            }
        }
        (text, value)
    }

    fn unary(&mut self, depth: usize) -> (String, Value) {
        let kind = self.below(8);
        let (text, a) = self.primary(depth);
        match kind {
            0 => {
                let ty = if a.ty == Ty::Long { Ty::Long } else { Ty::Integer };
                (format!("-{text}"), Value::of(ty, -a.value))
            }
            1 => (format!("/{text}"), Value::of(Ty::Logical, (!a.truth()).into())),
            _ => (text, a),
        }
    }

    fn primary(&mut self, depth: usize) -> (String, Value) {
        match self.below(10) {
            0..=2 if depth < 5 => {
                let (text, value) = self.chain(0, depth + 1);
                (format!("({text})"), value)
            }
            3 => {
                let number = [0, 1, 2, 7, 256, 32_767, 32_768, 70_000][self.below(8)];
                let ty = if number > 32_767 { Ty::Long } else { Ty::Integer };
                (number.to_string(), Value::of(ty, number))
            }
            4 => match self.below(2) {
                0 => ("T".to_owned(), Value::of(Ty::Logical, 1)),
                _ => ("F".to_owned(), Value::of(Ty::Logical, 0)),
            },
            _ => {
                let (name, ty, value) = NAMES[self.below(NAMES.len())];
                (name.to_owned(), Value::of(ty, value))
            }
        }
    }
}

#[test]
fn expressions_give_what_the_rules_say() {
    let mut generator = Generator { rng: Rng::new(1) };
    for _ in 0..60 {
        let cases: Vec<(String, Value)> = (0..50).map(|_| generator.chain(0, 0)).collect();
        let mut text = "$INTEGER\nA,B,C,D,Z,RI[50],KI=181\n$LONG\nL,M,N,RL[50],KL=-70000\n\
                        $LOGICAL\nX,Y,RX[50],KX=T\n$END\n"
            .to_owned();
        for (name, _, value) in NAMES.iter().filter(|(name, ..)| !name.starts_with('K')) {
            text.push_str(&format!("{name}={value}\n"));
        }
        for (i, (expression, _)) in cases.iter().enumerate() {
            for letter in ["I", "L", "X"] {
                text.push_str(&format!("R{letter}[{i}]={expression}\n"));
            }
        }
        let mut control = Control::new(&text);
        assert_eq!(control.scan(), Outcome::End);
        for (i, (expression, value)) in cases.iter().enumerate() {
            for (letter, ty) in [("I", Ty::Integer), ("L", Ty::Long), ("X", Ty::Logical)] {
                let found = control.get(&format!("R{letter}[{i}]"));
                let expected = Value::of(ty, value.value).value;
                assert_eq!(i64::from(found), expected, "R{letter} = {expression} ({value:?})");
            }
        }
    }
}

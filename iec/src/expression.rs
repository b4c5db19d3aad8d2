//! Expressions: operators in the order of their strength (IEC 61131-3, table 71), and no parentheses but those that are needed.

/// How strongly the last operator of an expression binds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Level {
    /// `OR`.
    Or,
    /// `XOR`.
    Xor,
    /// `AND`.
    And,
    /// `=`, `<` and the like, of which none stands beside another without parentheses.
    Relation,
    /// `+` and `-`.
    Sum,
    /// `*`, `/` and `MOD`.
    Product,
    /// A sign, or `NOT`.
    Sign,
    /// A name, a number, a call.
    Name,
}

/// What inverts an expression.
const NOT: &str = "NOT ";

/// What compilers that make C++ of a truth value take it for. AND, OR and XOR are operators of bits there, which make a number of two values
/// that do not have a variable's type; and a number can't be inverted by `NOT`. Where unsigned numbers are compared, others let `NOT`
/// invert all bits of what came out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Truth {
    /// A value of a variable's type, or what an operator makes of one.
    Variable,
    /// A literal, a comparison, something inverted.
    Bool,
    /// What an operator makes of two of these, or a comparison of unsigned numbers.
    Number,
}

impl Truth {
    /// What AND, OR or XOR makes of two.
    fn joined(self, other: Self) -> Self {
        match (self, other) {
            (Self::Number, _) | (_, Self::Number) | (Self::Bool, Self::Bool) => Self::Number,
            _ => Self::Variable,
        }
    }
}

/// An expression's text. What is put in front of it is kept apart, so that chains of any length take a time that grows with
/// their length alone.
#[derive(Clone, Debug)]
pub struct Expression {
    /// What stands in front, the last one first.
    front: Vec<&'static str>,
    text: String,
    level: Level,
    truth: Truth,
}

impl Expression {
    /// A variable, a literal without a sign, a call.
    pub fn name(text: impl Into<String>) -> Self {
        let text = text.into();
        let truth = match text.as_str() {
            "TRUE" | "FALSE" => Truth::Bool,
            _ => Truth::Variable,
        };
        Self { front: vec![], text, level: Level::Name, truth }
    }

    /// `NOT` of it, or a comparison with FALSE where not all compilers take that.
    #[must_use]
    pub fn inverted(mut self) -> Self {
        if self.level == Level::Sign && self.front.last() == Some(&NOT) {
            self.front.pop();
            self.level = Level::Name;
            return self;
        }
        if self.truth == Truth::Number {
            return self.infix("=", Level::Relation, Self::name("FALSE"));
        }
        self.truth = Truth::Bool;
        self.in_front(NOT, Level::Sign)
    }

    /// With a sign in front.
    #[must_use]
    pub fn negative(self) -> Self {
        self.in_front("-", Level::Sign)
    }

    fn in_front(self, word: &'static str, level: Level) -> Self {
        // The standard has no two signs in a row.
        let mut this = if self.level <= level { self.in_parentheses() } else { self };
        this.front.push(word);
        this.level = level;
        this
    }

    fn in_parentheses(mut self) -> Self {
        self.front.push("(");
        self.text.push(')');
        self.level = Level::Name;
        self
    }

    /// A call of a function with one operand. `function` ends with the opening parenthesis.
    #[must_use]
    pub fn call(mut self, function: &'static str) -> Self {
        self.front.push(function);
        self.text.push(')');
        self.level = Level::Name;
        self.truth = Truth::Variable;
        self
    }

    /// A call of a function with two operands.
    #[must_use]
    pub fn call_with(mut self, function: &'static str, second: Self) -> Self {
        self.text.push_str(", ");
        second.append_to(&mut self.text);
        self.call(function)
    }

    /// An operator between two expressions.
    #[must_use]
    pub fn infix(self, operator: &str, level: Level, right: Self) -> Self {
        let apart = self.level < level || self.level == level && level == Level::Relation;
        let mut this = if apart { self.in_parentheses() } else { self };
        this.text.push(' ');
        this.text.push_str(operator);
        this.text.push(' ');
        this.truth = match level {
            Level::Or | Level::Xor | Level::And => this.truth.joined(right.truth),
            Level::Relation if this.truth == Truth::Number || right.truth == Truth::Number => {
                Truth::Number
            }
            Level::Relation => Truth::Bool,
            _ => Truth::Variable,
        };
        let right = if right.level <= level { right.in_parentheses() } else { right };
        right.append_to(&mut this.text);
        this.level = level;
        this
    }

    /// The same, a comparison of unsigned numbers.
    #[must_use]
    pub fn of_unsigned(mut self) -> Self {
        self.truth = Truth::Number;
        self
    }

    /// How strongly its last operator binds.
    pub fn level(&self) -> Level {
        self.level
    }

    fn append_to(&self, text: &mut String) {
        self.front.iter().rev().for_each(|word| text.push_str(word));
        text.push_str(&self.text);
    }

    /// The text.
    pub fn into_text(self) -> String {
        if self.front.is_empty() {
            return self.text;
        }
        let mut text = String::with_capacity(self.text.len() + 16);
        self.append_to(&mut text);
        text
    }
}

/// A whole number. No literal is the least number of its type, which compilers read as a sign in front of a number that the type
/// has not.
pub fn literal(value: i64) -> Expression {
    match value {
        0.. => Expression::name(value.to_string()),
        -32_768 | -2_147_483_648 | i64::MIN => {
            let below = Expression::name((value + 1).unsigned_abs().to_string()).negative();
            below.infix("-", Level::Sum, Expression::name("1"))
        }
        _ => Expression::name(value.unsigned_abs().to_string()).negative(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parentheses_stand_where_they_are_needed() {
        let name = |name: &str| Expression::name(name);
        let or = |a: Expression, b: Expression| a.infix("OR", Level::Or, b);
        let and = |a: Expression, b: Expression| a.infix("AND", Level::And, b);
        let equal = |a: Expression, b: Expression| a.infix("=", Level::Relation, b);
        for (expression, text) in [
            (or(and(name("A"), name("B")), name("C")), "A AND B OR C"),
            (and(name("A"), or(name("B"), name("C"))), "A AND (B OR C)"),
            (and(and(name("A"), name("B")), name("C")), "A AND B AND C"),
            (and(name("A"), and(name("B"), name("C"))), "A AND (B AND C)"),
            (equal(equal(name("A"), name("B")), name("C")), "(A = B) = C"),
            (equal(name("A"), name("B")).inverted(), "NOT (A = B)"),
            (name("A").inverted().inverted(), "A"),
            (and(name("A"), name("B")).inverted().inverted(), "(A AND B)"),
            (and(equal(name("A"), name("1")), name("B")).inverted(), "NOT (A = 1 AND B)"),
            (and(equal(name("A"), name("1")), name("TRUE")).inverted(), "(A = 1 AND TRUE) = FALSE"),
            (or(name("A").inverted(), name("B").inverted()).inverted(), "(NOT A OR NOT B) = FALSE"),
            (
                and(name("C"), or(name("A").inverted(), name("B").inverted())).inverted(),
                "(C AND (NOT A OR NOT B)) = FALSE",
            ),
            (or(name("A"), name("B")).inverted(), "NOT (A OR B)"),
            (equal(name("A"), name("1")).of_unsigned().inverted(), "(A = 1) = FALSE"),
            (
                and(name("B"), equal(name("A"), name("1")).of_unsigned()).inverted(),
                "(B AND A = 1) = FALSE",
            ),
            (and(name("A").inverted(), name("B")), "NOT A AND B"),
            (literal(-5).negative(), "-(-5)"),
            (literal(-32_768).call("F("), "F(-32767 - 1)"),
            (or(name("A"), name("B")).call_with("F(", literal(-1)), "F(A OR B, -1)"),
        ] {
            assert_eq!(expression.into_text(), text);
        }
    }

    #[test]
    fn long_chains_of_calls_are_made_at_once() {
        let mut chain = Expression::name("A");
        for _ in 0..200_000 {
            chain = chain.call_with("F(", Expression::name("B"));
        }
        let text = chain.into_text();
        assert!(text.starts_with("F(F(") && text.ends_with(", B), B)"));
    }
}

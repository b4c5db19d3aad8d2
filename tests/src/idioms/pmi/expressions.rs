//! Expressions by their type. At most five parentheses and brackets are nested.

use super::Writer;

const RELATIONS: [&str; 7] = ["=", "=", "/=", "<", "<=", ">", ">="];

/// How deep parentheses and brackets are nested in a text.
fn nesting(text: &str) -> usize {
    let mut depth = 0usize;
    let mut most = 0;
    for letter in text.chars() {
        match letter {
            '(' | '[' => depth += 1,
            ')' | ']' => depth = depth.saturating_sub(1),
            _ => {}
        }
        most = most.max(depth);
    }
    most
}

/// Whether a text is a single operand, which needs no parentheses anywhere.
fn is_single(text: &str) -> bool {
    let name = text.split('[').next().unwrap_or_default();
    let has_operator = name.contains(|c| "+-*/%=<>&!()".contains(c));
    // One index, which ends with the text.
    let after = text.split(']').nth(1);
    !has_operator && after.is_none_or(str::is_empty) && text.matches(']').count() < 2
}

impl Writer {
    /// An operand that binds as one, whatever stands around it.
    fn single(text: String) -> String {
        if is_single(&text) { text } else { format!("({text})") }
    }

    /// The text, or something simple where it is nested too deep for more around it.
    fn shallow(
        &mut self,
        text: String,
        most: usize,
        simple: impl Fn(&mut Self) -> String,
    ) -> String {
        if nesting(&text) > most { simple(self) } else { text }
    }

    /// An index that is mostly in its array of `size` elements.
    pub(super) fn index(&mut self, size: usize, depth: usize) -> String {
        let text = match self.rng.below(12) {
            0 | 1 => self.rng.below(size).to_string(),
            2 => self.pool.logical(&mut self.rng),
            3 => {
                let (a, b) = (self.pool.logical(&mut self.rng), self.pool.logical(&mut self.rng));
                format!("{a}+{b}")
            }
            4 => {
                let (a, b) = (self.pool.logical(&mut self.rng), self.pool.logical(&mut self.rng));
                format!("{a}*2+{b}")
            }
            5 => {
                let of = self.logical(depth.min(1));
                let of = Self::single(of);
                format!("{of}+{}", self.rng.below(size - 1))
            }
            6 => {
                let of = self.pool.integer(&mut self.rng);
                format!("({of}%{size}+{size})%{size}")
            }
            7 => {
                let of = self.pool.integer(&mut self.rng);
                format!("{of}%{size}*({of}>0)")
            }
            8 => {
                let of = self.pool.integer(&mut self.rng);
                let limit = self.rng.below(20);
                format!("{of}>{limit}")
            }
            9 => {
                let of = self.pool.integer(&mut self.rng);
                let other = self.pool.logical(&mut self.rng);
                format!("{of}&{other}")
            }
            10 => format!("AC[3]-{}", self.rng.below(2)),
            // This one may be outside.
            _ if self.rng.chance(10) => self.pool.integer(&mut self.rng),
            _ => format!("GI3%{size}"),
        };
        // A constant index is checked by the compiler.
        match text.parse::<usize>() {
            Ok(index) if index < size => text,
            Err(_) if !is_constant(&text) => text,
            _ => "1".to_owned(),
        }
    }

    fn element(&mut self, name: &str, size: usize, depth: usize) -> String {
        let index = self.index(size, depth);
        format!("{name}[{index}]")
    }

    /// An expression of which only whether it is zero counts.
    pub(super) fn logical(&mut self, depth: usize) -> String {
        let choice = if depth == 0 { self.rng.below(4) } else { self.rng.below(16) };
        let text = match choice {
            0..=2 => self.pool.logical(&mut self.rng),
            3 => {
                let (name, size) = *self.rng.pick(&[("XA", 8), ("XC", 4)]);
                self.element(name, size, depth)
            }
            4 => {
                let of = self.logical(depth - 1);
                if of.starts_with(['/', '-']) {
                    format!("/({of})")
                } else {
                    format!("/{}", Self::single(of))
                }
            }
            5..=7 => {
                let (a, b) = (self.integer(depth - 1), self.integer(depth - 1));
                let relation = *self.rng.pick(&RELATIONS);
                format!("{}{relation}{}", Self::single(a), Self::single(b))
            }
            8 => {
                let (a, b) = (self.long(depth - 1), self.any(depth - 1));
                let relation = *self.rng.pick(&RELATIONS);
                format!("{}{relation}{}", Self::single(a), Self::single(b))
            }
            9 => {
                // Relations in a chain: from left to right.
                let (a, b, c) = (self.integer(depth - 1), self.integer(0), self.integer(0));
                let (first, second) = (*self.rng.pick(&RELATIONS), *self.rng.pick(&RELATIONS));
                format!("{}{first}{}{second}{}", Self::single(a), Self::single(b), Self::single(c))
            }
            10 => {
                // A value of any type, of which only the truth counts.
                let (first, other) = (self.any(depth - 1), self.any(depth - 1));
                let operator = *self.rng.pick(&["&", "!", "&/"]);
                format!("{}{operator}{}", Self::single(first), Self::single(other))
            }
            _ => {
                let count = 2 + self.rng.below(3);
                let mut text = String::new();
                for index in 0..count {
                    if index > 0 {
                        text += *self.rng.pick(&["&", "!", "&", "!", "&/", "!/"]);
                    }
                    let part = self.logical(depth - 1);
                    let needed = part.starts_with(['/', '-']) && text.ends_with('/');
                    text += &if needed || self.rng.chance(30) { Self::single(part) } else { part };
                    if text.contains("/-") || text.contains("//") {
                        text = self.pool.logical(&mut self.rng);
                    }
                }
                text
            }
        };
        self.shallow(text, 3, |writer| writer.pool.logical(&mut writer.rng))
    }

    /// An expression that is INTEGER or LOGICAL.
    pub(super) fn integer(&mut self, depth: usize) -> String {
        let choice = if depth == 0 { self.rng.below(5) } else { self.rng.below(18) };
        let text = match choice {
            0..=2 => self.pool.integer(&mut self.rng),
            3 => self.pool.logical(&mut self.rng),
            4 => {
                let (name, size) = *self.rng.pick(&[("AA", 8), ("AC", 4), ("XA", 8)]);
                self.element(name, size, depth)
            }
            5 => {
                let of = self.integer(depth - 1);
                format!(
                    "-{}",
                    if of.starts_with(['-', '/']) { format!("({of})") } else { Self::single(of) }
                )
            }
            6 => {
                let of = self.logical(depth - 1);
                format!("({of})")
            }
            7 | 8 => {
                // A product enters a division with 32 bits.
                let (a, b, c) = (self.integer(depth - 1), self.integer(0), self.integer(0));
                let (a, b, c) = (Self::single(a), Self::single(b), Self::single(c));
                let divide = *self.rng.pick(&["/", "%"]);
                match self.rng.below(5) {
                    0 => format!("({a}*{b}){divide}{c}"),
                    1 => format!("{a}*({b}{divide}{c})"),
                    2 => format!("-({a}*{b}){divide}{c}"),
                    3 => format!("{a}*{b}{divide}{c}*{}", self.pool.small(&mut self.rng)),
                    _ => format!("{a}*{b}{divide}{c}"),
                }
            }
            9 | 10 => {
                // A LONG may be a dividend.
                let (a, b) = (self.long(depth - 1), self.integer(0));
                let divide = *self.rng.pick(&["/", "%"]);
                format!("({}{divide}{})", Self::single(a), Self::single(b))
            }
            11 | 12 => {
                let (a, b) = (self.integer(depth - 1), self.integer(depth - 1));
                let operator = *self.rng.pick(&["*", "/", "%"]);
                format!("{}{operator}{}", Self::single(a), Self::single(b))
            }
            _ => {
                let (a, b) = (self.integer(depth - 1), self.integer(depth - 1));
                let operator = *self.rng.pick(&["+", "-"]);
                // A relation binds weaker than a sum.
                let is_sum = |text: &str| !text.contains(|c| "=<>&!".contains(c));
                let a = if is_sum(&a) { a } else { Self::single(a) };
                format!("{a}{operator}{}", Self::single(b))
            }
        };
        self.shallow(text, 3, |writer| writer.pool.integer(&mut writer.rng))
    }

    /// An expression that may be a LONG.
    pub(super) fn long(&mut self, depth: usize) -> String {
        let choice = if depth == 0 { self.rng.below(4) } else { self.rng.below(10) };
        let text = match choice {
            0..=2 => self.pool.long(&mut self.rng),
            3 => {
                let (name, size) = *self.rng.pick(&[("LA", 8), ("LC", 4)]);
                self.element(name, size, depth)
            }
            4 => {
                let of = self.long(depth - 1);
                format!(
                    "-{}",
                    if of.starts_with('-') { format!("({of})") } else { Self::single(of) }
                )
            }
            _ => {
                let (a, b) = (self.long(depth - 1), self.any(depth - 1));
                let (a, b) = (Self::single(a), Self::single(b));
                let operator = *self.rng.pick(&["+", "-"]);
                if self.rng.chance(50) {
                    format!("{a}{operator}{b}")
                } else {
                    format!("{b}{operator}{a}")
                }
            }
        };
        self.shallow(text, 3, |writer| writer.pool.long(&mut writer.rng))
    }

    /// An expression of any type.
    pub(super) fn any(&mut self, depth: usize) -> String {
        match self.rng.below(4) {
            0 => self.logical(depth),
            1 => self.long(depth),
            _ => self.integer(depth),
        }
    }
}

/// Whether an index names no variable.
fn is_constant(text: &str) -> bool {
    text.chars().all(|c| c.is_ascii_digit() || "TF+-*/%()<>=&".contains(c))
}

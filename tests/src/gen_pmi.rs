//! Generates random valid PMI programs that use everything the language has, each with a stimulus.
//!
//! The same seed gives the same case. Most array indices are kept inside their arrays; a few are
//! not, so that some programs are stopped in the middle of a scan.

use std::fmt::Write as _;

use plcc_random::Rng;

/// A generated program with its stimulus.
#[derive(Clone, Debug)]
pub struct Case {
    /// The source.
    pub source: String,
    /// The stimulus: `tick,name,value` with its heading.
    pub stimulus: String,
    /// The names of all variables of the program, to be watched.
    pub watch: Vec<String>,
    /// The number of ticks that the stimulus is made for.
    pub ticks: u32,
}

/// The type of a value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Ty {
    Logical,
    Integer,
    Long,
}

/// A variable that expressions may name.
#[derive(Clone, Debug)]
struct Var {
    name: String,
    ty: Ty,
    elements: Option<usize>,
    writable: bool,
    /// The largest value that a stimulus may give it; without one, every value of its type.
    most: Option<i32>,
    stimulated: bool,
}

struct Gen {
    rng: Rng,
    vars: Vec<Var>,
    out: String,
    /// Labels that were jumped to and have not been written yet.
    labels: Vec<String>,
    label_count: usize,
    gotos: usize,
    risky: bool,
}

/// A program of about `size` statements.
pub fn generate(seed: u64, size: usize) -> Case {
    let mut rng = Rng::new(seed);
    let risky = rng.chance(15);
    let mut this = Gen {
        rng,
        vars: vec![],
        out: String::new(),
        labels: vec![],
        label_count: 0,
        gotos: 0,
        risky,
    };
    this.declarations();
    this.statements(size, 0);
    for label in std::mem::take(&mut this.labels) {
        this.line(&format!("{label}:"));
    }
    let ticks = 60;
    let stimulus = this.stimulus(ticks);
    let watch = this.vars.iter().map(|var| var.name.clone()).collect();
    Case { source: this.out, stimulus, watch, ticks }
}

/// The executive variables that programs use: name, type, elements, writable, largest value.
const EXECUTIVE: &[(&str, Ty, Option<usize>, bool)] = &[
    ("@IPL", Ty::Logical, None, false),
    ("@ESTOP", Ty::Logical, None, false),
    ("@CP100", Ty::Logical, None, false),
    ("@CP115", Ty::Logical, None, false),
    ("@MODE", Ty::Integer, None, false),
    ("@SCODE", Ty::Long, None, false),
    ("@NHOME", Ty::Logical, Some(32), false),
    ("@PIN", Ty::Long, Some(100), false),
    ("@CL100", Ty::Logical, None, true),
    ("@FRO", Ty::Integer, None, true),
    ("@JGINC", Ty::Integer, None, true),
    ("@OTX00", Ty::Long, None, true),
    ("@NVFLG", Ty::Logical, Some(20), true),
    ("@NVINT", Ty::Integer, Some(20), true),
    ("@NVLNG", Ty::Long, Some(20), true),
    ("@AUPOS", Ty::Long, Some(6), true),
    ("@AUREQ", Ty::Integer, Some(6), true),
    ("@NEWSC", Ty::Logical, None, true),
];

impl Gen {
    fn line(&mut self, text: &str) {
        self.out.push_str(text);
        if self.rng.chance(10) {
            self.out.push_str("  ? A COMMENT, with anything # in it \"");
        }
        self.out.push('\n');
        if self.rng.chance(5) {
            self.out.push_str("? ---- ÄÖ\n\n");
        }
    }

    fn var(&mut self, name: impl Into<String>, ty: Ty, elements: Option<usize>, writable: bool) {
        let name = name.into();
        self.vars.push(Var { name, ty, elements, writable, most: None, stimulated: true });
    }

    fn declarations(&mut self) {
        self.line("$INPUT");
        for i in 0..6 {
            // Two inputs may share a line.
            let bit = if self.rng.chance(10) { 0 } else { i };
            self.line(&format!("IN{i} = 0/{bit}"));
            self.var(format!("IN{i}"), Ty::Logical, None, false);
        }
        for (i, format) in ["B", "BCD", "TWOC"].into_iter().enumerate() {
            let low = self.rng.below(6);
            let high = low + 1 + self.rng.below(7 - low);
            self.line(&format!("GI{i} = {}/{low}-{high}/{format}", 4 + i));
            self.var(format!("GI{i}"), Ty::Integer, None, false);
            let bits = high - low + 1;
            let digits = |bits: usize| if bits >= 4 { 9 } else { (1 << bits) - 1 };
            let most = match format {
                "BCD" if bits > 4 => digits(bits - 4) * 10 + 9,
                "BCD" => digits(bits),
                _ => 255,
            };
            if let Some(var) = self.vars.last_mut() {
                var.most = Some(most);
            }
        }
        self.line("$OUTPUT");
        for i in 0..6 {
            self.line(&format!("OUT{i} = 2/{i}"));
            self.var(format!("OUT{i}"), Ty::Logical, None, true);
        }
        for (i, format) in ["B", "BCD", "TWOC"].into_iter().enumerate() {
            let low = self.rng.below(6);
            let high = low + 1 + self.rng.below(7 - low);
            self.line(&format!("GO{i} = {}/{low}-{high}/{format}", 8 + i));
            self.var(format!("GO{i}"), Ty::Integer, None, true);
        }
        self.values("$LOGICAL", "L", Ty::Logical);
        self.values("$INTEGER", "I", Ty::Integer);
        self.values("$LONG", "G", Ty::Long);
        self.devices();
        for &(name, ty, elements, writable) in EXECUTIVE {
            self.var(name, ty, elements, writable);
        }
        // Implicit LOGICALs.
        for i in 0..8 {
            self.var(format!("X{i}"), Ty::Logical, None, true);
        }
        self.line("$END");
        for i in 0..8 {
            if self.rng.chance(30) {
                self.line(&format!("X{i} = T"));
            } else {
                self.line(&format!("X{i} = X{i}"));
            }
        }
    }

    fn values(&mut self, directive: &str, letter: &str, ty: Ty) {
        self.line(directive);
        self.line(&format!("{letter}V0,{letter}V1, {letter}V2"));
        for i in 0..3 {
            self.var(format!("{letter}V{i}"), ty, None, true);
        }
        let elements = 2 + self.rng.below(7);
        self.line(&format!("{letter}A[{elements}]"));
        self.var(format!("{letter}A"), ty, Some(elements), true);
        let value = self.constant(ty);
        self.line(&format!("{letter}C = {value}"));
        self.var(format!("{letter}C"), ty, None, false);
        let elements = 2 + self.rng.below(4);
        let list: Vec<String> = (0..elements).map(|_| self.constant(ty)).collect();
        self.line(&format!("{letter}K[{elements}] = [{}]", list.join(",")));
        self.var(format!("{letter}K"), ty, Some(elements), false);
        for var in self.vars.iter_mut().rev().take(2) {
            var.stimulated = false;
        }
    }

    /// Faults, messages, keys, timers, flip-flops, codes.
    fn devices(&mut self) {
        for (directive, name) in [("$FAULT", "FLT"), ("$MESSAGE", "MSG")] {
            self.line(directive);
            for i in 0..2 {
                let items = *self.rng.pick(&[
                    "\"NO ? COMMENT\"",
                    "\"TOOL\",IV0",
                    "IV1,\"OF \",GV0,LV0",
                    "\"POS\",@SCODE,\"NOW\"",
                    "GV1,\" OF \",LV2,GC",
                    "\"AT \",TC0,DC1,Q2",
                ]);
                self.line(&format!("{name}{i} = {items}"));
                self.var(format!("{name}{i}"), Ty::Logical, None, true);
            }
        }
        self.line("$KEY");
        for i in 0..2 {
            self.line(&format!("KEY{i} = \"TEXT {i}\""));
            self.var(format!("KEY{i}"), Ty::Long, None, false);
            if let Some(var) = self.vars.last_mut() {
                var.stimulated = false;
            }
        }
        self.line("$TIMER");
        for i in 0..4 {
            let kind = if i % 2 == 0 { "E" } else { "D" };
            let preset = if self.rng.chance(10) { 32_767 } else { 1 + self.rng.below(8) };
            self.line(&format!("{kind}/TC{i}/DC{i} = {preset}"));
            self.var(format!("TC{i}"), Ty::Logical, None, true);
            self.var(format!("DC{i}"), Ty::Logical, None, false);
        }
        self.line("$FLIPFLOP");
        for i in 0..3 {
            self.line(&format!("Q{i}/D{i}/CK{i}/PR{i}/CL{i}"));
            self.var(format!("Q{i}"), Ty::Logical, None, false);
            for pin in ["D", "CK", "PR", "CL"] {
                self.var(format!("{pin}{i}"), Ty::Logical, None, true);
            }
        }
        self.line("$MCODE");
        self.line("@M03/P, @M05/D,@M299/P");
        self.line("$GCODE");
        self.line("@G84/D");
        for code in ["@M03", "@M05", "@M299", "@G84"] {
            self.var(code, Ty::Logical, None, true);
        }
    }

    fn constant(&mut self, ty: Ty) -> String {
        match ty {
            Ty::Logical => (*self.rng.pick(&["T", "F", "0", "1"])).to_owned(),
            Ty::Integer => {
                let any = self.rng.below(65_535) as i32 - 32_767;
                self.rng.pick(&[0, 1, -1, 2, 7, 100, 32_767, -32_767, any]).to_string()
            }
            Ty::Long => {
                let any = self.rng.below(1_999_999_999) as i64 - 999_999_999;
                self.rng.pick(&[0, 1, -1, 40_000, -70_000, 999_999_999, any]).to_string()
            }
        }
    }

    fn statements(&mut self, count: usize, level: usize) {
        let mut left = count;
        while left > 0 {
            let label = match self.labels.is_empty() || !self.rng.chance(30) {
                true => String::new(),
                false => format!("{}: ", self.labels.remove(0)),
            };
            let room = left > 3 && level < 4;
            if room && self.rng.chance(18) {
                left -= self.condition(&label, left, level);
            } else if self.gotos < 20 && level > 0 && self.rng.chance(8) {
                self.goto(&label);
                left -= 1;
            } else if !label.is_empty() && self.rng.chance(20) {
                self.line(label.trim_end());
            } else {
                self.assignment(&label);
                left -= 1;
            }
        }
    }

    /// Writes an IF with its parts. Gives the number of statements in it.
    fn condition(&mut self, label: &str, most: usize, level: usize) -> usize {
        let inside = 1 + self.rng.below(most - 2);
        let mut left = inside;
        let text = self.expression(0);
        self.tokens(&format!("{label}IF("), text.0, ")");
        let part = 1 + self.rng.below(left);
        self.statements(part, level + 1);
        left -= part;
        while left > 0 && self.rng.chance(60) {
            let text = self.expression(0);
            self.tokens("ELSEIF (", text.0, ")");
            let part = 1 + self.rng.below(left);
            self.statements(part, level + 1);
            left -= part;
        }
        if left > 0 && self.rng.chance(70) {
            self.line("ELSE");
            self.statements(left, level + 1);
        }
        self.line("ENDIF");
        inside + 1
    }

    fn goto(&mut self, label: &str) {
        self.gotos += 1;
        let name = if self.labels.is_empty() || self.rng.chance(60) {
            self.label_count += 1;
            let name = format!("LAB{}", self.label_count);
            self.labels.push(name.clone());
            name
        } else {
            self.rng.pick(&self.labels).clone()
        };
        self.line(&format!("{label}GOTO {name}"));
    }

    fn assignment(&mut self, label: &str) {
        let targets: Vec<Var> = self.vars.iter().filter(|var| var.writable).cloned().collect();
        let target = self.rng.pick(&targets).clone();
        let mut head = vec![target.name];
        if let Some(elements) = target.elements {
            let index = self.index(elements, 1);
            head.push("[".to_owned());
            head.extend(index);
            head.push("]".to_owned());
        }
        let (value, _) = self.expression(0);
        head.push(" = ".to_owned());
        head.extend(value);
        self.tokens(label, head, "");
    }

    /// Writes tokens, sometimes continued on the next line.
    fn tokens(&mut self, before: &str, tokens: Vec<String>, behind: &str) {
        let mut text = before.to_owned();
        let mut width = text.len();
        for token in tokens {
            if width > 45 || self.rng.chance(2) {
                text.push_str(" # goes on\n ");
                width = 1;
            }
            if self.rng.chance(15) {
                text.push(' ');
            }
            width += token.len();
            text.push_str(&token);
        }
        text.push_str(behind);
        self.line(&text);
    }

    /// An index that is inside its array most of the time.
    fn index(&mut self, elements: usize, depth: usize) -> Vec<String> {
        if self.risky && self.rng.chance(2) {
            // Mostly outside the array: a variable, a sum, an element, a negative number.
            let name = self.scalar(|var| var.ty == Ty::Integer && var.writable);
            let last = (elements - 1).to_string();
            let parts: Vec<&str> = match self.rng.below(5) {
                0 => vec![&name],
                1 => vec![&name, "+", &last],
                2 => vec!["IA", "[", "1", "]"],
                3 => vec!["-", "LV0"],
                _ => vec![&last, "+", "LV1"],
            };
            return parts.into_iter().map(str::to_owned).collect();
        }
        match self.rng.below(5) {
            0 => vec![self.rng.below(elements).to_string()],
            1 => vec![self.scalar(|var| var.ty == Ty::Logical)],
            2 if depth < 4 => {
                // An element, or a relation of two LONGs, decides between the first two.
                let element = ["/", "LA", "[", "LV2", "]"];
                let relation = ["(", "GV0", "<=", "GV1", ")"];
                let parts = if self.rng.chance(50) { element } else { relation };
                parts.into_iter().map(str::to_owned).collect()
            }
            3 if depth < 3 => {
                let n = elements.to_string();
                let parts = ["(", "IA", "[", "LV1", "]", "%", &n, "+", &n, ")", "%", &n];
                parts.into_iter().map(str::to_owned).collect()
            }
            _ if depth < 4 => {
                // (a%n+n)%n is never outside.
                let name = self.scalar(|var| var.ty == Ty::Integer && var.writable);
                let n = elements.to_string();
                let parts = ["(", &name, "%", &n, "+", &n, ")", "%", &n];
                parts.into_iter().map(str::to_owned).collect()
            }
            _ => vec!["0".to_owned()],
        }
    }

    fn scalar(&mut self, fits: impl Fn(&Var) -> bool) -> String {
        let list: Vec<&Var> =
            self.vars.iter().filter(|var| var.elements.is_none() && fits(var)).collect();
        self.rng.pick(&list).name.clone()
    }

    /// A whole expression and whether it is a LONG; `depth` parentheses stand around it.
    fn expression(&mut self, depth: usize) -> (Vec<String>, bool) {
        self.chain(1, depth)
    }

    /// Operands of one precedence: 1 `!`, 2 `&`, 3 relations, 4 sums, 5 products.
    fn chain(&mut self, level: usize, depth: usize) -> (Vec<String>, bool) {
        if level > 5 {
            return self.unary(depth);
        }
        let (mut tokens, mut long) = self.chain(level + 1, depth);
        let mut more = [0, 35, 35, 30, 35, 35].get(level).copied().unwrap_or(0);
        while self.rng.chance(more) {
            let operators: &[&str] = match level {
                1 => &["!"],
                2 => &["&"],
                3 => &["=", "/=", "<", "<=", ">", ">="],
                4 => &["+", "-"],
                _ if long => &["/", "%"],
                _ => &["*", "/", "%"],
            };
            let operator = *self.rng.pick(operators);
            let (mut right, right_long) = self.chain(level + 1, depth);
            if level == 5 && right_long {
                right = vec![self.rng.below(100).to_string()];
            }
            tokens.push(operator.to_owned());
            tokens.append(&mut right);
            long = level == 4 && (long || right_long);
            more = more * 2 / 3;
        }
        (tokens, long)
    }

    fn unary(&mut self, depth: usize) -> (Vec<String>, bool) {
        if !self.rng.chance(25) {
            return self.primary(depth);
        }
        let not = self.rng.chance(60);
        let (mut tokens, long) = self.primary(depth);
        tokens.insert(0, if not { "/" } else { "-" }.to_owned());
        (tokens, long && !not)
    }

    fn primary(&mut self, depth: usize) -> (Vec<String>, bool) {
        match self.rng.below(20) {
            0 | 1 => {
                let number = match self.rng.below(8) {
                    0 => 32_767,
                    1 => 32_768,
                    2 => 999_999_999,
                    3 => 0,
                    _ => self.rng.below(300),
                };
                (vec![number.to_string()], number > 32_767)
            }
            2 => (vec![if self.rng.chance(50) { "T" } else { "F" }.to_owned()], false),
            3..=6 if depth < 4 => {
                let (mut tokens, long) = self.chain(1, depth + 1);
                tokens.insert(0, "(".to_owned());
                tokens.push(")".to_owned());
                (tokens, long)
            }
            _ => {
                let at = self.rng.below(self.vars.len());
                let var = self.vars[at].clone();
                let mut tokens = vec![var.name];
                match var.elements {
                    Some(elements) if depth < 3 => {
                        tokens.push("[".to_owned());
                        tokens.extend(self.index(elements, depth + 1));
                        tokens.push("]".to_owned());
                    }
                    Some(_) => tokens.push("[0]".to_owned()),
                    None => {}
                }
                (tokens, var.ty == Ty::Long)
            }
        }
    }

    fn stimulus(&mut self, ticks: u32) -> String {
        let mut text = "tick,name,value\n".to_owned();
        let vars: Vec<Var> = self.vars.iter().filter(|var| var.stimulated).cloned().collect();
        for tick in 0..ticks {
            for _ in 0..self.rng.below(2) {
                // Lines of inputs, of outputs and of no variable; a timer's counter.
                let port = self.rng.below(11);
                let (bit, on) = (self.rng.below(8), self.rng.below(2));
                let _ = match self.rng.below(4) {
                    0 => writeln!(text, "{tick},TC{}#COUNT,{}", bit % 4, self.rng.below(5)),
                    _ => writeln!(text, "{tick},PORT{port}.{bit},{on}"),
                };
            }
            for _ in 0..self.rng.below(6) {
                let var = self.rng.pick(&vars).clone();
                let any = self.rng.bits() as i32;
                let value = match var.ty {
                    Ty::Logical => any & 1,
                    _ if var.most.is_some() => any.rem_euclid(var.most.unwrap_or(0) + 1),
                    Ty::Integer => *self.rng.pick(&[0, 1, -1, 32_767, -32_768, any % 100]),
                    Ty::Long => *self.rng.pick(&[0, 1, i32::MAX, i32::MIN, any, any % 1000]),
                };
                // Writing to a string does not fail.
                let _ = match var.elements {
                    Some(elements) => {
                        let index = self.rng.below(elements);
                        writeln!(text, "{tick},{}[{index}],{value}", var.name)
                    }
                    None => writeln!(text, "{tick},{},{value}", var.name),
                };
            }
        }
        text
    }
}

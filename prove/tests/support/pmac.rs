//! Random programs of PMAC.

use fastrand::Rng;

/// What programs may do.
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum Kind {
    /// Anything that is followed.
    All,
    /// What leaves them few states.
    Few,
}

/// A random program with the inputs M1 and M2, and of all kinds M3 and P50, and a condition about it.
pub(crate) fn program(rng: &mut Rng, kind: Kind) -> (String, String) {
    let mut maker = Maker { rng, kind, depth: 2, addresses: false };
    let mut text = format!(
        "I5={}\nI8={}\nM1->Y:$FFC2,0\nM2->Y:$FFC2,1\nM3->Y:$FFC2,2,3,S\nM11->Y:$FFC2,8\nM12->Y:$FFC2,9\n\
         M13->Y:$FFC2,10,3\nM20->D:$900\nM21->DP:$D200\nM22->TWD:1,0,3,2\nM23->X:$0705,4,8,D\nM30->*\n\
         M70->X:$700,0,24,S\nM71->Y:$701,0,24,S\nM72->X:$0,0,24\n",
        [2, 3, 3, 3, 1][maker.rng.usize(..5)],
        maker.rng.u8(..3),
    );
    for (name, chance) in
        [("PLC 0", 2), ("PLC 1", 1), ("PLC 2", 2), ("PLC 7", 2), ("PLCC 0", 4), ("PLCC 3", 3)]
    {
        if maker.rng.u8(..chance) > 0 {
            continue;
        }
        maker.depth = if name.contains("PLCC") { 1 } else { 2 };
        maker.addresses = name == "PLC 1" || name == "PLC 2" || name == "PLC 7";
        text.push_str(&format!("OPEN {name} CLEAR\n"));
        for _ in 0..maker.rng.usize(1..5) {
            maker.statement(&mut text, 2);
        }
        if name == "PLC 1" {
            // Each that may be used is assigned, so that it is not an input.
            text.push_str("M11=M11 M12=M12 M13=M13 P1=P1 P2=P2 P3=P3 M70=M70\n");
        }
        text.push_str("CLOSE\n");
        if maker.rng.u8(..5) == 0 && !name.contains('C') {
            // A disabled PLC can't be paused.
            let words: &[_] =
                [&["DISABLE"][..], &["PAUSE"], &["DISABLE", "PAUSE"]][maker.rng.usize(..3)];
            words.iter().for_each(|word| text.push_str(&format!("{word} {name}\n")));
        }
    }
    let condition = maker.condition();
    (text, condition)
}

struct Maker<'r> {
    rng: &'r mut Rng,
    kind: Kind,
    depth: usize,
    /// Whether ADDRESS is allowed.
    addresses: bool,
}

impl Maker<'_> {
    fn one_of<'t>(&mut self, few: &[&'t str], more: &[&'t str]) -> &'t str {
        let count = few.len() + if self.kind == Kind::All { more.len() } else { 0 };
        let at = self.rng.usize(..count);
        few.get(at).or_else(|| more.get(at - few.len())).unwrap()
    }

    fn comparison(&mut self) -> &'static str {
        self.one_of(
            &["M1=1", "M2=1", "M1=0", "P1=2", "P1>1", "P2<2", "P3=0", "M70>0", "M11=1", "M13!>2"],
            &["P50>2", "P50!~P1", "M3<0", "M72>5", "P4=0.5", "M71!<0", "M30!=0", "M22=P1", "Q3=P1"],
        )
    }

    fn condition(&mut self) -> String {
        let first = self.comparison();
        match self.rng.u8(..3) {
            0 => format!("{first} AND {}", self.comparison()),
            1 => format!("{first} OR {}", self.comparison()),
            _ => first.into(),
        }
    }

    fn statement(&mut self, text: &mut String, depth: usize) {
        let loops = self.depth == 2;
        match self.rng.usize(..if depth == 0 { 6 } else { 10 }) {
            0..=2 => {
                let formula = self.one_of(
                    &[
                        "M11=M1",
                        "M12=1-M2",
                        "M11=M12&M1",
                        "M13=P1",
                        "M12=0",
                        "P1=(P1+1)%4",
                        "P2=(P1*P2+1)%3",
                        "P3=M1+M2",
                        "P3=P1",
                        "P2=M13&3",
                    ],
                    &[
                        "P4=-P1/2",
                        "P4=P4*0.5+P50",
                        "P5=P5+1",
                        "M20=M20-3",
                        "M21=M20*2",
                        "M22=P4",
                        "P6=M23",
                        "M30=P5-M3",
                        "Q3=P1 ADDRESS&2",
                        "Q3=Q3+M30 ADDRESS&1",
                        "Q(P1)=P2",
                        "P(P1+20)=P(P2+20)+1",
                        "P30..33=M3",
                        "P40,12,2=P1",
                        "I31=P5",
                        "I187=P5*20",
                        "P7=INT(P4)+ABS(M3)",
                    ],
                );
                let (plain, address) =
                    formula.split_at(formula.find(" A").unwrap_or(formula.len()));
                let address = if self.addresses { address } else { "" };
                text.push_str(&format!("{plain}{address}\n"));
            }
            3 => {
                let timer = self.one_of(&["M70"], &["M71"]);
                text.push_str(&format!("{timer}={}\n", self.rng.u8(1..4)));
            }
            4 => {
                let words: &[_] = [
                    &["ENABLE"][..],
                    &["DISABLE"],
                    &["PAUSE"],
                    &["RESUME"],
                    &["DISABLE", "PAUSE"],
                    &["PAUSE", "RESUME"],
                ][self.rng.usize(..6)];
                let plc = ["PLC 1", "PLC 2", "PLC 7", "PLC 0..2", "PLC 2,7"][self.rng.usize(..5)];
                words.iter().for_each(|word| text.push_str(&format!("{word} {plc}\n")));
            }
            5 => {
                let command = self.one_of(
                    &["DISABLE PLC 2", "ENABLE PLC 1..7", "P3=(P3+1)%3", "M12=1", "#1J+"],
                    &["Q4=Q3", "I5=3", "DISPLAY 3\"A\"", "P1=P2 P2=P3"],
                );
                let text_of = if command.contains('"') {
                    format!("{command}\n")
                } else {
                    format!("COMMAND\"{command}\"\n")
                };
                text.push_str(&text_of);
            }
            6 if loops => {
                text.push_str(&format!("WHILE ({})\n", self.condition()));
                self.statement(text, depth - 1);
                text.push_str("ENDWHILE\n");
            }
            _ => {
                text.push_str(&format!("IF ({})\n", self.condition()));
                self.statement(text, depth - 1);
                if self.rng.bool() {
                    text.push_str("ELSE\n");
                    self.statement(text, depth - 1);
                }
                text.push_str("ENDIF\n");
            }
        }
    }
}

//! Generates random valid downloads with motion programs, and PLCs that start them, jog and home beside them.

use std::fmt::Write as _;

use plcc_random::Rng;

pub use crate::gen_pmi::Case;

/// Motors 1 and 2 as a radius and an angle of X and Y, beside a third motor that an axis moves.
const KINEMATICS: &str = "I5150=1\n&1 #1->I #2->I\nOPEN FORWARD CLEAR\nP50=P1/100+60\nQ7=P50*COS(P2/100)-60\nQ8=P50*SIN(P2/100)\n\
    CLOSE\nOPEN INVERSE CLEAR\nP51=Q7+60\nP50=60\nP53=0\nWHILE (P53<6)\nP50=(P50+(P51*P51+Q8*Q8)/P50)/2\nP53=P53+1\n\
    ENDWHILE\nP1=(P50-60)*100\nQ0=P51\nP2=ATAN2(Q8)*100\nIF (Q10=1)\nP101=(P51*Q17+Q8*Q18)/P50*100\nP102=Q18*100\nENDIF\n\
    CLOSE\n";

struct Generator {
    rng: Rng,
    out: String,
    /// What the axes are called.
    axes: &'static [char],
    /// Whether there are moves of all modes, or LINEAR and RAPID alone, whose velocities have limits.
    all_modes: bool,
}

/// A case for PMAC, or for Turbo PMAC if `turbo`, with arcs, PVT, splines and kinematics if
/// `all_modes`.
pub fn generate(seed: u64, turbo: bool, all_modes: bool) -> Case {
    let rng = Rng::new(seed);
    let mut g = Generator { rng, out: String::new(), axes: &['X', 'Y', 'Z'], all_modes };
    g.setup(turbo);
    for number in [10, 20] {
        g.program(number);
    }
    g.plcs(turbo);
    let mut stimulus = String::from("tick,name,value\n");
    for tick in [40, 90, 160, 250, 400] {
        if g.rng.chance(40) {
            let row = match g.rng.below(5) {
                0 => "#2.JAM,1",
                1 => "#2.JAM,0",
                2 => "#3.FAULT,1",
                3 => "#3.FAULT,0",
                _ => "X:$C000,0",
            };
            let row = if turbo { row.replace("X:$C000", "X:$78000") } else { row.to_owned() };
            let _ = writeln!(stimulus, "{tick},{row}");
        }
    }
    Case { source: g.out, stimulus, watch: Vec::new(), ticks: 500 }
}

impl Generator {
    fn line(&mut self, text: &str) {
        self.out.push_str(text);
        self.out.push('\n');
    }

    fn pick(&mut self, of: &[&str]) -> String {
        (*self.rng.pick(of)).to_owned()
    }

    fn setup(&mut self, turbo: bool) {
        self.out.push_str("I5=3\n");
        let (system, wait) = if turbo { (5100, "I192=1 I292=1 I392=1") } else { (100, "I12=1") };
        let line = format!("{wait} I8={} I11={}", self.rng.below(4), self.rng.below(3));
        self.line(&line);
        for motor in 1..=3 {
            let line = format!(
                "I{motor}00=1 I{motor}11=0 I{motor}16={} I{motor}17={} I{motor}19={} I{motor}20={} \
                 I{motor}21={} I{motor}22={} I{motor}23={} I{motor}13={} I{motor}14=-90000",
                self.pick(&["10", "40.5", "100"]),
                self.pick(&["0.05", "1", "5"]),
                self.pick(&["0.1", "2"]),
                self.pick(&["0", "20"]),
                self.pick(&["0", "10"]),
                self.pick(&["15", "32.25"]),
                self.pick(&["8", "-20"]),
                self.pick(&["0", "700", "90000"]),
            );
            self.line(&line);
        }
        let line = format!(
            "I{}={} I{}={} I{}={} I{}=1000 I{}={}",
            system + 87,
            self.pick(&["0", "20", "50"]),
            system + 88,
            self.pick(&["0", "10", "30"]),
            system + 89,
            self.pick(&["5", "20.5"]),
            system + 90,
            system + 92,
            self.pick(&["0", "0", "0", "1"]),
        );
        self.line(&line);
        if self.all_modes {
            let line = format!(
                "I{}={} I{}=1",
                if turbo { system + 13 } else { 13 },
                self.pick(&["0", "5", "10", "13"]),
                system + 96,
            );
            self.line(&line);
        }
        if turbo && self.all_modes && self.rng.chance(60) {
            self.out.push_str(KINEMATICS);
        } else {
            self.out.push_str("&1 #1->100X #2->50.5Y+3\n");
        }
        let third = self.pick(&["#3->-20Z", "#3->100X", "#3->10X+20Z"]);
        let line = third.to_string();
        self.line(&line);
        if self.rng.chance(30) {
            self.out.push_str("FRAX(X,Y) INC(Z)\n");
        }
        for number in [902, 907, 912] {
            if !turbo {
                let line = format!("I{number}={}", self.rng.below(16));
                self.line(&line);
            }
        }
        self.out.push_str("M1->Y:$700,0,24,S M2->X:$7F0,0,8 M3->X:$7F1,0,24,S\n");
    }

    fn value(&mut self) -> String {
        match self.rng.below(4) {
            0 => format!("(P{}/3-1)", self.rng.below(4)),
            1 => format!("-{}", self.rng.below(12)),
            2 => format!("{}.{}", self.rng.below(9), self.rng.below(100)),
            _ => format!("{}", self.rng.below(15)),
        }
    }

    fn a_move(&mut self) -> String {
        let mut text = String::new();
        for &axis in self.axes {
            if self.rng.chance(55) {
                let value = self.value();
                let _ = write!(text, "{axis}{value} ");
            }
        }
        if text.is_empty() { "X1".into() } else { text }
    }

    /// Moves of another mode than LINEAR and RAPID.
    fn other_mode(&mut self) -> String {
        let (x, y) = (self.value(), self.value());
        match self.rng.below(6) {
            0 => format!("PVT{}\nX{x}:{y} Y{y}\nX{y}:0\nLINEAR", 10 + self.rng.below(60)),
            1 => format!("SPLINE1\nX{x}\nX{y} Y{x}\nY{x}\nLINEAR"),
            2 => format!("SPLINE2 TA40\nX{x}\nTA20\nX{y} Y{x}\nLINEAR"),
            3 => format!("CIRCLE1\nX{x} Y{y} I{y} J{x}\nLINEAR"),
            4 => format!("CIRCLE2 X{x} Y{y} R20\nX{y} Z2 I3\nLINEAR"),
            _ => format!("NORMAL J-1 CIRCLE1 X{x} Z{y} K{x}\nNORMAL K-1 LINEAR"),
        }
    }

    fn statement(&mut self, depth: usize) {
        if self.all_modes && self.rng.chance(25) {
            let line = self.other_mode();
            return self.line(&line);
        }
        let text = match self.rng.below(if depth > 0 { 24 } else { 28 }) {
            0..=8 => self.a_move(),
            9 => format!("TA{}", self.rng.below(60)),
            10 => format!("TS(P1+{})", self.rng.below(30)),
            11 => format!("F{}", 1 + self.rng.below(40)),
            12 => format!("TM{}", self.rng.below(200)),
            13 => format!("DWELL{}", self.pick(&["0", "5", "33.3"])),
            14 => format!("DELAY{}", self.rng.below(40)),
            15 => self.pick(&["INC", "ABS", "INC(X)", "ABS(X,Y)", "FRAX(X)", "FRAX"]),
            16 => format!("M2=={}", self.rng.below(250)),
            17 => self.pick(&["M3|=5", "M3^=P1", "M2&=127"]),
            18 => format!("P{}=P{}+1", self.rng.below(4), self.rng.below(4)),
            19 => format!("LINEAR {}", self.a_move()),
            20 => format!("RAPID {} LINEAR", self.a_move()),
            21 => format!("SEND\"S{}\"", self.rng.below(9)),
            22 => format!("IF (P1>{}) {}", self.rng.below(9), self.a_move()),
            23 => self.pick(&[
                "PSET X1",
                "HOMEZ1",
                "CMD\"#1P\"",
                "CMD\"?\"",
                "M1=3 WHILE (M1>0) WAIT",
            ]),
            24 => {
                let count = self.rng.below(5);
                self.out.push_str("P5=0\nWHILE (P5<");
                let line = format!("{count})\nP5=P5+1");
                self.line(&line);
                for _ in 0..3 {
                    self.statement(depth + 1);
                }
                "ENDWHILE".into()
            }
            25 => {
                let line = format!("IF (P2<{})", self.rng.below(6));
                self.line(&line);
                self.statement(depth + 1);
                // A one-line IF directly in front of it would take the ELSE.
                self.out.push_str("P9=0\nELSE\n");
                self.statement(depth + 1);
                "ENDIF".into()
            }
            26 => self.pick(&["GOSUB500", "CALL20.005", "GOTO900", "GOSUB777"]),
            _ => self.pick(&["HOME1", "HOME2,3", "BSTART", "BSTOP", "STOP"]),
        };
        let line = text.clone();
        self.line(&line);
    }

    fn program(&mut self, number: usize) {
        let line = format!("OPEN PROG {number} CLEAR");
        self.line(&line);
        if self.rng.chance(80) {
            self.out.push_str("LINEAR INC\n");
        }
        for _ in 0..8 + self.rng.below(14) {
            self.statement(0);
        }
        self.out.push_str("RETURN\nN500 P3=P3+1\n");
        self.statement(0);
        self.out.push_str("RET\nN900 P1=P1+1\nX1\n");
        if number == 20 {
            self.out.push_str("RETURN\nO5 INC Y1\n");
        }
        self.out.push_str("CLOSE\n");
    }

    fn plcs(&mut self, turbo: bool) {
        self.out.push_str("OPEN PLC 1 CLEAR\nADR#2&1\nP10=P10+1\n");
        for at in [1, 100, 200, 300, 380] {
            let command = self.pick(&[
                "&1B10R",
                "&1B20R",
                "&1A",
                "R",
                "S",
                "Q",
                "H",
                "R",
                "#1J+",
                "#2J=300",
                "#1J/",
                "#3HM",
                "#1J:50^10",
                "%50",
                "%120",
                "#1K",
                "#1O5",
                "^A",
                "/",
                "#2J^*",
                "&1B20.005R",
            ]);
            let line = format!("IF (P10={at}) CMD\"{command}\" ENDIF");
            self.line(&line);
        }
        self.out.push_str("IF (P10=1) CMD\"&1B10R\" ENDIF\nIF (P10=440) CMD\"&1A\" ENDIF\n");
        // In longer runs it goes on and on.
        self.out.push_str("IF (P10=500) P10=0 ENDIF\n");
        let status = if turbo { "X:$2040" } else { "X:$0818" };
        let line = format!("CLOSE\nM180->{status},0,1");
        self.line(&line);
    }
}

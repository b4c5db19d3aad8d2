//! Generates random motion programs of which it is known where the axes are after each sequence of moves: of all modes, with
//! segmentation and, on a Turbo PMAC, with kinematics.

use std::fmt::Write as _;

use plcc_random::Rng;

/// A download that starts motion program 10 by itself, and what it does.
#[derive(Clone, Debug)]
pub struct Sequences {
    /// The source.
    pub source: String,
    /// Where X, Y and Z are, in user units, when the program sends the text `0`, `1`…
    pub ends: Vec<[f64; 3]>,
    /// The counts of a user unit of X, Y and Z, which motors 1, 2 and 3 move; `None` where kinematic programs say where motors
    /// 1 to 3 are, which is in P201 to P203 then.
    pub scales: Option<[f64; 3]>,
    /// The highest velocity of a motor in counts/ms, where the moves have limits.
    pub speed: Option<f64>,
    /// How many ticks it takes at most. P204 becomes 1 at the end.
    pub ticks: u32,
}

/// The time of a move in ms at most, with its acceleration.
const LONGEST: f64 = 60.0;

struct Generator {
    rng: Rng,
    out: String,
    at: [f64; 3],
    absolute: bool,
    /// The time of a segment in ms; 0 without segmentation.
    interval: usize,
}

/// Some sequences for PMAC, or for Turbo PMAC if `turbo`.
pub fn generate(seed: u64, turbo: bool) -> Sequences {
    let rng = Rng::new(seed ^ 0x5EC0);
    let mut g =
        Generator { rng, out: String::from("I5=0\n"), at: [0.0; 3], absolute: true, interval: 0 };
    let kinematic = turbo && g.rng.chance(50);
    let segmented = g.rng.chance(50);
    let scales = [100.0, 50.5, -20.0];
    g.setup(turbo, segmented);
    if kinematic {
        let number = g.rng.below(KINEMATICS.len());
        let (forward, inverse) = KINEMATICS[number];
        let _ =
            writeln!(g.out, "I5150=1\n&1 #1->I #2->I #3->I\nOPEN FORWARD CLEAR\n{forward}CLOSE");
        let _ = writeln!(g.out, "OPEN INVERSE CLEAR\n{inverse}CLOSE");
    } else {
        g.out.push_str("&1 #1->100X #2->50.5Y #3->-20Z\n");
    }
    g.out.push_str("OPEN PROG 10 CLEAR\n");
    let mut ends = vec![];
    let mut moves = 0;
    // Only these modes have limits, without segmentation.
    let limited = !segmented && g.rng.chance(50);
    for group in 0..6 {
        if g.rng.chance(25) {
            g.absolute = !g.absolute;
            g.out.push_str(if g.absolute { "ABS\n" } else { "INC\n" });
        }
        moves += g.group(limited);
        let wait = g.rng.below(4);
        let _ = writeln!(g.out, "DWELL{wait}\nP201=P1 P202=P2 P203=P3\nSEND\"{group}\"");
        ends.push(g.at);
    }
    g.out.push_str("P204=1\nCLOSE\n&1B10R\n");
    // RAPID moves and limits may take longer than the times of the moves say.
    let ticks = ((f64::from(moves) * LONGEST * 4.0 + 200.0) / 0.4427) as u32;
    Sequences {
        source: g.out,
        ends,
        scales: (!kinematic).then_some(scales),
        speed: limited.then_some(40.0),
        ticks,
    }
}

/// Forward and inverse kinematic programs. The axes are 0 where the motors are.
const KINEMATICS: [(&str, &str); 2] = [
    (
        "Q7=P1/100-P2/200\nQ8=P2/50\nQ9=P3/-20\n",
        "P2=Q8*50\nP1=(Q7+P2/200)*100\nP3=Q9*-20\nIF (Q10=1)\nP102=Q18*50\nP101=(Q17+P102/200)*100\nP103=Q19*-20\nENDIF\n",
    ),
    // An arm: a radius from 60 units on, and an angle. The root is found as controls of old did.
    (
        "P50=P1/100+60\nQ7=P50*COS(P2/100)-60\nQ8=P50*SIN(P2/100)\nQ9=P3/-20\n",
        "P51=Q7+60\nP52=P51*P51+Q8*Q8\nP50=60\nP53=0\nWHILE (P53<7)\nP50=(P50+P52/P50)/2\nP53=P53+1\nENDWHILE\n\
         P1=(P50-60)*100\nQ0=P51\nP2=ATAN2(Q8)*100\nP3=Q9*-20\nIF (Q10=1)\nP101=(P51*Q17+Q8*Q18)/P50*100\nP102=Q18*100\n\
         P103=0\nENDIF\n",
    ),
];

impl Generator {
    fn setup(&mut self, turbo: bool, segmented: bool) {
        let system = if turbo { 5100 } else { 100 };
        for motor in 1..=3 {
            let acceleration = self.rng.pick(&["0.4", "2", "20"]);
            let _ = writeln!(
                self.out,
                "I{motor}00=1 I{motor}11=0 I{motor}13=0 I{motor}14=0 I{motor}16=40 I{motor}17={acceleration} \
                 I{motor}19=2 I{motor}20=4 I{motor}21=2 I{motor}22=40"
            );
        }
        let wait = if turbo { "I192=1 I292=1 I392=1" } else { "I12=1" };
        let _ = writeln!(self.out, "{wait}");
        let _ = writeln!(
            self.out,
            "I{}=20 I{}=5 I{}=30 I{}=1000",
            system + 87,
            system + 88,
            system + 89,
            system + 90
        );
        self.interval = if segmented { *self.rng.pick(&[2, 5, 7]) } else { 0 };
        let interval = if turbo { system + 13 } else { 13 };
        let _ = writeln!(self.out, "I{interval}={}", self.interval);
    }

    fn distance(&mut self) -> f64 {
        self.rng.below(81) as f64 / 10.0 - 4.0
    }

    /// The words of a move, with what stands behind each value.
    fn words(&mut self, suffix: &mut dyn FnMut(&mut Rng) -> String) {
        let axes = 1 + self.rng.below(7);
        for (index, axis) in ['X', 'Y', 'Z'].into_iter().enumerate() {
            if axes >> index & 1 == 0 {
                continue;
            }
            let value = self.distance();
            self.at[index] = if self.absolute { value } else { self.at[index] + value };
            let suffix = suffix(&mut self.rng);
            let _ = write!(self.out, "{axis}{value}{suffix} ");
        }
    }

    /// Moves of a mode, or of several that blend. Gives how many.
    fn group(&mut self, limited: bool) -> u32 {
        let count = 1 + self.rng.below(4) as u32;
        match self.rng.below(if limited { 2 } else { 6 }) {
            0 => {
                // The move that follows is calculated up to a segment behind the beginning of this one, and is late a segment
                // in front of the beginning of its stop, whose acceleration may be longer by less than 20 ms.
                let shortest = 2 * self.interval + 10;
                let _ = writeln!(self.out, "LINEAR TM{}", shortest + self.rng.below(30));
                for _ in 0..count {
                    if self.rng.chance(30) {
                        let _ =
                            writeln!(self.out, "TA{} TS{}", self.rng.below(20), self.rng.below(10));
                    }
                    self.words(&mut |_| String::new());
                    self.out.push('\n');
                }
            }
            1 => {
                self.out.push_str("RAPID\n");
                for _ in 0..count {
                    self.words(&mut |_| String::new());
                    self.out.push('\n');
                }
            }
            2 => {
                let _ = writeln!(self.out, "PVT{}", 10 + self.rng.below(40));
                for _ in 0..count {
                    self.words(&mut |rng| format!(":{}", rng.below(60) as f64 - 30.0));
                    self.out.push('\n');
                }
            }
            3 => {
                let _ = writeln!(self.out, "TA{} SPLINE1", 10 + self.rng.below(30));
                for _ in 0..count {
                    self.words(&mut |_| String::new());
                    self.out.push('\n');
                }
            }
            4 => {
                self.out.push_str("SPLINE2\n");
                for _ in 0..count {
                    let _ = write!(self.out, "TA{} ", 10 + self.rng.below(30));
                    self.words(&mut |_| String::new());
                    self.out.push('\n');
                }
            }
            _ => {
                let _ = writeln!(self.out, "TA10 TS0 TM{}", 20 + self.rng.below(30));
                for _ in 0..count {
                    let mode = *self.rng.pick(&["CIRCLE1", "CIRCLE2", "LINEAR"]);
                    let _ = write!(self.out, "{mode} ");
                    let before = self.at;
                    self.words(&mut |_| String::new());
                    if mode != "LINEAR" {
                        let [i, j] = [(); 2].map(|()| self.distance());
                        // No circle has a radius through one point of the plane alone.
                        let in_plane = self.at[0] != before[0] || self.at[1] != before[1];
                        let centre = match self.rng.chance(50) || !in_plane {
                            true => format!("I{i} J{j}"),
                            false => "R30".into(),
                        };
                        self.out.push_str(&centre);
                    }
                    self.out.push('\n');
                }
            }
        }
        count
    }
}

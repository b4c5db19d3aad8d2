//! Statements that find their operands through registers: `ADD` to `CMP`, `HF`, `PF`, `MR`, `MW`, `LFI`, `SFI`.

use super::Writer;

impl Writer {
    /// `ADD`, `SUB`, `MUL`, `DIV`, `CMP` with their area of registers.
    pub(super) fn area(&mut self) {
        let size = *self.rng.pick(&[1, 2, 2, 4, 4, 3]);
        let area = *self.rng.pick(&[200, 210, 220]);
        let address = |writer: &mut Self| match writer.rng.below(12) {
            0 => 0xA00,
            1 => 0x998,
            2 => 0x004,
            _ => {
                let byte = 300 + 2 * writer.rng.below(6) as u32;
                (byte / 100) << 8 | (byte / 10 % 10) << 4 | (byte % 10)
            }
        };
        let (a, b, c) = (address(self), address(self), address(self));
        line!(
            self,
            ".{size:04} SF{area} .{a:04X} SF{} .{b:04X} SF{} .{c:04X} SF{}",
            area + 2,
            area + 4,
            area + 6
        );
        for byte in [300, 304] {
            if self.rng.chance(50) {
                let load = self.load();
                line!(self, "{load} SF{byte}");
            }
        }
        line!(self, "{}{area}", self.rng.pick(&["ADD", "SUB", "MUL", "DIV", "CMP"]));
        if self.rng.chance(70) {
            self.flags();
        }
    }

    /// The flags of the statement before are asked for.
    pub(super) fn flags(&mut self) {
        let flag = *self
            .rng
            .pick(&["F0080", "F0082", "F0053", "F0046", "F0047", "F0040", "F0083", "F0081"]);
        match self.rng.below(4) {
            0 => line!(self, "{flag} UQ01 Z"),
            1 => line!(self, "({flag} O F0046) UF0207 E DF0207 Z"),
            2 => line!(self, "L{flag} SY005"),
            _ => self.line("LF004 SF030".to_owned()),
        }
    }

    /// `HF` and `PF`.
    pub(super) fn search(&mut self) {
        for byte in [500, 502, 504] {
            if self.rng.chance(30) {
                line!(self, ",{} SF{byte}", self.rng.below(5));
            }
        }
        if self.rng.chance(60) {
            let size = 1 + self.rng.below(2);
            let mask = *self.rng.pick(&[".FFFF", ".3FFF", ".00FF"]);
            line!(
                self,
                ".{size:04} SF230 .0500 SF232 ,{} SF234 {mask} SF236",
                2 * self.rng.below(8)
            );
            line!(self, ",{}", self.rng.below(5));
            self.line("HF230".to_owned());
            self.line("F0080 UQ00 E F0081 UQ01 E LF238 BIN -500 /2 SF104 Z Z".to_owned());
        } else {
            let both = *self.rng.pick(&[".0002", ".0102"]);
            line!(self, "{both} SF240 .0502 SF242 .4000 PF240");
            self.flags();
        }
    }

    /// `MR` and `MW`.
    pub(super) fn memory(&mut self) {
        let format = *self.rng.pick(&[".0004", ".0304", ".0002", ".0001"]);
        let segment = *self.rng.pick(&[".0001", ".0001", ".0002"]);
        let index = *self.rng.pick(&[".0100", ".0101", ".0180", ".2000"]);
        let statement = *self.rng.pick(&["MR", "MW"]);
        line!(self, "{format} SF250 {segment} SF252 {index} SF254 .0300 SF256 {statement}250");
        self.flags();
    }

    /// `LFI` and `SFI`, with a pointer that moves.
    pub(super) fn pointer(&mut self) {
        match self.rng.below(5) {
            0 => line!(
                self,
                ".{} SF490",
                self.rng.pick(&["0120", "0020", "0499", "0490", "0A00", "1000"])
            ),
            1 => self.line("LF490 BIN +2 BCD SF490".to_owned()),
            2 => self.line("LF490 BIN +1 BCD >=.0130 .0120 Z SF490".to_owned()),
            3 => self.line("LF490 +1 SF490".to_owned()),
            _ => {}
        }
        match self.rng.below(4) {
            0 => self.line("LFI490 +1 SFI490".to_owned()),
            1 => {
                let load = self.load();
                line!(self, "{load} SFI490");
            }
            2 => {
                let load = self.load();
                line!(self, "{load} +LFI490");
                self.stores();
            }
            _ => self.line("LF021 +SFI490".to_owned()),
        }
        if self.rng.chance(50) {
            self.line("(F0080 O F0082) UF0206 E DF0206 Z".to_owned());
        }
    }
}

//! ADD to CMP, MR and MW: the manual's examples (NCT 4.15, 4.16) and the edges.

use plcc_abi::nct::{FlagLocation, NctSettings};
use plcc_abi::{Host, HostFn};

use crate::nct::host::NctHost;
use crate::nct::memory::NcMemory;

/// Local variables with a host, and what a statement leaves of its flags.
struct Bench {
    flags: Vec<FlagLocation>,
    memory: NcMemory,
    f: Vec<u8>,
}

impl Bench {
    fn new(settings: &NctSettings) -> Self {
        let flags = (0..1000).map(|offset| FlagLocation { offset, unpacked: false }).collect();
        let memory = NcMemory::new(settings);
        Self { flags, memory, f: vec![0; 1000] }
    }

    fn words(mut self, start: usize, words: &[u16]) -> Self {
        for (i, word) in words.iter().enumerate() {
            self.f[start + i * 2..][..2].copy_from_slice(&word.to_le_bytes());
        }
        self
    }

    fn number(mut self, start: usize, value: i32) -> Self {
        self.f[start..start + 4].copy_from_slice(&value.to_le_bytes());
        self
    }

    fn run(mut self, function: HostFn, area: u64) -> Self {
        let mut host = NctHost { flags: &self.flags, memory: &mut self.memory, time: None };
        assert_eq!(host.call(&mut self.f, function, [area, 0, 0, 0]), 0);
        self
    }

    fn long(&self, start: usize) -> i32 {
        i32::from_le_bytes(self.f[start..start + 4].try_into().unwrap())
    }

    /// F0080 F0082 F0046 F0047 F0053.
    fn flags(&self) -> [u8; 5] {
        let bit = |byte: usize, bit: u8| self.f[byte] >> bit & 1;
        [bit(8, 0), bit(8, 2), bit(4, 6), bit(4, 7), bit(5, 3)]
    }
}

fn bench() -> Bench {
    Bench::new(&NctSettings::default())
}

#[test]
fn add_stores_the_sum_and_its_flags() {
    let area = [4, 0x270, 0x274, 0x282];
    let add =
        |a, b| bench().words(220, &area).number(270, a).number(274, b).run(HostFn::NctAdd, 220);
    let sum = add(100_000, -30_000);
    assert_eq!((sum.long(282), sum.flags()), (70_000, [0; 5]));
    assert_eq!(add(5, -5).flags(), [0, 0, 1, 0, 0]);
    let over = add(i32::MAX, 1);
    assert_eq!((over.long(282), over.flags()), (i32::MIN, [0, 0, 0, 1, 1]));
}

#[test]
fn sub_stores_the_difference_and_its_flags() {
    let area = [4, 0x270, 0x274, 0x286];
    let sub =
        |a, b| bench().words(230, &area).number(270, a).number(274, b).run(HostFn::NctSub, 230);
    let difference = sub(3, 5);
    assert_eq!((difference.long(286), difference.flags()), (-2, [0, 0, 0, 1, 0]));
    assert_eq!(sub(i32::MIN, 1).flags(), [0, 0, 0, 0, 1]);
}

#[test]
fn mul_stores_a_product_of_eight_bytes() {
    let mul = |a, b| {
        let area = [4, 0x282, 0x278, 0x290];
        bench().words(240, &area).number(282, a).number(278, b).run(HostFn::NctMul, 240)
    };
    let product = mul(-100_000, 50_000);
    let bytes = product.f[290..298].try_into().unwrap();
    assert_eq!(i64::from_le_bytes(bytes), -5_000_000_000);
    assert_eq!(product.flags(), [0, 0, 0, 1, 1]);
    assert_eq!(mul(7, 6).flags(), [0; 5]);
    let least = mul(i32::MIN, i32::MIN);
    assert_eq!(i64::from_le_bytes(least.f[290..298].try_into().unwrap()), 1 << 62);
}

#[test]
fn div_stores_the_remainder_after_the_quotient() {
    let div = |a: i64, b| {
        let area = [4, 0x290, 0x286, 0x298];
        let mut bench = bench().words(250, &area).number(286, b);
        bench.f[290..298].copy_from_slice(&a.to_le_bytes());
        bench.run(HostFn::NctDiv, 250)
    };
    let ratio = div(-5_000_000_007, 100_000);
    assert_eq!((ratio.long(298), ratio.long(302)), (-50_000, -7));
    assert_eq!(ratio.flags(), [0, 0, 0, 1, 0]);
    let by_zero = div(1, 0);
    assert_eq!((by_zero.long(298), by_zero.flags()), (0, [1, 0, 0, 0, 0]));
    // The quotient's low bytes alone are written, and the flags come from them.
    let wide = div(1 << 32, 1);
    assert_eq!((wide.long(298), wide.flags()), (0, [0, 0, 1, 0, 0]));
    assert_eq!(div(i64::MIN, -1).flags(), [0, 0, 1, 0, 0]);
}

#[test]
fn cmp_compares_signed_numbers() {
    let cmp = |a, b| {
        let area = [4, 0x298, 0x270];
        bench().words(260, &area).number(298, a).number(270, b).run(HostFn::NctCmp, 260).flags()
    };
    assert_eq!(cmp(5, 5), [0, 0, 1, 0, 0]);
    assert_eq!(cmp(-1, 5), [0, 0, 0, 1, 0]);
    assert_eq!(cmp(5, -1), [0; 5]);
    assert_eq!(cmp(i32::MIN, 1), [0, 0, 0, 1, 1]);
}

#[test]
fn areas_may_hold_numbers_of_one_and_two_bytes() {
    let byte = bench().words(220, &[1, 0x300, 0x301, 0x302]).words(300, &[0x7F7F, 0xAA00]);
    let byte = byte.run(HostFn::NctAdd, 220);
    assert_eq!((&byte.f[302..304], byte.flags()), (&[0xFE, 0xAA][..], [0, 0, 0, 1, 1]));
    let word = bench().words(220, &[2, 0x300, 0x302, 0x302]).words(300, &[0xFFFF, 2]);
    let word = word.run(HostFn::NctMul, 220);
    assert_eq!((word.long(302), word.flags()), (-2, [0, 0, 0, 1, 0]));
}

#[test]
fn a_wrong_area_changes_flags_alone() {
    let refused = |area: &[u16]| {
        let mut bench = bench().words(220, area);
        bench.f[4] = 0xC0;
        bench.f[5] = 0x08;
        bench.f[8] = 0x02;
        let before = bench.f.clone();
        let after = bench.run(HostFn::NctAdd, 220);
        let mut other = after.f.clone();
        other[8] &= !0b101;
        assert_eq!(other, before);
        [after.flags()[0], after.flags()[1]]
    };
    assert_eq!(refused(&[3, 0x270, 0x274, 0x282]), [1, 0]);
    assert_eq!(refused(&[0x104, 0x270, 0x274, 0x282]), [1, 0]);
    assert_eq!(refused(&[4, 0x27A, 0x274, 0x282]), [0, 1]);
    assert_eq!(refused(&[3, 0x27A, 0x274, 0x282]), [1, 1]);
    assert_eq!(refused(&[4, 0x270, 0x997, 0x282]), [1, 0]);
    assert_eq!(refused(&[4, 0x270, 0x1000, 0xFFFF]), [1, 1]);
    // The last four bytes are still there.
    assert_eq!(refused(&[4, 0x996, 0x996, 0x9999]), [1, 0]);
    assert_eq!(
        bench().words(220, &[4, 0x996, 0x996, 0x996]).run(HostFn::NctAdd, 220).flags()[0],
        0
    );
    assert_eq!(bench().run(HostFn::NctAdd, 993).flags(), [1, 0, 0, 0, 0]);
}

#[test]
fn mr_reads_a_macro_variable_with_three_decimals() {
    let settings = NctSettings {
        macros: vec![(180, 12.3456), (181, -0.0005), (182, 1e9), (2000, 77.0)],
        parameters: vec![(61, 40)],
        ..NctSettings::default()
    };
    let read = |area: [u16; 4]| Bench::new(&settings).words(200, &area).run(HostFn::NctMr, 200);
    let value = read([0x0304, 1, 0x180, 0x270]);
    assert_eq!((value.long(270), value.flags()), (12_346, [0; 5]));
    assert_eq!(read([0x0304, 1, 0x181, 0x270]).long(270), -1);
    assert_eq!(read([0x0304, 1, 0x182, 0x270]).flags(), [1, 0, 0, 0, 0]);
    assert_eq!(read([0x0304, 1, 0x2000, 0x270]).long(270), 77);
    assert_eq!(read([0x0004, 2, 0x61, 0x270]).long(270), 40);
    assert_eq!(read([0x0004, 1, 0x999, 0x270]).flags(), [0; 5]);
    assert_eq!(read([0x0904, 1, 0x180, 0x270]).flags(), [1, 0, 0, 0, 0]);
    assert_eq!(read([0x0303, 1, 0x180, 0x270]).flags(), [1, 0, 0, 0, 0]);
    assert_eq!(read([0x0304, 3, 0x180, 0x270]).flags(), [1, 0, 0, 0, 0]);
    assert_eq!(read([0x0304, 1, 0x1000, 0x270]).flags(), [1, 0, 0, 0, 0]);
    assert_eq!(read([0x0304, 1, 0, 0x270]).flags(), [1, 0, 0, 0, 0]);
    assert_eq!(read([0x0304, 1, 0x18A, 0x270]).flags(), [0, 1, 0, 0, 0]);
    assert_eq!(read([0x0304, 3, 0x180, 0x2F0]).flags(), [1, 1, 0, 0, 0]);
    // 12 346 does not fit a byte.
    assert_eq!(read([0x0301, 1, 0x180, 0x270]).flags(), [1, 0, 0, 0, 0]);
}

#[test]
fn mw_writes_what_mr_reads() {
    for (segment, index) in [(1, 0x183), (1, 0x2500), (2, 0x1204)] {
        let bench = bench().words(210, &[0x0304, segment, index, 0x298]).number(298, -1500);
        let written = bench.run(HostFn::NctMw, 210);
        assert_eq!(written.flags(), [0; 5]);
        let read = written.words(200, &[0x0304, segment, index, 0x270]).run(HostFn::NctMr, 200);
        assert_eq!(read.long(270), -1500);
        let unshifted = read.words(200, &[0x0004]).run(HostFn::NctMr, 200);
        assert_eq!(unshifted.long(270), if index == 0x183 { -2 } else { -1500 });
    }
}

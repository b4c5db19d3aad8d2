//! Values in registers, in the formats that addresses name.

use plcc_configuration::drivers::modbus::{Coding, Format, Order};

/// The value that registers hold in a format; `None` where they are too few, or hold what is not a decimal digit.
pub(super) fn decode(format: Format, registers: &[u16]) -> Option<f64> {
    let first = *registers.first()?;
    let (coding, order) = match format {
        Format::Bit => return Some(f64::from(first != 0)),
        Format::BitOf(bit) => return Some(f64::from(first >> bit & 1)),
        Format::Number(coding, order) => (coding, order),
    };
    let words = registers.get(..coding.registers().into())?;
    let append = |bits: u64, word: &u16| bits << 16 | u64::from(in_order(*word, order));
    let bits: u64 = match order.is_low_word_first {
        true => words.iter().rev().fold(0, append),
        false => words.iter().fold(0, append),
    };
    Some(match coding {
        Coding::U16 | Coding::U32 | Coding::U64 => bits as f64,
        Coding::I16 => (bits as i16).into(),
        Coding::I32 => (bits as i32).into(),
        Coding::I64 => bits as i64 as f64,
        Coding::F32 => f32::from_bits(bits as u32).into(),
        Coding::F64 => f64::from_bits(bits),
        Coding::Bcd16 | Coding::Bcd32 => {
            let digits = (0..8).rev().map(|n| bits >> (4 * n) & 0xF);
            digits.clone().all(|digit| digit < 10).then_some(())?;
            digits.fold(0, |number, digit| number * 10 + digit) as f64
        }
    })
}

/// A register with its bytes as Modbus has them, of one in the order of a device, or the reverse.
fn in_order(word: u16, order: Order) -> u16 {
    if order.is_low_byte_first { word.swap_bytes() } else { word }
}

/// Puts a value into registers in a format. Returns whether they can have it; if not, they stay as they are.
pub(super) fn encode(format: Format, value: f64, registers: &mut [u16]) -> bool {
    let Some(first) = registers.first_mut() else { return false };
    let (coding, order) = match format {
        Format::Bit => {
            *first = u16::from(value != 0.0);
            return true;
        }
        Format::BitOf(bit) => {
            *first = *first & !(1 << bit) | u16::from(value != 0.0) << bit;
            return true;
        }
        Format::Number(coding, order) => (coding, order),
    };
    let value = if coding.is_float() { value } else { value.round() };
    let (low, high) = coding.range();
    if !(low..=high).contains(&value) {
        return false;
    }
    let Some(words) = registers.get_mut(..coding.registers().into()) else { return false };
    let bits = match coding {
        Coding::F32 => (value as f32).to_bits().into(),
        Coding::F64 => value.to_bits(),
        Coding::Bcd16 | Coding::Bcd32 => {
            let digit = |n: u32| value as u64 / 10_u64.pow(n) % 10;
            (0..8).fold(0, |bits, n| bits | digit(n) << (4 * n))
        }
        Coding::U64 => value as u64,
        // The lowest registers are the same with and without a sign.
        _ => value as i64 as u64,
    };
    let put = |(n, word): (usize, &mut u16)| *word = in_order((bits >> (16 * n)) as u16, order);
    match order.is_low_word_first {
        true => words.iter_mut().enumerate().for_each(put),
        false => words.iter_mut().rev().enumerate().for_each(put),
    }
    true
}

/// The value nearest to this one that a format can hold; of what is not a number the one nearest to 0.
pub(super) fn nearest(format: Format, value: f64) -> f64 {
    let (low, high) = format.range();
    if value.is_nan() { 0.0 } else { value }.clamp(low, high)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use plcc_configuration::drivers::modbus::ModbusAddress;

    use super::*;

    fn format(text: &str) -> Format {
        ModbusAddress::parse(&format!("holding/0:{text}"), false, false).unwrap().format
    }

    #[test]
    fn values_come_back_from_registers() {
        for (text, value, registers) in [
            ("u16", 65535.0, &[0xFFFF_u16][..]),
            ("u16-badc", 258.0, &[0x0201]),
            ("i16", -2.0, &[0xFFFE]),
            ("u32", 65536.0, &[1, 0]),
            ("u32-swapped", 65536.0, &[0, 1]),
            ("i32", -2.0, &[0xFFFF, 0xFFFE]),
            ("u32", f64::from(0x0A0B_0C0D), &[0x0A0B, 0x0C0D]),
            ("u32-abcd", f64::from(0x0A0B_0C0D), &[0x0A0B, 0x0C0D]),
            ("u32-cdab", f64::from(0x0A0B_0C0D), &[0x0C0D, 0x0A0B]),
            ("u32-badc", f64::from(0x0A0B_0C0D), &[0x0B0A, 0x0D0C]),
            ("u32-dcba", f64::from(0x0A0B_0C0D), &[0x0D0C, 0x0B0A]),
            ("f32", 1.5, &[0x3FC0, 0]),
            ("f32-swapped", 1.5, &[0, 0x3FC0]),
            ("f32-dcba", 1.5, &[0, 0xC03F]),
            ("u64", 1e15, &[0x0003, 0x8D7E, 0xA4C6, 0x8000]),
            ("u64-dcba", 1e15, &[0x0080, 0xC6A4, 0x7E8D, 0x0300]),
            ("i64", -2.0, &[0xFFFF, 0xFFFF, 0xFFFF, 0xFFFE]),
            ("i64-cdab", -2.0, &[0xFFFE, 0xFFFF, 0xFFFF, 0xFFFF]),
            ("f64", -0.1, &[0xBFB9, 0x9999, 0x9999, 0x999A]),
            ("bcd16", 9876.0, &[0x9876]),
            ("bcd32", 12_345_678.0, &[0x1234, 0x5678]),
            ("bcd32-cdab", 12_345_678.0, &[0x5678, 0x1234]),
            ("bit5", 1.0, &[0x20]),
        ] {
            let mut made = vec![0; registers.len()];
            assert!(encode(format(text), value, &mut made), "{text}");
            assert_eq!(
                (made.as_slice(), decode(format(text), &made)),
                (registers, Some(value)),
                "{text}"
            );
        }
    }

    #[test]
    fn what_does_not_fit_leaves_registers_as_they_are() {
        let mut same = [7; 4];
        for (text, value, nearest) in [
            ("u16", -1.0, 0.0),
            ("u16", f64::NAN, 0.0),
            ("i16", 4e4, 32767.0),
            ("u32-swapped", -1.0, 0.0),
            ("f32", 1e39, f32::MAX.into()),
            ("f32", f64::NEG_INFINITY, f32::MIN.into()),
            ("f64", f64::INFINITY, f64::MAX),
            ("u64", 18_446_744_073_709_551_616.0, 18_446_744_073_709_549_568.0),
            ("i64", 9_223_372_036_854_775_808.0, 9_223_372_036_854_774_784.0),
            ("bcd16", 10_000.0, 9999.0),
            ("bcd16", -1.0, 0.0),
            ("bcd32", 1e8, 99_999_999.0),
        ] {
            assert!(!encode(format(text), value, &mut same), "{text}");
            assert_eq!(super::nearest(format(text), value), nearest, "{text}");
            assert!(encode(format(text), nearest, &mut [0; 4]), "{text}");
        }
        assert_eq!(same, [7; 4]);
        assert!(!encode(format("f64"), 1.0, &mut [0; 3]), "there are too few");
        assert_eq!(decode(format("f32-swapped"), &[1]), None);
        assert_eq!(decode(format("bcd16"), &[0x00A0]), None);
        assert_eq!(decode(format("bcd32"), &[0, 0x000F]), None);
    }
}

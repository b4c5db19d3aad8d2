//! Digital lines as numbers (PMI 3.1.2).

use plcc_abi::image::{read_u8, write_u8};
use plcc_abi::pmi::{Format, Lines, Type};

/// The type of the variable of some lines.
pub(super) fn variable_type(lines: Lines) -> Type {
    match lines.format {
        Format::Bit => Type::Logical,
        _ => Type::Integer,
    }
}

/// The bits of lines in the byte of their port.
pub(super) fn mask(lines: Lines) -> u8 {
    let bits = 1u16.checked_shl(lines.count.into()).unwrap_or(0).wrapping_sub(1);
    (bits << (lines.low & 7)) as u8
}

/// What the lines of a port mean. BCD digits count with their weights, also those above 9.
pub(super) fn decode(lines: Lines, port: u8) -> i16 {
    let bits = (port & mask(lines)) >> (lines.low & 7);
    match lines.format {
        Format::Bit | Format::Binary => bits.into(),
        Format::Bcd => i16::from(bits >> 4) * 10 + i16::from(bits & 0xF),
        Format::TwosComplement => {
            let spare = 8u32.saturating_sub(lines.count.into());
            let high = bits.checked_shl(spare).unwrap_or(0) as i8;
            high.checked_shr(spare).unwrap_or(0).into()
        }
    }
}

/// The bits of a value, at the lowest places. Of a value with more digits than BCD's two, the
/// lowest two count; of one with more bits than there are lines, the lowest bits.
fn encode(lines: Lines, value: i16) -> u8 {
    match lines.format {
        Format::Bit => u8::from(value != 0),
        Format::Binary | Format::TwosComplement => value as u8,
        Format::Bcd => {
            let digits = value.rem_euclid(100) as u8;
            ((digits / 10) << 4) | (digits % 10)
        }
    }
}

/// Whether BCD lines can carry a value; those of other formats take any.
pub(super) fn fits(lines: Lines, value: i64) -> bool {
    if lines.format != Format::Bcd {
        return true;
    }
    let all = u16::from(mask(Lines { low: 0, ..lines }));
    u16::try_from(value).is_ok_and(|value| {
        let bits = ((value / 10) << 4) | (value % 10);
        value <= 99 && bits & !all == 0
    })
}

/// Puts a value on its lines, and leaves the port's others.
pub(super) fn drive(image: &mut [u8], ports: u32, lines: Lines, value: i16) {
    let at = ports + u32::from(lines.port);
    let (mask, bits) = bits(lines, value);
    let others = read_u8(image, at) & !mask;
    write_u8(image, at, others | bits);
}

/// The bits of lines in the byte of their port, and those of them that are 1 for a value.
pub(super) fn bits(lines: Lines, value: i16) -> (u8, u8) {
    let mask = mask(lines);
    (mask, (encode(lines, value) << (lines.low & 7)) & mask)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lines(low: u8, count: u8, format: Format) -> Lines {
        Lines { port: 0, low, count, format }
    }

    /// The tables of PMI 3.1.2.1.4 to 3.1.2.1.6, and the rulings' 0xC.
    #[test]
    fn port_lines_have_the_weights_of_their_format() {
        for (low, count, format, port, value) in [
            (0, 8, Format::Binary, 0b0010_1100, 44),
            (0, 8, Format::Bcd, 0b0010_1000, 28),
            (0, 8, Format::Bcd, 0b1001_0010, 92),
            (0, 4, Format::Bcd, 0x0C, 12),
            (0, 8, Format::Bcd, 0xFF, 165),
            (0, 8, Format::TwosComplement, 0b0001_1001, 25),
            (0, 8, Format::TwosComplement, 0b1110_0111, -25),
            (1, 3, Format::TwosComplement, 0b0000_1000, -4),
            (4, 4, Format::Binary, 0xA5, 10),
            (3, 1, Format::Bit, 0b1000, 1),
        ] {
            assert_eq!(decode(lines(low, count, format), port), value, "{port:#x} {format:?}");
        }
    }

    #[test]
    fn values_come_back_from_their_lines() {
        for format in [Format::Bit, Format::Binary, Format::Bcd, Format::TwosComplement] {
            for count in 1..=8u8 {
                for low in 0..=8 - count {
                    let lines = lines(low, count, format);
                    for value in -200..=200i16 {
                        let mut image = [0x5A];
                        drive(&mut image, 0, lines, value);
                        assert_eq!(image[0] & !mask(lines), 0x5A & !mask(lines));
                        let shown = decode(lines, image[0]);
                        let modulus = 1 << count;
                        match format {
                            Format::Bit => assert_eq!(shown, i16::from(value != 0)),
                            Format::Binary => assert_eq!(shown, value.rem_euclid(modulus)),
                            Format::TwosComplement => {
                                assert_eq!((shown - value).rem_euclid(modulus), 0);
                                assert!((-modulus / 2..modulus / 2).contains(&shown));
                            }
                            Format::Bcd => {
                                assert_eq!(fits(lines, value.into()), shown == value, "{value}");
                            }
                        }
                    }
                }
            }
        }
    }
}

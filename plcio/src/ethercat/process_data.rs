//! Values in the process data of a terminal: bits of bytes, and numbers with the lowest byte first.

use plcc_configuration::drivers::ethercat::{EthercatPoint, ProcessValue};

/// The bytes of a number of `N` bytes that begins at a byte; `None` where there are not so many.
fn bytes<const N: usize>(data: &[u8], at: usize) -> Option<[u8; N]> {
    data.get(at..at.checked_add(N)?)?.try_into().ok()
}

/// The value of a point; `None` if it lies beyond the end of the data.
pub(super) fn read(data: &[u8], point: &EthercatPoint) -> Option<f64> {
    let at = usize::from(point.byte);
    Some(match point.value {
        ProcessValue::Bit(bit) => f64::from(data.get(at)? >> bit & 1),
        ProcessValue::U8 => f64::from(*data.get(at)?),
        ProcessValue::I8 => i8::from_le_bytes(bytes(data, at)?).into(),
        ProcessValue::U16 => u16::from_le_bytes(bytes(data, at)?).into(),
        ProcessValue::I16 => i16::from_le_bytes(bytes(data, at)?).into(),
        ProcessValue::U32 => u32::from_le_bytes(bytes(data, at)?).into(),
        ProcessValue::I32 => i32::from_le_bytes(bytes(data, at)?).into(),
        ProcessValue::F32 => f32::from_le_bytes(bytes(data, at)?).into(),
    })
}

/// Sets the value of a point, rounded where it is an integer. Returns whether the point can have it; if not, or if it lies
/// beyond the end of the data, it stays as it is.
pub(super) fn write(data: &mut [u8], point: &EthercatPoint, value: f64) -> bool {
    let at = usize::from(point.byte);
    if let ProcessValue::Bit(bit) = point.value {
        let Some(byte) = data.get_mut(at) else { return false };
        *byte = *byte & !(1 << bit) | u8::from(value != 0.0) << bit;
        return true;
    }
    let (least, most) = point.value.range();
    let rounded = value.round();
    let is_float = point.value == ProcessValue::F32;
    if !(least..=most).contains(if is_float { &value } else { &rounded }) {
        return false;
    }
    let bytes = match is_float {
        true => (value as f32).to_le_bytes(),
        // The lowest bytes are the same with and without a sign.
        false => (rounded as i64 as u32).to_le_bytes(),
    };
    let length = (point.value.bits() / 8) as usize;
    match (data.get_mut(at..at.saturating_add(length)), bytes.get(..length)) {
        (Some(place), Some(bytes)) => {
            place.copy_from_slice(bytes);
            true
        }
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;

    fn point(text: &str) -> EthercatPoint {
        EthercatPoint::parse(text).unwrap()
    }

    #[test]
    fn what_is_written_is_read() {
        let mut data = [0x55; 6];
        for (place, value) in [
            ("0.0", 0.0),
            ("5.7", 1.0),
            ("1:u8", 255.0),
            ("1:i8", -128.0),
            ("1:u16", 65535.0),
            ("4:i16", -32768.0),
            ("2:u32", 4_294_967_295.0),
            ("2:i32", -2_147_483_648.0),
            ("0:f32", -0.5),
        ] {
            let point = point(&format!("e/0/out/{place}"));
            assert!(write(&mut data, &point, value), "{place}");
            assert_eq!(read(&data, &point), Some(value), "{place}");
        }
        data = [0; 6];
        assert!(write(&mut data, &point("e/0/out/1:i16"), -2.0));
        assert!(write(&mut data, &point("e/0/out/4.1"), 1.0));
        assert_eq!(data, [0, 0xFE, 0xFF, 0, 2, 0]);
    }

    #[test]
    fn what_does_not_fit_changes_nothing() {
        let mut data = [1, 2, 3];
        for (place, value) in [
            ("3.0", 1.0),
            ("2:u16", 1.0),
            ("0:u8", 255.5),
            ("0:u8", -1.0),
            ("0:i16", 32768.0),
            ("0:u16", f64::NAN),
            ("0:i32", 0.0),
            ("65535:u32", 0.0),
        ] {
            assert!(!write(&mut data, &point(&format!("e/0/out/{place}")), value), "{place}");
            assert_eq!(data, [1, 2, 3], "{place}");
        }
        for place in ["3.0", "2:u16", "0:f32", "65535:u32"] {
            assert_eq!(read(&data, &point(&format!("e/0/in/{place}"))), None, "{place}");
        }
    }
}

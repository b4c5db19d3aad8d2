//! Reading and writing numbers in the process image: little endian, and checked against its length.
//!
//! Outside the image reads give 0 and writes do nothing. Layouts are checked when a program is
//! loaded, so that this never happens; if a check were missing, there would still be no panic.

macro_rules! accessors {
    ($($read:ident $write:ident $ty:ty;)*) => {
        $(
            #[doc = concat!("Reads a `", stringify!($ty), "` at a byte offset.")]
            #[inline]
            pub fn $read(image: &[u8], offset: u32) -> $ty {
                let start = offset as usize;
                let bytes = image.get(start..start.saturating_add(size_of::<$ty>()));
                match bytes.and_then(|bytes| bytes.first_chunk()) {
                    Some(bytes) => <$ty>::from_le_bytes(*bytes),
                    None => <$ty>::default(),
                }
            }

            #[doc = concat!("Writes a `", stringify!($ty), "` at a byte offset.")]
            #[inline]
            pub fn $write(image: &mut [u8], offset: u32, value: $ty) {
                let start = offset as usize;
                let bytes = image.get_mut(start..start.saturating_add(size_of::<$ty>()));
                if let Some(bytes) = bytes.and_then(|bytes| bytes.first_chunk_mut()) {
                    *bytes = value.to_le_bytes();
                }
            }
        )*
    };
}

accessors! {
    read_u8 write_u8 u8;
    read_u16 write_u16 u16;
    read_u32 write_u32 u32;
    read_u64 write_u64 u64;
    read_i16 write_i16 i16;
    read_i32 write_i32 i32;
    read_i64 write_i64 i64;
    read_f64 write_f64 f64;
}

#[cfg(test)]
mod tests {
    #[test]
    fn reads_outside_the_image_give_zero_and_writes_change_nothing() {
        let mut image = [1, 2, 3];
        super::write_u16(&mut image, 2, 0xFFFF);
        super::write_u16(&mut image, u32::MAX, 0xFFFF);
        assert_eq!(image, [1, 2, 3]);
        assert_eq!(super::read_u16(&image, 2), 0);
        assert_eq!(super::read_u16(&image, 0), 0x0201);
    }
}

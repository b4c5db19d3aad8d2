//! Finds the processor features that some code needs and this computer does not have.

/// The features among the given ones that this processor lacks. Features have the names that Rust's
/// feature detection uses; one that is unknown here counts as lacking.
pub fn missing(features: &[String]) -> Vec<String> {
    features.iter().filter(|feature| !has(feature)).cloned().collect()
}

#[cfg(target_arch = "x86_64")]
fn has(feature: &str) -> bool {
    macro_rules! detect {
        ($($name:tt)*) => {
            match feature {
                $($name => std::arch::is_x86_feature_detected!($name),)*
                _ => false,
            }
        };
    }
    detect!("sse3" "ssse3" "sse4.1" "sse4.2" "popcnt" "cmpxchg16b" "avx" "avx2" "fma" "bmi1" "bmi2"
        "lzcnt" "avx512f" "avx512bw" "avx512cd" "avx512dq" "avx512vl" "avx512vbmi" "avx512bitalg")
}

#[cfg(not(target_arch = "x86_64"))]
fn has(_: &str) -> bool {
    false
}

#[cfg(test)]
mod tests {
    #[test]
    fn a_feature_with_an_unknown_name_is_missing() {
        assert_eq!(super::missing(&["warp9".into()]), ["warp9"]);
        assert!(super::missing(&[]).is_empty());
    }
}

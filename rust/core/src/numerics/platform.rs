//! What floating-point results depend on besides the program.

/// The target that the program was built for, and those extensions of this processor that change how its linear
/// algebra rounds.
pub fn arithmetic() -> (String, Vec<&'static str>) {
    let target = format!("{}-{}", std::env::consts::ARCH, std::env::consts::OS);
    #[cfg(target_arch = "x86_64")]
    let extensions = [
        ("avx2", std::is_x86_feature_detected!("avx2")),
        ("fma", std::is_x86_feature_detected!("fma")),
        ("avx512f", std::is_x86_feature_detected!("avx512f")),
    ];
    #[cfg(not(target_arch = "x86_64"))]
    let extensions: [(&str, bool); 0] = [];
    let present = extensions.into_iter().filter(|entry| entry.1).map(|entry| entry.0).collect();
    (target, present)
}

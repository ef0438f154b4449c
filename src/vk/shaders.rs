//! The SPIR-V that `build.rs` compiled from `glsl/`, and the memory layouts read back from it.
#![allow(missing_docs, reason = "generated; named after the files and structs in glsl/")]

include!(concat!(env!("OUT_DIR"), "/shaders.rs"));

/// Checks at compile time that a host struct lies in memory as the shaders read it.
///
/// `host_matches_shader!(GpuSlot, slot, { position: POSITION, weight: WEIGHT })`
macro_rules! host_matches_shader {
    ($host:ty, $shader:ident, { $($field:ident : $offset:ident),+ $(,)? }) => {
        const _: () = {
            use $crate::vk::shaders::layout::$shader as shader;
            assert!(size_of::<$host>() == shader::SIZE, "size differs from the shader's");
            $(assert!(
                std::mem::offset_of!($host, $field) == shader::$offset,
                concat!(stringify!($field), " lies elsewhere in the shader")
            );)+
        };
    };
}
pub(crate) use host_matches_shader;

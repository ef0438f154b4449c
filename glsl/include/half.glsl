// Values as 16-bit floats hold them, rounded to nearest: the store into an attachment may round either way
// (Vulkan, "Floating-point format conversions"), and lavapipe rounds towards zero, which darkens light by 0.03 % a store.

const float HALF_MAX = 65504.0;

// Least value of full precision: below it, halves lie 6e-8 apart, and the store rounds.
const float HALF_MIN_NORMAL = 6.104e-5;

// For values from 0 to HALF_MAX.
vec3 nearest_half(vec3 value) {
    uvec3 bits = floatBitsToUint(value);
    // 13 of the mantissa's 23 bits go; ties go to the even one.
    uvec3 rounded = (bits + 0xfffu + (bits >> 13 & 1u)) & ~uvec3(0x1fffu);
    return mix(uintBitsToFloat(rounded), value, lessThan(value, vec3(HALF_MIN_NORMAL)));
}

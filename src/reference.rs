//! Brute-force path tracer: no cache, no tricks.

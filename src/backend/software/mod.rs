//! The tiled SIMD rasterizer with a visibility buffer.

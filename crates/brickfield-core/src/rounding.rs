//! From f64 to f32 in a direction.

/// The least f32 that is not below `x`.
pub fn rounded_up(x: f64) -> f32 {
    let nearest = x as f32;
    if f64::from(nearest) < x { nearest.next_up() } else { nearest }
}

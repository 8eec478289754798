// Where a pixel lies in a picture of about half the size.

struct Place {
    low: u32,
    high: u32,
    // Of the way from low to high.
    share: f32,
}

// Half-pixel centers, one axis. The position is counted in halves of a fine pixel: integers
// are exact where a quotient in f32 would lose the fraction. Divided as a vector, both axes at
// once, Mesa 22.3's lavapipe compiles the kernel anew for each dispatch.
fn place_in_coarser(pixel: u32, size: u32, coarser_size: u32) -> Place {
    let at = max((2u * pixel + 1u) * coarser_size, size) - size;
    let low = at / (2u * size);
    return Place(low, min(low + 1u, coarser_size - 1u), f32(at % (2u * size)) / f32(2u * size));
}

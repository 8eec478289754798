//! Small damage to files.

use proptest::prelude::*;

/// One change of a file. Places are shares of its length.
#[derive(Clone, Debug)]
pub enum Mutation {
    /// Turns one bit over.
    Flip(f64, u8),
    /// Writes a number over what is there, little- or big-endian.
    Number(f64, u64, usize, bool),
    /// Leaves out so many bytes.
    Remove(f64, usize),
    /// Says so many bytes twice.
    Repeat(f64, usize),
    /// Puts bytes in.
    Insert(f64, Vec<u8>),
    /// Ends there.
    Cut(f64),
    /// Replaces the digits of a number in text.
    Digits(f64, String),
}

/// Numbers at which arithmetic goes wrong.
const NUMBERS: [u64; 16] = [
    0,
    1,
    2,
    0x7f,
    0x80,
    0xff,
    0x7fff,
    0xffff,
    0x7fff_ffff,
    0x8000_0000,
    0xffff_ffff,
    // Infinity and a NaN, of either size.
    0x7f80_0000,
    0x7fc0_0001,
    0x7ff0_0000_0000_0000,
    0x7fff_ffff_ffff_ffff,
    u64::MAX,
];

/// The same in text.
const TEXTS: [&str; 12] = [
    "",
    "-1",
    "0",
    "1e400",
    "-1e400",
    "nan",
    "inf",
    "4294967296",
    "18446744073709551616",
    "1e-400",
    "[",
    "null",
];

pub fn mutation() -> impl Strategy<Value = Mutation> {
    let place = || 0.0..1.0_f64;
    prop_oneof![
        3 => (place(), 0..8_u8).prop_map(|(at, bit)| Mutation::Flip(at, bit)),
        3 => (place(), prop::sample::select(&NUMBERS[..]), prop::sample::select(vec![1, 2, 4, 8]), any::<bool>())
            .prop_map(|(at, number, size, big)| Mutation::Number(at, number, size, big)),
        1 => (place(), 1..64_usize).prop_map(|(at, count)| Mutation::Remove(at, count)),
        1 => (place(), 1..64_usize).prop_map(|(at, count)| Mutation::Repeat(at, count)),
        1 => (place(), prop::collection::vec(any::<u8>(), 1..16)).prop_map(|(at, bytes)| Mutation::Insert(at, bytes)),
        1 => place().prop_map(Mutation::Cut),
        2 => (place(), prop::sample::select(&TEXTS[..])).prop_map(|(at, text)| Mutation::Digits(at, text.to_owned())),
    ]
}

impl Mutation {
    pub fn apply(&self, file: &mut Vec<u8>) {
        let length = file.len();
        let place = |share: f64| ((share * length as f64) as usize).min(length);
        match self {
            Self::Flip(at, bit) => {
                if let Some(byte) = file.get_mut(place(*at)) {
                    *byte ^= 1 << bit;
                }
            }
            Self::Number(at, number, size, big) => {
                let bytes = match big {
                    true => number.to_be_bytes()[8 - size..].to_vec(),
                    false => number.to_le_bytes()[..*size].to_vec(),
                };
                let at = place(*at);
                let end = (at + size).min(length);
                file[at..end].copy_from_slice(&bytes[..end - at]);
            }
            Self::Remove(at, count) => {
                let at = place(*at);
                file.drain(at..(at + count).min(length));
            }
            Self::Repeat(at, count) => {
                let at = place(*at);
                let twice = file[at..(at + count).min(length)].to_vec();
                file.splice(at..at, twice);
            }
            Self::Insert(at, bytes) => {
                let at = place(*at);
                file.splice(at..at, bytes.iter().copied());
            }
            Self::Cut(at) => file.truncate(place(*at)),
            Self::Digits(at, text) => {
                let at = place(*at);
                let number = |byte: &u8| byte.is_ascii_digit() || b".-+e".contains(byte);
                let begin = file[at..]
                    .iter()
                    .position(number)
                    .map(|skipped| at + skipped);
                let Some(begin) = begin else { return };
                let end = file[begin..].iter().position(|byte| !number(byte));
                let end = end.map_or(file.len(), |count| begin + count);
                file.splice(begin..end, text.bytes());
            }
        }
    }
}
